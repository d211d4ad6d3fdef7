//! Time travel and changes of a rig in virtual time.

mod acts;

use std::collections::BTreeMap;
use std::path::Path;

use twinrig_kernel::{SimDuration, SimTime, Unit};
use twinrig_record::Digest;
use twinrig_rig::Assembly;
use twinrig_runtime::{Observer, ProcessVariable, Rig, RigError, catch_panic};
use twinrig_scenario::{Outcome, RunEnd};

use crate::branch::{Branch, Target};
use crate::error::LiveError;
use crate::live_run::{LiveRun, Targets};
use crate::snapshots::{Reach, Saved, Snapshots};
use crate::watch::{Event, Events, Watch, Watched};

/// Why a run does not go on. It can be sought back.
#[derive(Clone, Debug, PartialEq)]
pub enum Ended {
    /// The scenario has ended.
    Scenario,
    /// The robot has fallen, which ends the run.
    Fall,
    /// The plant has ended the run regularly.
    Plant,
    /// A part has failed, or the program is requested to end.
    Failed(String),
}

/// A run in virtual time that is advanced, sought back and changed.
///
/// A change is applied at the control step after the present instant, as a `[[change]]` at that
/// instant is. One that is made in the past of the branch, at an earlier instant than the branch
/// has reached, begins another branch; without a change, the branch goes on as it did.
pub struct Session<'a> {
    assembly: &'a Assembly<'a>,
    rig: Rig,
    watch: Watch,
    events: Events,
    /// Instant up to which all events have been handled.
    now: SimTime,
    ended: Option<Ended>,
    branches: Vec<Branch>,
    /// Index of the present branch.
    present: usize,
    /// Number of its acts that the rig knows.
    scheduled: usize,
    /// Changes to be made, by index of the variable.
    targets: BTreeMap<usize, Target>,
    snapshots: Result<Snapshots, String>,
    variables: Vec<(String, Unit)>,
}

/// Memory that a judge takes at most: most of it is the detection of load cycles, and each
/// expectation adds some \[bytes\].
const JUDGE_BYTES: [usize; 2] = [512 << 10, 8 << 10];

impl<'a> Session<'a> {
    /// Creates a session at the start of the scenario, whose saved states take `limit` bytes at
    /// most.
    ///
    /// # Errors
    /// [`LiveError::Rig`] if the rig cannot be built.
    pub fn new(assembly: &'a Assembly<'a>, limit: usize) -> Result<Self, LiveError> {
        let mut rig = assembly.rig()?;
        let watch = Watch::new(assembly, &rig);
        let saved = rig.save();
        let snapshots = match rig.restore(&saved) {
            Ok(()) => {
                let [judge, of_each] = JUDGE_BYTES;
                let watch_bytes = judge + of_each * assembly.scenario().expectations.len();
                let start = Saved {
                    at: SimTime::ZERO,
                    rig: saved,
                    watch: watch.clone(),
                    scheduled: 0,
                };
                Ok(Snapshots::new(start, watch_bytes, limit))
            }
            Err(error) => {
                rig = assembly.rig()?;
                Err(assembly.rig_error(error).to_string())
            }
        };
        let variables = rig.process().variables().iter();
        let variables = variables.map(|it| (it.name().to_owned(), it.unit()));
        Ok(Self {
            assembly,
            variables: variables.collect(),
            rig,
            watch,
            events: Events::default(),
            now: SimTime::ZERO,
            ended: None,
            branches: vec![Branch::default()],
            present: 0,
            scheduled: 0,
            targets: BTreeMap::new(),
            snapshots,
        })
    }

    /// Returns the rig, for its layouts, names, variables and traffic.
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// Returns the instant up to which all events have been handled.
    pub fn now(&self) -> SimTime {
        self.now
    }

    pub(crate) fn assembly(&self) -> &'a Assembly<'a> {
        self.assembly
    }

    /// Returns names and units of the variables.
    pub(crate) fn units(&self) -> &[(String, Unit)] {
        &self.variables
    }

    /// Returns the end of the scenario.
    pub fn end(&self) -> SimTime {
        self.assembly.end()
    }

    /// Returns the next instant at which a control step may be.
    pub fn next_control_step(&self) -> SimTime {
        next_multiple(self.now, self.assembly.period())
    }

    /// Returns why the run does not go on; none if it does.
    pub fn ended(&self) -> Option<&Ended> {
        self.ended.as_ref()
    }

    /// Returns all branches; the first is the run of the scenario.
    pub fn branches(&self) -> &[Branch] {
        &self.branches
    }

