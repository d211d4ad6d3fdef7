//! A whole rig in an FMU.

use twinrig_kernel::{SimTime, Snapshot};
use twinrig_record::Fingerprint;
use twinrig_runtime::{
    Change, Group, Observer, ProcessVariable, Rig, RigError, RunEvent, VariableError,
};

use crate::fmu::part::{Simulated, mismatch};
use crate::fmu::variables::Variables;

/// Groups of outputs, in the order in which they claim a name.
const GROUPS: [Group; 3] = [Group::Plant, Group::ProcessOutputs, Group::Diagnostics];
const ALL_GROUPS: usize = 4;

/// Newest samples of each group.
type Samples = [Vec<f64>; ALL_GROUPS];

/// Observer with the newest samples.
struct Newest<'a>(&'a mut Samples);

impl Observer for Newest<'_> {
    fn samples(&mut self, _: SimTime, group: Group, values: &[f64]) {
        self.0[group as usize].copy_from_slice(values);
    }
    fn event(&mut self, _: SimTime, _: RunEvent) {}
}

/// A rig whose process variables are set from outside.
pub(crate) struct RigPart {
    rig: Rig,
    fingerprint: Fingerprint,
    samples: Samples,
    /// Process variables as set.
    inputs: Vec<f64>,
    /// The same as scheduled: a change is scheduled when it is set, not whenever the value differs
    /// from the controller's, so that the scenario's own changes last.
    scheduled: Vec<f64>,
    now: SimTime,
    /// Whether the events of time 0 have been handled.
    has_begun: bool,
}

impl RigPart {
    /// Creates the part around a rig at its start.
    pub(crate) fn new(rig: Rig) -> (Self, Variables) {
        let process = rig.process();
        let known = process.variables();
        let inputs: Vec<f64> = known.iter().map(ProcessVariable::value).collect();
        let mut variables = Variables::new();
        variables.add_process_variables(process.name(), known);
        for group in GROUPS {
            variables.add_outputs(group, rig.layout(group));
        }
        variables.add_fingerprint();
        let all = [
            Group::Plant,
            Group::ProcessInputs,
            Group::ProcessOutputs,
            Group::Diagnostics,
        ];
        let part = Self {
            samples: all.map(|group| vec![0.0; rig.layout(group).len()]),
            fingerprint: Fingerprint::new(),
            scheduled: inputs.clone(),
            inputs,
            now: SimTime::ZERO,
            has_begun: false,
            rig,
        };
        (part, variables)
    }

    /// Schedules the inputs that have changed, for the next control step.
    fn schedule(&mut self) -> Result<(), RigError> {
        for (index, value) in self.inputs.iter().enumerate() {
            if value.to_bits() != self.scheduled[index].to_bits() {
                let name = self.rig.process().variables()[index].name().to_owned();
                self.rig.schedule(self.now, &name, Change::To(*value))?;
            }
        }
        Ok(())
    }

    fn run_until(&mut self, to: SimTime) -> Result<(), RigError> {
        self.schedule()?;
        self.scheduled.clone_from(&self.inputs);
        let mut observer = (&mut self.fingerprint, Newest(&mut self.samples));
        self.rig.run_until(to, &mut observer)?;
        self.now = to;
        Ok(())
    }
}

impl Simulated for RigPart {
    fn input(&self, index: usize) -> f64 {
        self.inputs[index]
    }

    fn set_input(&mut self, index: usize, value: f64) -> Result<(), VariableError> {
        self.rig.process().variables()[index].check(value)?;
        self.inputs[index] = value;
        Ok(())
    }

    fn begin(&mut self) -> Result<(), RigError> {
        self.run_until(SimTime::ZERO)?;
        self.has_begun = true;
        Ok(())
    }

    fn advance(&mut self, to: SimTime) -> Result<(), RigError> {
        self.run_until(to)
    }

    fn now(&self) -> SimTime {
        self.now
    }

    /// Outputs are the newest samples. Before the rig has begun they are those of time 0 under the
    /// present inputs, by a run to time 0 that is then taken back.
    fn observe(&mut self) -> Result<(), RigError> {
        if self.has_begun {
            return Ok(());
        }
        let saved = self.rig.save();
        self.schedule()?;
        let ran = self
            .rig
            .run_until(SimTime::ZERO, &mut Newest(&mut self.samples));
        self.rig.restore(&saved)?;
        ran
    }

    fn output(&self, group: Group, index: usize) -> f64 {
        self.samples[group as usize][index]
    }

    fn fingerprint(&self) -> Option<String> {
        Some(self.fingerprint.digest().to_string())
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(
            (self.now, self.has_begun),
            (&self.inputs, &self.scheduled),
            (&self.samples, &self.fingerprint),
            self.rig.save(),
        ))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), RigError> {
        let ((now, has_begun), (inputs, scheduled), (samples, fingerprint), rig) =
            snapshot.read::<SavedRigPart>()?;
        let lengths = |samples: &Samples| samples.each_ref().map(Vec::len);
        let expected = self.inputs.len();
        if inputs.len() != expected
            || scheduled.len() != expected
            || lengths(&samples) != lengths(&self.samples)
        {
            return Err(mismatch(expected, inputs.len()));
        }
        self.rig.restore(&rig)?;
        (self.now, self.has_begun) = (now, has_begun);
        (self.inputs, self.scheduled) = (inputs, scheduled);
        (self.samples, self.fingerprint) = (samples, fingerprint);
        Ok(())
    }
}

type SavedRigPart = (
    (SimTime, bool),
    (Vec<f64>, Vec<f64>),
    (Samples, Fingerprint),
    Snapshot,
);
