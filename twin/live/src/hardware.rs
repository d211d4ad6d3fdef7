//! A run on hardware whose process variables visitors change. It goes on in threads of its own:
//! here are its observations, and the sending end of the changes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use twinrig_kernel::{SimDuration, SimTime, Unit};
use twinrig_rig::Assembly;
use twinrig_runtime::real_time::{RealTimeRig, Steering};
use twinrig_runtime::{Change, Group, Observer, Process, ProcessVariable, RunEvent, check_values};
use twinrig_scenario::{Outcome, RunEnd};

use crate::branch::{Act, Branch};
use crate::error::LiveError;
use crate::files::Files;
use crate::live_run::{self, LiveRun, Targets, check_slew, index_of};
use crate::request::Request;
use crate::tuning::Tuning;
use crate::watch::{Events, Watch, Watched};

/// Greatest change of a variable at the start, in multiples of its default value per second: a jump
/// of a slider does not throw the robot.
const SLEW: f64 = 1.0;

/// Observations of a run on hardware.
struct HardwareRun<'a> {
    assembly: &'a Assembly<'a>,
    watch: Watch,
    events: Events,
    now: SimTime,
    tasks: Vec<String>,
    /// A second controller, which has the variables of the one that runs: it judges values before
    /// they are sent.
    process: Box<dyn Process>,
    period: SimDuration,
    steering: Steering,
    /// Values that were sent and are not reached, by index of the variable.
    targets: BTreeMap<usize, Approached>,
    /// Changes that were made, but for those of the scenario.
    acts: Vec<Act>,
    /// Outcomes so far, as of the time from which they are taken again.
    outcomes: Vec<Outcome>,
    judged_next: SimTime,
}

/// Value that a variable approaches.
#[derive(Clone, Copy, Debug)]
struct Approached {
    value: f64,
    /// Time of the last step towards it.
    since: SimTime,
}

/// Time without a step after which a value that was sent counts as refused: there is one at each
/// control step.
const REFUSED: SimDuration = SimDuration::from_millis(500);

/// Time between two judgements of the run so far: they take time from the processors that transfers
/// need as well.
const JUDGED: SimDuration = SimDuration::from_secs(1);

impl LiveRun for HardwareRun<'_> {
    fn name(&self) -> &str {
        &self.assembly.scenario().name
    }
    fn now(&self) -> SimTime {
        self.now
    }
    fn variables(&self) -> &[ProcessVariable] {
        self.process.variables()
    }
    fn target(&self, variable: usize) -> Option<f64> {
        let sent = self.targets.get(&variable).map(|it| it.value);
        sent.or_else(|| Some(self.variables().get(variable)?.value()))
    }
    fn events(&self) -> &Events {
        &self.events
    }
    fn task(&self, index: usize) -> &str {
        self.tasks.get(index).map_or("", String::as_str)
    }
    fn outcomes(&self) -> Vec<Outcome> {
        self.outcomes.clone()
    }
    fn set_all(&mut self, values: Targets<'_>) -> Result<(), LiveError> {
        let mut indices = Vec::new();
        for &(variable, value, slew) in values {
            check_slew(slew)?;
            let names = self.variables().iter().map(ProcessVariable::name);
            indices.push((index_of(variable, names)?, value));
        }
        let checked = check_values(&mut *self.process, &indices, self.period);
        let refused = |why: String| Err(LiveError::Refused(why));
        match checked {
            Ok(Ok(())) => {}
            Ok(Err(why)) => return refused(why.to_string()),
            Err(why) => return refused(why.to_string()),
        }
        for (&(index, value), &(_, _, slew)) in indices.iter().zip(values) {
            if !self.steering.set(index, value, slew) {
                return refused("too many changes wait for the controller".to_owned());
            }
            let since = self.now;
            self.targets.insert(index, Approached { value, since });
        }
        Ok(())
    }
}

impl HardwareRun<'_> {
    /// Notes that a variable has a new value.
    fn changed(&mut self, now: SimTime, variable: usize, value: f64) {
        // The process that runs has accepted it.
        let _ = self.process.set_variable(variable, value);
        if let Some(target) = self.targets.get_mut(&variable) {
            target.since = now;
            if target.value.to_bits() == value.to_bits() {
                self.targets.remove(&variable);
            }
        }
        let mut at = self.control_step(now);
        let made = |(_, change)| matches!(change, Change::By(_)) || change == Change::To(value);
        if self.changes_of_scenario(at, variable).any(made) {
            return;
        }
        // A scenario has one change of a variable at an instant.
        if self
            .changes_of_scenario(at, variable)
            .any(|(due, _)| due == at)
        {
            at += self.period;
        }
        let step = self.acts.partition_point(|act| act.at < at);
        let mut of_step = self.acts[step..].iter().take_while(|act| act.at == at);
        if let Some(earlier) = of_step.position(|act| act.variable == variable) {
            self.acts.remove(step + earlier);
        }
        let act = Act {
            made: at,
            at,
            variable,
            value,
        };
        let next = self.acts.partition_point(|act| act.at <= at);
        self.acts.insert(next, act);
    }

    /// Drops values that the controller has refused, though they were accepted before they were
    /// sent; returns the name of a variable that has one.
    fn drop_refused(&mut self) -> Option<&str> {
        let latest = REFUSED.max(self.period * 2);
        let now = self.now;
        let is_refused = |sent: &Approached| now > sent.since + latest;
        let refused = self.targets.iter().find(|(_, sent)| is_refused(sent));
        let variable = *refused?.0;
        self.targets.retain(|_, sent| !is_refused(sent));
        self.variables().get(variable).map(ProcessVariable::name)
    }

    /// Returns the changes of a variable that the scenario makes at the control step `at`, with the
    /// times at which they are due.
    fn changes_of_scenario(
        &self,
        at: SimTime,
        variable: usize,
    ) -> impl Iterator<Item = (SimTime, Change)> {
        let name = self.process.variables().get(variable);
        let name = name.map(ProcessVariable::name);
        let period = self.period.as_nanos().max(1);
        let step = at.as_nanos() / period;
        let changes = self.assembly.changes();
        changes.filter_map(move |(due, changed, change)| {
            let is_made = Some(changed) == name && due.as_nanos().div_ceil(period) == step;
            is_made.then_some((due, change))
        })
    }

    /// Returns the control step of the iteration that an event at `now` belongs to.
    fn control_step(&self, now: SimTime) -> SimTime {
        let period = self.period.as_nanos().max(1);
        SimTime::from_nanos(now.as_nanos() / period * period)
    }
}

