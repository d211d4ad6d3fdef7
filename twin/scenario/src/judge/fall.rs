//! Detection of falls.

use twinrig_kernel::SimTime;

use super::{Group, Layouts};
use crate::ground_below::GroundBelow;
use crate::scenario::FallSpec;
use crate::scene::Scene;
use twinrig_kernel::signal::{BODY_POSITION, BODY_RPY};

/// Detects the first fall of the trunk. Without observations of its height and its angles, as on
/// hardware, no fall is detected.
#[derive(Clone, Debug)]
pub(super) struct FallDetector {
    spec: FallSpec,
    ground: GroundBelow,
    /// Group and element of x; y and z follow.
    position: Option<(Group, usize)>,
    /// Group and element of roll; pitch follows.
    roll: Option<(Group, usize)>,
    /// Initial height above the ground \[m\].
    initial_height: Option<f64>,
    fell_at: Option<SimTime>,
}

impl FallDetector {
    pub fn new(scene: &Scene, layouts: &Layouts<'_>) -> Self {
        let find_vector = |name| {
            let (channel, range) = layouts.find(name)?;
            (range.len() == 3).then_some((channel, range.start))
        };
        FallDetector {
            spec: scene.scenario.fall,
            ground: scene.ground.clone(),
            position: find_vector(BODY_POSITION),
            roll: find_vector(BODY_RPY),
            initial_height: None,
            fell_at: None,
        }
    }

    /// Returns whether it evaluates the samples of a channel.
    pub fn reads(&self, channel: Group) -> bool {
        let elements = [self.position, self.roll].into_iter().flatten();
        elements.into_iter().any(|(group, _)| group == channel)
    }

    /// Returns the time of the fall.
    pub fn fell_at(&self) -> Option<SimTime> {
        self.fell_at
    }

    /// Returns the time of the fall if it ends the run.
    pub fn ended_at(&self) -> Option<SimTime> {
        self.fell_at.filter(|_| self.spec.end)
    }

    /// Evaluates the samples of a channel and returns whether a fall occurs at `now`.
    #[inline]
    pub fn sample(&mut self, now: SimTime, channel: Group, values: &[f64]) -> bool {
        if self.fell_at.is_some() {
            return false;
        }
        let is_of_channel = |element: &&(Group, usize)| element.0 == channel;
        let tilted = self
            .roll
            .as_ref()
            .filter(is_of_channel)
            .is_some_and(|(_, roll)| {
                self.is_tilted(values[*roll]) || self.is_tilted(values[roll + 1])
            });
        let low = match self.position.as_ref().filter(is_of_channel) {
            Some((_, x)) => self.is_low([values[*x], values[x + 1], values[x + 2]]),
            None => false,
        };
        if tilted || low {
            self.fell_at = Some(now);
        }
        tilted || low
    }

    /// Returns whether an angle exceeds the threshold. Values that are not finite are no fall; they
    /// fail every monitor of the signal.
    fn is_tilted(&self, angle: f64) -> bool {
        angle.is_finite() && angle.abs() > self.spec.tilt
    }

    fn is_low(&mut self, [x, y, z]: [f64; 3]) -> bool {
        let Some(ground) = self.ground.height(x, y) else {
            return false;
        };
        let height = z - ground;
        if !height.is_finite() {
            return false;
        }
        let initial = *self.initial_height.get_or_insert(height);
        // A trunk that starts at or below ground level cannot lose height.
        initial > 0.0 && height < self.spec.height * initial
    }
}
