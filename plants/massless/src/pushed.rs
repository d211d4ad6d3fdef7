//! Forces of pushes at the midpoint of a step.

use nalgebra::{Matrix3, Vector3};
use twinrig_legged::{ExternalLoad, LEGS};

use crate::rows::LegKinematics;
use crate::state::State;

/// Forces of pushes, trunk axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pushed {
    /// Force on the trunk \[N\], and torque about the centre of mass of the model \[N·m\].
    pub(crate) force: Vector3<f64>,
    pub(crate) torque: Vector3<f64>,
    /// Forces on the feet \[N\].
    pub(crate) feet: [Vector3<f64>; LEGS],
}

impl Pushed {
    /// Computes the forces of a load; `centre` is the centre of mass of the model from that of the
    /// trunk alone \[m\].
    pub(crate) fn new(load: &ExternalLoad, rotation: &Matrix3<f64>, centre: &Vector3<f64>) -> Self {
        let rows = [0, 1, 2].map(|i| [0, 1, 2].map(|j| rotation[(i, j)]));
        let [x, y, z, roll, pitch, yaw] = load.wrench(&rows, |value| value);
        let force = Vector3::new(x, y, z);
        Self {
            force,
            torque: Vector3::new(roll, pitch, yaw) - centre.cross(&force),
            feet: load.feet.map(|force| rotation.tr_mul(&force.into())),
        }
    }

    /// Returns the power at the velocities of `mean` \[W\].
    pub(crate) fn power(&self, legs: &[LegKinematics], mean: &State) -> f64 {
        let (velocity, rate) = (mean.velocity(), mean.rate());
        let lateral = Vector3::new(velocity.y, rate.x, rate.z);
        let mut power = self.force.dot(&velocity) + self.torque.dot(&rate);
        for (i, (leg, force)) in legs.iter().zip(&self.feet).enumerate() {
            let foot = mean.foot_velocity(i);
            power += force.x * foot.x + force.z * foot.y + force.y * leg.sideways().dot(&lateral);
        }
        power
    }
}