/// A run on hardware with its visitors.
pub struct HardwareControl<'a> {
    run: HardwareRun<'a>,
    tuning: Tuning,
    message: Option<String>,
    files: Files,
    /// Number of requests that were carried out.
    pub(crate) changes: u64,
}

impl<'a> HardwareControl<'a> {
    /// Creates the control of a run on `rig`, whose changes `steering` sends; its files are written
    /// to a folder.
    ///
    /// # Errors
    /// [`LiveError::Rig`] if the controller cannot be built.
    pub fn new(
        assembly: &'a Assembly<'a>,
        rig: &RealTimeRig,
        steering: Steering,
        folder: &Path,
    ) -> Result<Self, LiveError> {
        let run = HardwareRun {
            watch: Watch::new(assembly, rig),
            events: Events::default(),
            now: SimTime::ZERO,
            tasks: rig.task_names().map(str::to_owned).collect(),
            process: assembly.parts()?.process,
            period: rig.period(),
            steering,
            targets: BTreeMap::new(),
            acts: Vec::new(),
            outcomes: Vec::new(),
            judged_next: SimTime::ZERO,
            assembly,
        };
        Ok(Self {
            run,
            tuning: Tuning::new(folder, SLEW),
            message: None,
            files: Files::new(assembly, folder),
            changes: 0,
        })
    }

    #[cfg(feature = "server")]
    pub(crate) fn run(&self) -> &dyn LiveRun {
        &self.run
    }

    /// Carries out a request; returns the response.
    ///
    /// # Errors
    /// A refusal, which says why.
    pub fn handle(&mut self, request: &Request) -> Result<Value, String> {
        let handled = self.tuning.handle(request, &mut self.run);
        self.message = handled.clone().err();
        self.changes += 1;
        handled.map(|()| json!({ "ok": true }))
    }

    /// Returns what visitors see, apart from signals.
    pub fn state(&mut self) -> Value {
        self.judge();
        if let Some(variable) = self.run.drop_refused() {
            let refused = format!("the controller refuses the value of `{variable}`");
            self.message = Some(refused);
        }
        let mut state = self.tuning.state(&self.run);
        let own = json!({
            "status": "playing",
            "ended": null,
            "speed": 1.0,
            "branch": 0,
            "branches": [],
            "reach": null,
            "message": self.message,
        });
        live_run::extend(&mut state, own);
        state
    }

    /// Judges the run so far, if that is due.
    fn judge(&mut self) {
        let run = &mut self.run;
        if run.now < run.judged_next {
            return;
        }
        run.judged_next = run.now + JUDGED;
        run.outcomes = run.watch.outcomes(&RunEnd {
            at: run.now,
            energy: None,
            work: None,
            real_time_factor: None,
            buses: &[],
        });
    }

    /// Receives the values of a group, and passes them on.
    pub fn samples(
        &mut self,
        now: SimTime,
        group: Group,
        values: &[f64],
        caller: &mut dyn Observer,
    ) {
        self.run.now = now;
        self.watched(caller).samples(now, group, values);
    }

    /// Receives an event, and passes it on.
    pub fn event(&mut self, now: SimTime, event: RunEvent, caller: &mut dyn Observer) {
        self.run.now = now;
        self.watched(caller).event(now, event);
        if let RunEvent::Change { variable, value } = event {
            self.run.changed(now, variable, value);
        }
    }

    fn watched<'w>(&'w mut self, caller: &'w mut dyn Observer) -> Watched<'w> {
        Watched {
            watch: &mut self.run.watch,
            events: &mut self.run.events,
            caller,
        }
    }

    /// Writes the changes that were made as a scenario; returns its path, none without a change.
    ///
    /// # Errors
    /// The text of the failure.
    pub fn write_scenario(&self) -> Result<Option<PathBuf>, String> {
        let run = &self.run;
        if run.acts.is_empty() {
            return Ok(None);
        }
        let branch = Branch {
            acts: run.acts.clone(),
            reached: run.now,
            ..Branch::default()
        };
        let variables = run.variables().iter();
        let units: Vec<(String, Unit)> = variables
            .map(|variable| (variable.name().to_owned(), variable.unit()))
            .collect();
        let written = self.files.write(0, &branch, run.assembly, &units);
        written.map(Some)
    }
}