    /// Returns a branch.
    ///
    /// # Errors
    /// [`LiveError::NoSuchBranch`].
    pub fn branch(&self, number: usize) -> Result<&Branch, LiveError> {
        let count = self.branches.len();
        let branch = number;
        let no_such = LiveError::NoSuchBranch { branch, count };
        self.branches.get(number).ok_or(no_such)
    }

    /// Returns the index of the present branch.
    pub fn present(&self) -> usize {
        self.present
    }

    /// Returns the fingerprint of the run up to the present instant.
    pub fn fingerprint(&self) -> Digest {
        self.watch.fingerprint.digest()
    }

    /// Returns the newest events, and the number of all so far.
    pub fn events(&self) -> (impl Iterator<Item = &Event>, u64) {
        (self.events.newest.iter(), self.events.count)
    }

    /// Returns how far back the run can be sought.
    ///
    /// # Errors
    /// [`LiveError::NoPast`] if a part does not save its state.
    pub fn reach(&self) -> Result<Reach, LiveError> {
        Ok(self.snapshots()?.reach())
    }

    fn snapshots(&self) -> Result<&Snapshots, LiveError> {
        let snapshots = self.snapshots.as_ref();
        snapshots.map_err(|why| LiveError::NoPast(why.clone()))
    }

    /// Returns the outcomes that the expectations would have if the scenario ended now.
    pub fn outcomes(&self) -> Vec<Outcome> {
        let plant = self.rig.plant();
        self.watch.outcomes(&RunEnd {
            at: self.now,
            energy: Some(plant.energy()),
            work: Some(plant.work()),
            real_time_factor: None,
            buses: &self.rig.buses(),
        })
    }

    /// Returns the variables of the controller with their present values.
    pub fn variables(&self) -> &[ProcessVariable] {
        self.rig.process().variables()
    }

    /// Advances to `to`, or to where the run ends.
    pub fn advance(&mut self, to: SimTime, caller: &mut dyn Observer) {
        self.run(to, false, caller);
    }

    /// Advances to the next event, at most to `limit`, and returns the newest event if there was
    /// one.
    pub fn advance_to_event(
        &mut self,
        limit: SimTime,
        caller: &mut dyn Observer,
    ) -> Option<&Event> {
        self.run(limit, true, caller).then_some(())?;
        self.events.newest.back()
    }

    /// Advances to `to`, or to the next event; returns whether there was one.
    fn run(&mut self, to: SimTime, to_event: bool, caller: &mut dyn Observer) -> bool {
        let to = to.min(self.assembly.end());
        let mut is_at_event = false;
        while self.ended.is_none() && self.now < to && !is_at_event {
            self.make_acts();
            is_at_event = self.run_undisturbed(self.next_stop(to), to_event, caller);
            if self.ended.is_none() {
                self.save();
            }
        }
        if self.now >= self.assembly.end() && self.ended.is_none() {
            self.ended = Some(Ended::Scenario);
        }
        let fingerprint = self.fingerprint();
        let branch = &mut self.branches[self.present];
        if self.now >= branch.reached {
            branch.reached = self.now;
            branch.fingerprint = Some(fingerprint);
        }
        is_at_event
    }

    /// Returns the next instant at which something is done between events, at most `to`.
    fn next_stop(&self, to: SimTime) -> SimTime {
        let scenario = self.assembly.scenario();
        let after = |period: SimDuration| next_multiple(self.now, period);
        let observation = scenario
            .ends_with_a_fall()
            .then(|| after(scenario.observe.period));
        let saving = self.snapshots.as_ref().ok().map(|it| it.next(self.now));
        let act = self.branches[self.present].acts.get(self.scheduled);
        let act = act.map(|act| act.made);
        let step = (!self.targets.is_empty()).then(|| after(self.rig.period()));
        let stops = [observation, saving, act, step].into_iter().flatten();
        stops.fold(to, SimTime::min)
    }

    fn run_undisturbed(&mut self, to: SimTime, to_event: bool, caller: &mut dyn Observer) -> bool {
        let before = self.events.count;
        let Self {
            rig, watch, events, ..
        } = self;
        let mut watched = Watched {
            watch,
            events,
            caller,
        };
        let ran = catch_panic(|| {
            if !to_event {
                return rig.run_until(to, &mut watched).map(|()| to);
            }
            while let Some(time) = rig.step(to, &mut watched)? {
                if watched.events.count > before {
                    rig.run_until(time, &mut watched)?;
                    return Ok(time);
                }
            }
            Ok(to)
        });
        match ran {
            Ok(Ok(reached)) => self.now = reached,
            Ok(Err(RigError::Plant(fault))) if self.rig.plant().has_ended() => {
                self.watch.judge.end_at(fault.time);
                self.now = fault.time;
                self.ended = Some(Ended::Plant);
            }
            Ok(Err(error)) => {
                self.now = self.rig.now();
                let text = self.assembly.rig_error(error).to_string();
                self.ended = Some(Ended::Failed(text));
            }
            Err(panic) => {
                self.now = self.rig.now();
                self.ended = Some(Ended::Failed(panic.to_string()));
            }
        }
        if self.ended.is_none() && self.watch.judge.ended_at().is_some() {
            self.ended = Some(Ended::Fall);
        }
        to_event && self.events.count > before
    }

