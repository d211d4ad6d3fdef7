//! Falls of the robot of a stepped rig, by the thresholds of its scenario.

use twinrig::kernel::signal::{BODY_POSITION, BODY_RPY};
use twinrig::scenario::{FallSpec, GroundBelow, Scene};

use crate::rig_state::{Latest, Place, RigState};

/// Thresholds of a fall, as of the key `fall` of a scenario.
pub(crate) struct Fall {
    spec: FallSpec,
    ground: GroundBelow,
    position: Option<Place>,
    rpy: Option<Place>,
    /// Height of the trunk above the ground at time 0 \[m\]; none without a trunk or ground.
    initial: Option<f64>,
}

impl Fall {
    /// Creates the thresholds of a scene, whose rig is at time 0.
    pub(crate) fn new(scene: &Scene, state: &RigState) -> Self {
        let mut fall = Self {
            spec: scene.scenario.fall,
            ground: scene.ground.clone(),
            position: state.place(BODY_POSITION),
            rpy: state.place(BODY_RPY),
            initial: None,
        };
        fall.initial = fall.height(&state.latest);
        fall
    }

    /// Returns the height of the trunk above the ground below it \[m\].
    fn height(&self, latest: &Latest) -> Option<f64> {
        let [x, y, z] = *latest.values(self.position.as_ref()?) else {
            return None;
        };
        Some(z - self.ground.height(x, y)?).filter(|height| height.is_finite())
    }

    /// Returns whether the robot is tilted too far or too low. Without signals of the trunk it is
    /// not.
    pub(crate) fn holds(&self, latest: &Latest) -> bool {
        let is_tilted = |rpy: &[f64]| rpy.iter().take(2).any(|angle| angle.abs() > self.spec.tilt);
        let is_low = self.height(latest).zip(self.initial);
        let is_low = is_low.is_some_and(|(height, initial)| {
            // A trunk that starts at or below the ground cannot lose height.
            initial > 0.0 && height < self.spec.height * initial
        });
        is_low
            || self
                .rpy
                .as_ref()
                .is_some_and(|rpy| is_tilted(latest.values(rpy)))
    }
}
