//! Steps that capture a motion of the trunk to the side.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, Unit, signal};

/// Number of components of a velocity and of an attitude.
const VECTOR: usize = 3;
/// Number of values of all inputs.
pub(crate) const INPUTS: usize = 2 * VECTOR;

/// Inputs: velocity and attitude of the trunk.
pub(crate) fn ports() -> [Port; 2] {
    [
        Port::input(signal::BODY_VELOCITY, Unit::MeterPerSecond, VECTOR),
        Port::input(signal::BODY_RPY, Unit::Radian, VECTOR),
    ]
}

/// Returns the horizontal velocity of the trunk to the left of its heading \[m/s\]; zero without
/// finite inputs.
pub(crate) fn velocity_left(inputs: &[f64]) -> f64 {
    let [x, y, _, _, _, yaw] = *inputs else {
        return 0.0;
    };
    let left = libm::cos(yaw) * y - libm::sin(yaw) * x;
    if left.is_finite() { left } else { 0.0 }
}

/// Share of the way of a foot in swing at phase Θ, from rest to rest.
#[inline]
pub(crate) fn swing_share(phase: f64) -> f64 {
    let share = phase * (1.0 / PI);
    share * share * (3.0 - 2.0 * share)
}

/// Shift of a foot to the left: it changes in swing, and is held in stance.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Shift {
    /// Before the present swing \[m\].
    from: f64,
    /// After it \[m\].
    to: f64,
}

impl Shift {
    /// Aims at a shift \[m\] while the foot swings.
    pub(crate) fn aim(&mut self, phase: f64, shift: f64) {
        if phase < PI {
            self.to = shift;
        } else {
            self.from = self.to;
        }
    }

    /// Returns the shift at phase Θ \[m\].
    #[inline]
    pub(crate) fn at(self, phase: f64) -> f64 {
        if phase < PI {
            self.from + self.change() * swing_share(phase)
        } else {
            self.to
        }
    }

    /// Change by the present swing \[m\].
    pub(crate) fn change(self) -> f64 {
        self.to - self.from
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shift_changes_in_swing_alone() {
        let mut shift = Shift::default();
        shift.aim(4.0, 0.03);
        assert_eq!((shift.at(4.0), shift.at(0.5)), (0.0, 0.0));
        shift.aim(1.0, 0.02);
        shift.aim(3.0, 0.03);
        assert_eq!([shift.at(0.0), shift.at(4.0)], [0.0, 0.03]);
        assert!((shift.at(PI / 2.0) - 0.015).abs() < 1e-15);
        // The next swing begins at the place of stance.
        shift.aim(4.0, -0.05);
        shift.aim(0.1, -0.01);
        assert_eq!([shift.at(0.0), shift.at(4.0)], [0.03, -0.01]);
    }

    #[test]
    fn velocity_to_the_left_is_across_the_heading() {
        let heading = [3.0, -1.0, 0.4, 0.1, 0.2, 0.0];
        assert_eq!(velocity_left(&heading), -1.0);
        let [sine, cosine] = [libm::sin(0.7), libm::cos(0.7)];
        // Ahead at 2 m/s and to the left at 0.5 m/s.
        let velocity = [2.0 * cosine - 0.5 * sine, 2.0 * sine + 0.5 * cosine];
        let turned = [velocity[0], velocity[1], 9.0, 0.0, 0.0, 0.7];
        assert!((velocity_left(&turned) - 0.5).abs() < 1e-15);
        let lost = [f64::NAN, 0.0, 0.0, 0.0, 0.0, 0.0];
        assert_eq!([velocity_left(&lost), velocity_left(&[])], [0.0, 0.0]);
    }
}