    /// Saves the present state, if that is due.
    fn save(&mut self) {
        let Ok(snapshots) = &mut self.snapshots else {
            return;
        };
        if snapshots.lacks(self.now) {
            snapshots.add(Saved {
                at: self.now,
                rig: self.rig.save(),
                watch: self.watch.clone(),
                scheduled: self.scheduled,
            });
        }
    }

    /// Goes to an instant of the present branch: back to a saved state and forth from there, or on.
    ///
    /// # Errors
    /// [`LiveError::PastEnd`], or [`LiveError::NoPast`] if a part does not save its state.
    pub fn seek(&mut self, at: SimTime, caller: &mut dyn Observer) -> Result<(), LiveError> {
        let end = self.assembly.end();
        if at > end {
            return Err(LiveError::PastEnd { at, end });
        }
        self.targets.clear();
        if at < self.now || self.ended.is_some() {
            self.restore(at)?;
        }
        self.advance(at, caller);
        Ok(())
    }

    /// Goes to a branch, at the instant that it has reached or at an earlier one.
    ///
    /// # Errors
    /// [`LiveError::NoSuchBranch`], or as [`Self::seek`].
    pub fn select(
        &mut self,
        branch: usize,
        at: Option<SimTime>,
        caller: &mut dyn Observer,
    ) -> Result<(), LiveError> {
        let other = self.branch(branch)?;
        let at = at.map_or(other.reached, |at| at.min(other.reached));
        let common = other.common(&self.branches[self.present]);
        self.snapshots()?;
        self.targets.clear();
        self.present = branch;
        if let Ok(snapshots) = &mut self.snapshots {
            snapshots.truncate(common);
        }
        self.restore(at)?;
        self.advance(at, caller);
        Ok(())
    }

    /// Restores the latest saved state at `at` or before.
    fn restore(&mut self, at: SimTime) -> Result<(), LiveError> {
        let saved = self.snapshots()?.before(at).clone();
        if matches!(self.ended, Some(Ended::Failed(_))) {
            // After a panic of a part, no part is called again.
            self.rig = self.assembly.rig()?;
        }
        let restored = self.rig.restore(&saved.rig);
        restored.map_err(|error| LiveError::NoPast(self.assembly.rig_error(error).to_string()))?;
        self.watch = saved.watch;
        self.scheduled = saved.scheduled;
        self.now = saved.at;
        self.ended = None;
        self.events.truncate(self.now);
        Ok(())
    }

    /// Returns the scenario of a branch, for a file in the folder `to`: read again, it has the
    /// changes of the branch.
    ///
    /// # Errors
    /// [`LiveError::NoSuchBranch`], or [`LiveError::Branch`] if the scenario has other changes than
    /// the branch.
    pub fn text_of(&self, branch: usize, to: &Path) -> Result<String, LiveError> {
        let branch = self.branch(branch)?;
        branch.text(self.assembly, &self.variables, to)
    }
}

impl LiveRun for Session<'_> {
    fn name(&self) -> &str {
        &self.assembly.scenario().name
    }
    fn now(&self) -> SimTime {
        self.now
    }
    fn variables(&self) -> &[ProcessVariable] {
        self.variables()
    }
    fn target(&self, variable: usize) -> Option<f64> {
        self.target(variable)
    }
    fn events(&self) -> &Events {
        &self.events
    }
    fn task(&self, index: usize) -> &str {
        self.rig.task_names().nth(index).unwrap_or_default()
    }
    fn outcomes(&self) -> Vec<Outcome> {
        self.outcomes()
    }
    fn set_all(&mut self, values: Targets<'_>) -> Result<(), LiveError> {
        self.set_all(values)
    }
}

/// Returns the first multiple of `period` after `now`.
fn next_multiple(now: SimTime, period: SimDuration) -> SimTime {
    let period = period.as_nanos().max(1);
    SimTime::from_nanos((now.as_nanos() / period + 1).saturating_mul(period))
}
