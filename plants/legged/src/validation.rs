//! Validation of external postures before a plant resumes from them.

use nalgebra::Vector3;

use crate::posture::Posture;
use crate::setup::Base;
use twinrig_kernel::signal;

/// Tolerance of the squared length of an attitude quaternion: far above the drift of a plant that
/// never normalises it, far below the deviation of invalid data.
const UNIT: f64 = 1e-3;

impl Posture {
    /// Validates the posture and normalises its attitude.
    ///
    /// # Errors
    /// Message about a component that is not finite, or an invalid attitude.
    pub fn validate(&mut self) -> Result<(), String> {
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        let trunk = [&self.position, &self.velocity, &self.angular_velocity];
        if !trunk.iter().all(|vector| finite(vector.as_slice())) {
            return Err("position or velocity of the trunk is not finite".to_owned());
        }
        let square: f64 = self.attitude.iter().map(|c| c * c).sum();
        if square.is_nan() || (square - 1.0).abs() >= UNIT {
            let length = libm::sqrt(square);
            return Err(format!(
                "a quaternion of length {length} is not an attitude"
            ));
        }
        let scale = 1.0 / libm::sqrt(square);
        self.attitude = self.attitude.map(|c| c * scale);
        for (leg, posture) in &self.legs {
            let drive = [posture.pulley, posture.pulley_rate];
            if !(finite(&posture.angles) && finite(&posture.rates) && finite(&drive)) {
                return Err(format!("position or velocity of leg {leg} is not finite"));
            }
        }
        Ok(())
    }

    /// Projects the velocity onto the degrees of freedom of the base. Returns a message for each
    /// velocity that had a removed component.
    pub fn project_onto(&mut self, base: Base) -> Vec<String> {
        let before = (self.velocity, self.angular_velocity);
        let (v, w) = (&mut self.velocity, &mut self.angular_velocity);
        match base {
            Base::Free => {}
            // In the plane of x the pitch axis is fixed in the world.
            Base::Planar => (v.y, w.x, w.z) = (0.0, 0.0, 0.0),
            Base::Fixed => (*v, *w) = (Vector3::zeros(), Vector3::zeros()),
        }
        let removed = [
            (signal::BODY_VELOCITY, before.0 - self.velocity, "m/s"),
            (
                signal::BODY_ANGULAR_VELOCITY,
                before.1 - self.angular_velocity,
                "rad/s",
            ),
        ];
        let removed = removed
            .iter()
            .filter(|(_, removed, _)| removed.norm() > 0.0);
        removed
            .map(|(name, removed, unit)| {
                let by = removed.norm();
                format!("{name}: removed {by:.3e} {unit} along constrained directions of the trunk")
            })
            .collect()
    }
}
