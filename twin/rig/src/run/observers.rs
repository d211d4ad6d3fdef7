//! Observers of a run: fingerprint, judge, recorder, and the caller's.

use std::io::Write;

use twinrig_kernel::{Layout, SimTime};
use twinrig_record::{Digest, Fingerprint, FootstepMessage, RecordError, Recorder, VerdictMessage};
use twinrig_runtime::{Group, Observer, RunEvent};
use twinrig_scenario::{Footstep, Judge, Outcome, Reference, RunEnd, Tracking, TrackingReport};

use crate::report::seconds;
use crate::run::executor::Executor;

/// Receives samples and footsteps of a run besides judge and recorder, without effect on the run:
/// for programs that keep them in memory.
pub trait RunObserver {
    /// Receives the layouts of the samples, before the first of them.
    fn begin(&mut self, layouts: &RunLayouts<'_>) {
        let _ = layouts;
    }

    /// Receives the values of a group at `now`.
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        let _ = (now, group, values);
    }

    /// Receives an event at `now`.
    fn event(&mut self, now: SimTime, event: RunEvent) {
        let _ = (now, event);
    }

    /// Receives a footstep after its lift-off, once its end is certain; its leg is an index into
    /// [`RunLayouts::legs`].
    fn footstep(&mut self, footstep: &Footstep) {
        let _ = footstep;
    }

    /// Is called between slices of the run, several times per simulated second, also of the
    /// reference run: to show the progress, and to poll for interrupts
    /// ([`twinrig_runtime::interrupt::Token`]).
    fn poll(&mut self, progress: &RunProgress<'_>) {
        let _ = progress;
    }

    /// Receives a note before a run on hardware on what impairs it.
    fn note(&mut self, text: &str) {
        let _ = text;
    }
}

/// Ignores the run.
impl RunObserver for () {}

/// Progress of a run, or of its reference run.
#[derive(Clone, Copy, Debug)]
pub struct RunProgress<'a> {
    /// Name of the scenario, and of the part of its run.
    pub title: &'a str,
    /// Time reached.
    pub now: SimTime,
    /// Time at which the run ends at the latest.
    pub end: SimTime,
}

/// Layouts of the samples of a run, and names of its legs.
#[derive(Clone, Copy)]
pub struct RunLayouts<'a> {
    executor: &'a dyn Executor,
    /// Names of the legs, in the order of their indices in footsteps.
    pub legs: &'a [String],
}

impl<'a> RunLayouts<'a> {
    /// Returns the layout of the values of a group.
    pub fn layout(&self, group: Group) -> &'a Layout {
        self.executor.layout(group)
    }
}

/// Observer of a reference run: it is polled only.
pub struct PolledOnly<'a>(pub &'a mut dyn RunObserver);

impl RunObserver for PolledOnly<'_> {
    fn poll(&mut self, progress: &RunProgress<'_>) {
        self.0.poll(progress);
    }
}

/// Observer that combines fingerprint, judge, recorder and caller.
pub struct RunObservers<'c, W: Write> {
    fingerprint: Fingerprint,
    recorder: Option<Recorder<W>>,
    judge: Judge,
    legs: Vec<String>,
    tracking: Option<Tracking>,
    caller: Option<&'c mut dyn RunObserver>,
    /// Names of the tasks, and the control steps at which each was busy beyond its period.
    skipped: Vec<(String, u64)>,
}

impl<'c, W: Write> RunObservers<'c, W> {
    /// Creates the observer of a run.
    pub fn new(judge: Judge, recorder: Option<Recorder<W>>) -> Self {
        Self {
            fingerprint: Fingerprint::new(),
            legs: judge.legs().map(str::to_owned).collect(),
            recorder,
            judge,
            tracking: None,
            caller: None,
            skipped: Vec::new(),
        }
    }

    /// Counts the control steps at which the tasks of `executor` were busy.
    pub(crate) fn with_tasks(mut self, executor: &dyn Executor) -> Self {
        let tasks = executor.tasks().into_iter();
        self.skipped = tasks.map(|task| (task, 0)).collect();
        self
    }

    /// Returns the names of the tasks, and the control steps at which each was busy although its
    /// period does not imply that.
    pub(crate) fn skipped(&self) -> &[(String, u64)] {
        &self.skipped
    }

    /// Adds the observer of how legs follow their commands.
    pub(crate) fn with_tracking(mut self, tracking: Option<Tracking>) -> Self {
        self.tracking = tracking;
        self
    }

    /// Returns how the legs followed their commands; none if nothing observes that.
    pub(crate) fn tracking(&self) -> Option<TrackingReport> {
        self.tracking.as_ref().map(Tracking::report)
    }

    /// Adds the observer of the caller, which receives the samples of `executor`.
    #[must_use]
    pub fn with_caller(
        mut self,
        caller: Option<&'c mut dyn RunObserver>,
        executor: &dyn Executor,
    ) -> Self {
        self.caller = caller;
        if let Some(caller) = &mut self.caller {
            caller.begin(&RunLayouts {
                executor,
                legs: &self.legs,
            });
        }
        self
    }

