//! What a posture that comes from elsewhere has to be, before a plant goes on from it.

use nalgebra::Vector3;

use crate::posture::Posture;
use crate::setup::Base;

/// How far the square of an attitude's length may be from one: what a plant that never normalises it has made of it is far
/// below, and what is no attitude is far above.
const UNIT: f64 = 1e-3;

impl Posture {
    /// Makes the attitude one of unit length.
    ///
    /// # Errors
    /// What of it is not a number, or no attitude.
    pub fn sound(&mut self) -> Result<(), String> {
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        let trunk = [&self.position, &self.velocity, &self.angular_velocity];
        if !trunk.iter().all(|vector| finite(vector.as_slice())) {
            return Err("where the trunk is, or how it moves, is not a number".to_owned());
        }
        let square: f64 = self.attitude.iter().map(|c| c * c).sum();
        if square.is_nan() || (square - 1.0).abs() >= UNIT {
            let length = libm::sqrt(square);
            return Err(format!("a quaternion of length {length} is no attitude"));
        }
        let scale = 1.0 / libm::sqrt(square);
        self.attitude = self.attitude.map(|c| c * scale);
        for (leg, posture) in &self.legs {
            let drive = [posture.pulley, posture.pulley_rate];
            if !(finite(&posture.angles) && finite(&posture.rates) && finite(&drive)) {
                return Err(format!(
                    "where leg {leg} is, or how it moves, is not a number"
                ));
            }
        }
        Ok(())
    }

    /// Takes away what a trunk with this base cannot do: how it moves where it is held. Returns a line on what that was.
    pub fn keep_to(&mut self, base: Base) -> Vec<String> {
        let before = (self.velocity, self.angular_velocity);
        let (v, w) = (&mut self.velocity, &mut self.angular_velocity);
        match base {
            Base::Free => {}
            // In the plane of x the axis of pitch is that of the world.
            Base::Planar => (v.y, w.x, w.z) = (0.0, 0.0, 0.0),
            Base::Fixed => (*v, *w) = (Vector3::zeros(), Vector3::zeros()),
        }
        let lost = [
            ("body/velocity", before.0 - self.velocity, "m/s"),
            (
                "body/angular_velocity",
                before.1 - self.angular_velocity,
                "rad/s",
            ),
        ];
        let lost = lost.iter().filter(|(_, lost, _)| lost.norm() > 0.0);
        lost.map(|(name, lost, unit)| {
            let by = lost.norm();
            format!("{name} had {by:.3e} {unit} in directions in which this trunk is held")
        })
        .collect()
    }
}
