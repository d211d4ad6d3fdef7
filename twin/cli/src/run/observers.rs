//! Observers of a run: fingerprint, recorder and judge.

use std::io::Write;

use twinrig_kernel::SimTime;
use twinrig_record::{Digest, Fingerprint, FootstepMessage, RecordError, Recorder, VerdictMessage};
use twinrig_runtime::{Group, Observer, RunEvent};
use twinrig_scenario::{Footstep, Judge, Outcome, Reference, RunEnd};

use crate::report::seconds;

/// Observer that combines fingerprint, recorder and judge.
pub(crate) struct RunObservers<W: Write> {
    fingerprint: Fingerprint,
    recorder: Option<Recorder<W>>,
    judge: Judge,
    legs: Vec<String>,
}

impl<W: Write> RunObservers<W> {
    pub(crate) fn new(judge: Judge, recorder: Option<Recorder<W>>) -> Self {
        Self {
            fingerprint: Fingerprint::new(),
            legs: judge.legs().map(str::to_owned).collect(),
            recorder,
            judge,
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
        self.write_footsteps(run.at);
        outcomes
    }

    /// Returns the reference for runs with changes; valid after the end of a run without changes.
    pub(crate) fn reference(&self) -> Reference {
        self.judge.reference()
    }

    /// Returns the time of the robot's fall, if one was observed.
    pub(crate) fn fell_at(&self) -> Option<SimTime> {
        self.judge.fell_at()
    }

    /// Returns the time of a fall that ended the run.
    pub(crate) fn ended_at(&self) -> Option<SimTime> {
        self.judge.ended_at()
    }

    fn write_footsteps(&mut self, now: SimTime) {
        if let Some(recorder) = &mut self.recorder {
            for footstep in self.judge.closed() {
                write(recorder, &self.legs, now, footstep);
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

impl<W: Write> Observer for RunObservers<W> {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        Observer::samples(&mut self.fingerprint, now, group, values);
        self.judge.samples(now, group, values);
        if let Some(recorder) = &mut self.recorder {
            Observer::samples(recorder, now, group, values);
            for footstep in self.judge.closed() {
                write(recorder, &self.legs, now, footstep);
            }
        }
    }

    fn event(&mut self, now: SimTime, event: RunEvent) {
        Observer::event(&mut self.fingerprint, now, event);
        self.judge.event(now, event);
        if let Some(recorder) = &mut self.recorder {
            Observer::event(recorder, now, event);
        }
    }

    fn bytes(&mut self, now: SimTime, trace: usize, bytes: &[u8]) {
        Observer::bytes(&mut self.fingerprint, now, trace, bytes);
        if let Some(recorder) = &mut self.recorder {
            Observer::bytes(recorder, now, trace, bytes);
        }
    }
}
