//! Friction on ground with patches.

use nalgebra::Vector3;
use twinrig_contact::Ground;
use twinrig_kernel::SimTime;

use crate::LEGS;
use crate::dynamics::Dynamics;
use crate::friction::Friction;

/// Coefficients of friction that change. Steps end where a patch begins or ends in time; within a
/// step the friction of a part is that at its place at the beginning of the step.
#[derive(Debug, Clone)]
pub(crate) struct GroundFriction {
    ground: Ground,
    /// Those of the dynamics.
    friction: Friction,
}

impl GroundFriction {
    /// Creates the friction of a ground; none without patches, where it does not change.
    pub(crate) fn new(ground: Option<&Ground>) -> Option<Self> {
        let ground = ground.filter(|ground| ground.has_patches())?;
        Some(Self {
            friction: Friction {
                legs: [ground.friction; LEGS],
                trunk: ground.friction,
            },
            ground: ground.clone(),
        })
    }

    /// Returns the end of the step from `now` to at most `next` without a change in time.
    pub(crate) fn step_end(&self, now: SimTime, next: SimTime) -> SimTime {
        let change = self.ground.next_change(now);
        change.map_or(next, |at| at.min(next))
    }

    /// Sets the friction at the present places of feet and trunk.
    pub(crate) fn apply<D: Dynamics + ?Sized>(&mut self, now: SimTime, dynamics: &mut D) {
        // Feet are readings, which some dynamics compute on demand.
        dynamics.update_readings();
        let at = |place: Vector3<f64>| self.ground.friction_at(place.x, now);
        let friction = Friction {
            legs: dynamics.feet().map(|foot| at(foot.position)),
            trunk: at(dynamics.position()),
        };
        if friction != self.friction {
            self.friction = friction;
            dynamics.set_friction(&friction);
        }
    }

    /// Sets the friction of dynamics that were rebuilt or are restored.
    pub(crate) fn set<D: Dynamics + ?Sized>(&self, dynamics: &mut D) {
        dynamics.set_friction(&self.friction);
    }

    /// Returns the state to be serialised.
    pub(crate) fn save(&self) -> Friction {
        self.friction
    }

    /// Restores a saved state.
    pub(crate) fn restore(&mut self, saved: Friction) {
        self.friction = saved;
    }
}
