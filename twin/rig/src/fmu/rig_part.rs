//! A whole rig in an FMU.

use twinrig_kernel::{SimTime, Snapshot};
use twinrig_record::Fingerprint;
use twinrig_runtime::{Change, Group, Observer, Rig, RigError, RunEvent};

use crate::fmu::part::{Simulated, mismatch};
use crate::fmu::variables::Variables;

/// All groups by number, which is also the order in which their outputs claim a name.
const GROUPS: [Group; 4] = [
    Group::Plant,
    Group::ProcessInputs,
    Group::ProcessOutputs,
    Group::Diagnostics,
];

/// Newest samples of each group.
type Samples = [Vec<f64>; GROUPS.len()];

/// Observer with the newest samples, and with the scheduled changes that are not in force yet.
struct Newest<'a> {
    samples: &'a mut Samples,
    scheduled: &'a mut Vec<(usize, f64)>,
}

impl Observer for Newest<'_> {
    fn samples(&mut self, _: SimTime, group: Group, values: &[f64]) {
        self.samples[group as usize].copy_from_slice(values);
    }

    fn event(&mut self, _: SimTime, event: RunEvent) {
        if let RunEvent::Change { variable, value } = event {
            let is_this = |(index, scheduled): &(usize, f64)| {
                *index == variable && scheduled.to_bits() == value.to_bits()
            };
            if let Some(position) = self.scheduled.iter().position(is_this) {
                self.scheduled.remove(position);
            }
        }
    }
}

/// A rig whose process variables are set from outside.
pub(crate) struct RigPart {
    rig: Rig,
    fingerprint: Fingerprint,
    samples: Samples,
    /// Process variables that were set since the last step, to other values than the present ones.
    set: Vec<Option<f64>>,
    /// Changes that were scheduled and await the next control step, by index of the variable.
    scheduled: Vec<(usize, f64)>,
    now: SimTime,
    /// Whether the events of time 0 have been handled.
    has_begun: bool,
}

impl RigPart {
    /// Creates the part around a rig at its start.
    pub(crate) fn new(rig: Rig) -> (Self, Variables) {
        let process = rig.process();
        let known = process.variables();
        let mut variables = Variables::new();
        variables.add_process_variables(process.name(), known);
        let set = vec![None; known.len()];
        for group in GROUPS.into_iter().filter(|it| *it != Group::ProcessInputs) {
            variables.add_outputs(group, rig.layout(group));
        }
        variables.add_fingerprint();
        let part = Self {
            samples: GROUPS.map(|group| vec![0.0; rig.layout(group).len()]),
            fingerprint: Fingerprint::new(),
            set,
            scheduled: Vec::new(),
            now: SimTime::ZERO,
            has_begun: false,
            rig,
        };
        (part, variables)
    }

    /// Returns the value of a process variable from the next control step on, apart from values
    /// that are set and not scheduled yet.
    fn upcoming(&self, index: usize) -> f64 {
        let mut newest_first = self.scheduled.iter().rev();
        let scheduled = newest_first.find(|(known, _)| *known == index);
        let present = || self.rig.process().variables()[index].value();
        scheduled.map_or_else(present, |(_, value)| *value)
    }

    /// Schedules the values that were set, for the next control step, and returns them.
    fn schedule(&mut self) -> Result<Vec<(usize, f64)>, RigError> {
        let changes = indexed(&self.set);
        for (index, value) in &changes {
            let name = self.rig.process().variables()[*index].name().to_owned();
            self.rig.schedule(self.now, &name, Change::To(*value))?;
        }
        Ok(changes)
    }

    fn run_until(&mut self, to: SimTime) -> Result<(), RigError> {
        let changes = self.schedule()?;
        self.scheduled.extend(changes);
        self.set.fill(None);
        let newest = Newest {
            samples: &mut self.samples,
            scheduled: &mut self.scheduled,
        };
        let mut observer = (&mut self.fingerprint, newest);
        self.rig.run_until(to, &mut observer)?;
        self.now = to;
        Ok(())
    }
}

/// Returns the values that are set, with their indices.
fn indexed(set: &[Option<f64>]) -> Vec<(usize, f64)> {
    let all = set.iter().enumerate();
    all.filter_map(|(index, value)| Some((index, (*value)?)))
        .collect()
}

impl Simulated for RigPart {
    fn input(&self, index: usize) -> f64 {
        self.set[index].unwrap_or_else(|| self.upcoming(index))
    }

    /// The controller is asked at once, with all values that it will receive at the next control
    /// step: there a refusal would end the run.
    fn set_inputs(&mut self, values: &[(usize, f64)]) -> Result<(), RigError> {
        let mut set = self.set.clone();
        for &(index, value) in values {
            let is_change = value.to_bits() != self.upcoming(index).to_bits();
            set[index] = is_change.then_some(value);
        }
        if set != self.set {
            let changes = [&self.scheduled[..], &indexed(&set)].concat();
            self.rig.check_values(&changes)?;
        }
        self.set = set;
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
        let mut scheduled = self.schedule()?;
        let mut newest = Newest {
            samples: &mut self.samples,
            scheduled: &mut scheduled,
        };
        let ran = self.rig.run_until(SimTime::ZERO, &mut newest);
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
            (&self.set, &self.scheduled),
            (&self.samples, &self.fingerprint),
            self.rig.save(),
        ))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), RigError> {
        let ((now, has_begun), (set, scheduled), (samples, fingerprint), rig) =
            snapshot.read::<SavedRigPart>()?;
        let lengths = |samples: &Samples| samples.each_ref().map(Vec::len);
        let expected = self.set.len();
        if set.len() != expected
            || scheduled.iter().any(|(index, _)| *index >= expected)
            || lengths(&samples) != lengths(&self.samples)
        {
            return Err(mismatch(expected, set.len()));
        }
        self.rig.restore(&rig)?;
        (self.now, self.has_begun) = (now, has_begun);
        (self.set, self.scheduled) = (set, scheduled);
        (self.samples, self.fingerprint) = (samples, fingerprint);
        Ok(())
    }
}

type SavedRigPart = (
    (SimTime, bool),
    (Vec<Option<f64>>, Vec<(usize, f64)>),
    (Samples, Fingerprint),
    Snapshot,
);