    /// Lets the observer of the caller poll.
    pub(crate) fn poll(&mut self, progress: &RunProgress<'_>) {
        if let Some(caller) = &mut self.caller {
            caller.poll(progress);
        }
    }

    /// Returns whether writing the recording has failed.
    pub(crate) fn is_broken(&self) -> bool {
        let recorder = self.recorder.as_ref();
        recorder.is_some_and(|recorder| recorder.failure().is_some())
    }

    /// Evaluates the expectations at the end of the run and records the remaining completed
    /// footsteps.
    pub(crate) fn judge(&mut self, run: &RunEnd) -> Vec<Outcome> {
        let outcomes = self.judge.finish(run);
        self.pass_footsteps(run.at);
        outcomes
    }

    /// Returns the outcomes that the expectations would have if the scenario ended with `run`, now.
    pub(crate) fn judged_now(&self, run: &RunEnd) -> Vec<Outcome> {
        let mut judge = self.judge.clone();
        judge.end_at(run.at);
        judge.finish(run)
    }

    /// Returns the reference for runs with changes; valid after the end of a run without changes.
    pub(crate) fn reference(&self) -> Reference {
        self.judge.reference()
    }

    /// Returns the time of the robot's fall, if one was observed.
    pub(crate) fn fell_at(&self) -> Option<SimTime> {
        self.judge.fell_at()
    }

    /// Ends the scenario at `at`, as its plant has.
    pub(crate) fn end_at(&mut self, at: SimTime) {
        self.judge.end_at(at);
    }

    /// Returns the time of a fall that ended the run.
    pub(crate) fn ended_at(&self) -> Option<SimTime> {
        self.judge.ended_at()
    }

    /// Passes the footsteps completed by the last samples to recorder and caller.
    fn pass_footsteps(&mut self, now: SimTime) {
        if let Some(tracking) = &mut self.tracking
            && self.judge.fell_at().is_none()
        {
            for footstep in self.judge.closed() {
                tracking.footstep(footstep);
            }
        }
        // The run may end within a footstep.
        let closed = self.judge.closed().iter();
        for footstep in closed.filter(|footstep| footstep.lift_off.is_some()) {
            if let Some(recorder) = &mut self.recorder {
                write(recorder, &self.legs, now, footstep);
            }
            if let Some(caller) = &mut self.caller {
                caller.footstep(footstep);
            }
        }
    }

    pub(crate) fn digest(&self) -> Digest {
        self.fingerprint.digest()
    }

    /// Writes the verdict and closes the recording.
    pub(crate) fn close(
        self,
        reached: SimTime,
        verdict: &VerdictMessage,
    ) -> Result<Option<W>, RecordError> {
        let digest = self.digest();
        let close = |mut recorder: Recorder<W>| {
            recorder.message(reached, verdict);
            recorder.finish(digest, reached)
        };
        self.recorder.map(close).transpose()
    }
}

fn write<W: Write>(recorder: &mut Recorder<W>, legs: &[String], now: SimTime, footstep: &Footstep) {
    let Some(lift_off) = footstep.lift_off else {
        return;
    };
    let message = FootstepMessage {
        leg: legs.get(footstep.leg).cloned().unwrap_or_default(),
        touch_down_s: seconds(footstep.touch_down.as_nanos()),
        lift_off_s: seconds(lift_off.as_nanos()),
        position_m: Some(footstep.position),
        slip_m: footstep.slip,
        impulse_ns: footstep.impulse,
        peak_load_n: footstep.peak_load,
    };
    recorder.message(now, &message);
}

impl<W: Write> Observer for RunObservers<'_, W> {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        Observer::samples(&mut self.fingerprint, now, group, values);
        self.judge.samples(now, group, values);
        // The legs of a robot that has fallen do not walk.
        if let Some(tracking) = &mut self.tracking
            && self.judge.fell_at().is_none()
        {
            tracking.samples(now, group, values);
        }
        if let Some(recorder) = &mut self.recorder {
            Observer::samples(recorder, now, group, values);
        }
        if let Some(caller) = &mut self.caller {
            caller.samples(now, group, values);
        }
        self.pass_footsteps(now);
    }

    fn event(&mut self, now: SimTime, event: RunEvent) {
        Observer::event(&mut self.fingerprint, now, event);
        self.judge.event(now, event);
        if let RunEvent::TaskSkipped {
            task,
            implied: false,
        } = event
            && let Some((_, count)) = self.skipped.get_mut(task)
        {
            *count += 1;
        }
        if let Some(recorder) = &mut self.recorder {
            Observer::event(recorder, now, event);
        }
        if let Some(caller) = &mut self.caller {
            caller.event(now, event);
        }
    }

    fn bytes(&mut self, now: SimTime, trace: usize, bytes: &[u8]) {
        Observer::bytes(&mut self.fingerprint, now, trace, bytes);
        if let Some(recorder) = &mut self.recorder {
            Observer::bytes(recorder, now, trace, bytes);
        }
    }
}
