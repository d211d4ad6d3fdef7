//! Coordinate frames over time, for programs that evaluate them: the numbers of the `/tf` messages.

use twinrig_kernel::{Layout, SimDuration, SimTime};

use super::frames::{Frames, transforms};
use super::{Signals, Skeleton};
use crate::cdr;

/// Coordinate frames of the trunk and of the leg segments over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrameSeries {
    /// Names of parent and child of each transform, parents first.
    pub links: Vec<[String; 2]>,
    /// Times of the samples.
    pub times: Vec<SimTime>,
    /// Seven numbers per sample and link: position of the child in its parent, x, y, z \[m\], and
    /// its orientation as a unit quaternion x, y, z, w.
    pub numbers: Vec<f64>,
}

impl FrameSeries {
    /// Adds the frames of a message; `None` if it is invalid or has other links than its
    /// predecessors.
    pub(crate) fn add(&mut self, now: SimTime, message: &[u8]) -> Option<()> {
        let transforms = transforms(message)?;
        if self.times.is_empty() {
            let links = transforms.iter().map(|transform| transform.link.clone());
            self.links = links.collect();
        }
        let links = transforms.iter().map(|transform| &transform.link);
        links.eq(&self.links).then_some(())?;
        self.times.push(now);
        for transform in transforms {
            self.numbers.extend(transform.numbers);
        }
        Some(())
    }
}

/// Collects the frames of a run from the samples of its plant, at the times at which a recording
/// has them.
#[derive(Debug, Clone)]
pub struct FrameSampler {
    frames: Frames,
    period: SimDuration,
    due: Option<SimTime>,
    series: FrameSeries,
}

impl FrameSampler {
    /// Creates a sampler of a plant whose samples have the given layout.
    pub fn new(skeleton: &Skeleton, layout: &Layout, period: SimDuration) -> Self {
        // Frames do not depend on the selection of recorded signals.
        let keep = |_: &str| true;
        let signals = Signals {
            layout,
            keep: &keep,
        };
        Self {
            frames: Frames::new(skeleton, &signals),
            period,
            due: Some(SimTime::ZERO),
            series: FrameSeries::default(),
        }
    }

    /// Takes a sample of the plant into account.
    pub fn sample(&mut self, now: SimTime, values: &[f64]) {
        if self.due.is_some_and(|due| now >= due) {
            self.due = now.checked_add(self.period);
            let message = self.frames.at(cdr::stamp(now), values);
            // A message of the same frames is valid and has the same links.
            let _ = self.series.add(now, message);
        }
    }

    /// Returns the collected frames.
    pub fn finish(self) -> FrameSeries {
        self.series
    }
}
