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

/// Greatest velocity that counts \[m/s\]: beyond any robot, and its square does not overflow.
const VELOCITY_MAX: f64 = 1e3;

/// Returns the horizontal velocity of the trunk to the left of its heading \[m/s\]; none without
/// finite inputs.
pub(crate) fn velocity_left(inputs: &[f64]) -> Option<f64> {
    let [x, y, _, _, _, yaw] = *inputs else {
        return None;
    };
    let left = libm::cos(yaw) * y - libm::sin(yaw) * x;
    let left = left.is_finite().then_some(left)?;
    Some(left.clamp(-VELOCITY_MAX, VELOCITY_MAX))
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
    /// Share of the present swing that is done.
    done: f64,
    /// Whether phases decrease.
    is_backward: bool,
}

impl Shift {
    /// Aims at a shift \[m\] while the foot swings, at phase Θ of a gait of this frequency.
    pub(crate) fn aim(&mut self, phase: f64, frequency: f64, shift: f64) {
        self.is_backward = frequency < 0.0;
        if phase < PI {
            self.to = shift;
            self.done = self.share(phase);
        } else {
            // Noise may take a phase back into the stance before: the foot has not moved then.
            let held = if self.done > 0.5 { self.to } else { self.from };
            (self.from, self.to) = (held, held);
        }
    }

    /// Returns the shift at phase Θ \[m\].
    #[inline]
    pub(crate) fn at(self, phase: f64) -> f64 {
        if phase < PI {
            self.from + (self.to - self.from) * self.share(phase)
        } else {
            self.to
        }
    }

    /// Share of the swing that is done at phase Θ.
    #[inline]
    fn share(self, phase: f64) -> f64 {
        let share = swing_share(phase);
        if self.is_backward { 1.0 - share } else { share }
    }

    /// Change by the present swing, with the sign that it has where phases increase \[m\].
    pub(crate) fn change(self) -> f64 {
        let change = self.to - self.from;
        if self.is_backward { -change } else { change }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shift_changes_in_swing_alone() {
        for (frequency, [first, middle, last]) in [(2.0, [0.1, 1.0, 3.1]), (-2.0, [3.1, 2.0, 0.1])]
        {
            let mut shift = Shift::default();
            shift.aim(4.0, frequency, 0.03);
            assert_eq!((shift.at(4.0), shift.at(1.0)), (0.0, 0.0));
            shift.aim(middle, frequency, 0.02);
            shift.aim(last, frequency, 0.03);
            assert!((shift.at(PI / 2.0) - 0.015).abs() < 1e-15);
            assert!(shift.at(first).abs() < 2e-4 && shift.at(last) > 0.0298);
            // Stance keeps it, and the next swing begins at it.
            shift.aim(4.0, frequency, -0.05);
            shift.aim(first, frequency, -0.01);
            assert_eq!(shift.at(4.0), -0.01);
            assert!((shift.at(first) - 0.03).abs() < 2e-4);
        }
    }

    #[test]
    fn a_foot_that_noise_takes_back_into_stance_stays() {
        let mut shift = Shift::default();
        shift.aim(3.0, 2.0, 0.03);
        shift.aim(4.0, 2.0, 0.03);
        shift.aim(0.01, 2.0, -0.05);
        shift.aim(6.2, 2.0, -0.05);
        assert_eq!(shift.at(6.2), 0.03);
    }

    #[test]
    fn velocity_to_the_left_is_across_the_heading() {
        let heading = [3.0, -1.0, 0.4, 0.1, 0.2, 0.0];
        assert_eq!(velocity_left(&heading), Some(-1.0));
        let [sine, cosine] = [libm::sin(0.7), libm::cos(0.7)];
        // Ahead at 2 m/s and to the left at 0.5 m/s.
        let velocity = [2.0 * cosine - 0.5 * sine, 2.0 * sine + 0.5 * cosine];
        let turned = [velocity[0], velocity[1], 9.0, 0.0, 0.0, 0.7];
        assert!((velocity_left(&turned).unwrap() - 0.5).abs() < 1e-15);
        let lost = [f64::NAN, 0.0, 0.0, 0.0, 0.0, 0.0];
        assert_eq!([velocity_left(&lost), velocity_left(&[])], [None, None]);
        let fast = [0.0, 1e300, 0.0, 0.0, 0.0, 0.0];
        assert_eq!(velocity_left(&fast), Some(VELOCITY_MAX));
    }
}
