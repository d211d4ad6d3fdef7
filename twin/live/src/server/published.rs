//! Samples of a run for visitors: at most so many per second as a screen shows.

use foxglove::FoxgloveError;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_record::Encoder;
use twinrig_rig::run::executor::Executor;
use twinrig_runtime::{Group, Observer, RunEvent};

use super::sink::Topics;

/// Observer that publishes samples and events.
pub(super) struct Published {
    encoder: Encoder<Topics>,
    /// Simulated time between two samples of a group.
    period: SimDuration,
    /// Time from which the next sample of each group is published.
    due: [SimTime; 4],
    /// The robot as URDF.
    description: String,
    /// Last sample of the plant.
    plant: Option<SimTime>,
    values: Vec<f64>,
}

impl Published {
    /// Simulated time between two sets of coordinate frames.
    pub(super) const FRAMES: SimDuration = SimDuration::from_millis(20);
    /// Simulated time between two samples of a group in virtual time.
    pub(super) const SAMPLES: SimDuration = SimDuration::from_millis(5);

    pub(super) fn new(
        mut encoder: Encoder<Topics>,
        executor: &dyn Executor,
        description: String,
        period: SimDuration,
    ) -> Result<Self, FoxgloveError> {
        encoder.sink().failure()?;
        Ok(Self {
            encoder,
            period,
            due: [SimTime::ZERO; 4],
            description,
            plant: None,
            values: vec![0.0; executor.layout(Group::Plant).len()],
        })
    }

    /// Continues at an earlier time.
    pub(super) fn restart(&mut self) {
        self.encoder.restart();
        self.due = [SimTime::ZERO; 4];
    }

    /// Publishes the description of the robot, for visitors who have come since the last time.
    pub(super) fn describe(&mut self, now: SimTime) {
        self.encoder.describe(now, &self.description);
    }

    /// Returns the last sample of the plant.
    pub(super) fn plant(&self) -> Option<(SimTime, &[f64])> {
        Some((self.plant?, &self.values))
    }
}

impl Observer for Published {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        if group == Group::Plant {
            self.plant = Some(now);
            self.values.copy_from_slice(values);
        }
        let due = &mut self.due[group as usize];
        if now >= *due {
            *due = now + self.period;
            self.encoder.sample(now, group, values);
        }
    }

    fn event(&mut self, now: SimTime, event: RunEvent) {
        self.encoder.event(now, event);
    }
}
