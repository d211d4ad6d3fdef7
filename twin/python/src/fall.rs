//! Falls of the robot of a stepped rig, by the thresholds of its scenario.

use twinrig::kernel::signal::{BODY_POSITION, BODY_RPY};
use twinrig::scenario::{FallSpec, GroundBelow, Scene};

/// Thresholds of a fall, as of the key `fall` of a scenario.
pub(crate) struct Fall {
    spec: FallSpec,
    ground: GroundBelow,
    /// Height of the trunk above the ground at time 0 \[m\]; none without a trunk or ground.
    initial: Option<f64>,
}

impl Fall {
    /// Creates the thresholds of a scene; `newest` returns the values of a signal at time 0.
    pub(crate) fn new<'v>(scene: &Scene, newest: impl Fn(&str) -> Option<&'v [f64]>) -> Self {
        let mut fall = Self {
            spec: scene.scenario.fall,
            ground: scene.ground.clone(),
            initial: None,
        };
        fall.initial = newest(BODY_POSITION).and_then(|position| fall.height(position));
        fall
    }

    /// Returns the height of the trunk above the ground below it \[m\].
    fn height(&self, position: &[f64]) -> Option<f64> {
        let [x, y, z] = *position else { return None };
        Some(z - self.ground.height(x, y)?).filter(|height| height.is_finite())
    }

    /// Returns whether the robot is tilted too far or too low. Without signals of the trunk it is
    /// not.
    pub(crate) fn holds<'v>(&self, newest: impl Fn(&str) -> Option<&'v [f64]>) -> bool {
        let is_tilted = |rpy: &[f64]| rpy.iter().take(2).any(|angle| angle.abs() > self.spec.tilt);
        let height = newest(BODY_POSITION).and_then(|position| self.height(position));
        let is_low = height.zip(self.initial).is_some_and(|(height, initial)| {
            // A trunk that starts at or below the ground cannot lose height.
            initial > 0.0 && height < self.spec.height * initial
        });
        is_low || newest(BODY_RPY).is_some_and(is_tilted)
    }
}
