//! Factors varied to find the limit of the step size.

use crate::factory::{Scales, StudyInput};
use crate::number::plain;

/// Property of robot or ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Factor {
    /// Stiffness of all springs, a multiple.
    Stiffness,
    /// Mass of the leg segments, a multiple.
    Mass,
    /// Viscous damping of the joints, a multiple.
    Damping,
    /// Gain of the servos' position loop, a multiple.
    Gain,
    /// Coefficient of the ground.
    Friction,
    /// Coefficient of the ground.
    Restitution,
}

impl Factor {
    /// All factors, in the order of the study.
    pub const ALL: [Self; 6] = [
        Self::Stiffness,
        Self::Mass,
        Self::Damping,
        Self::Gain,
        Self::Friction,
        Self::Restitution,
    ];

    /// Returns the name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stiffness => "stiffness",
            Self::Mass => "mass of the segments",
            Self::Damping => "damping of the joints",
            Self::Gain => "gain of the position loop",
            Self::Friction => "friction of the ground",
            Self::Restitution => "restitution of the ground",
        }
    }

    /// Returns whether the value is a multiple of the robot's, not an absolute value.
    pub fn is_multiple(self) -> bool {
        !matches!(self, Self::Friction | Self::Restitution)
    }

    /// Formats a value of this factor: `stiffness × 0.1`, `friction of the ground 0.3`.
    pub fn label(self, value: f64) -> String {
        let times = if self.is_multiple() { "× " } else { "" };
        format!("{} {times}{}", self.name(), plain(value))
    }

    /// Returns the values of the sweep, those of the thesis first.
    pub(crate) fn values(self) -> &'static [f64] {
        match self {
            Self::Stiffness => &[1.0, 0.75, 0.5, 0.25, 0.1, 0.01, 10.0, 100.0, 1e3, 1e4],
            Self::Mass => &[0.1, 1e-2, 1e-3, 1e-4, 1e-6],
            Self::Damping => &[0.0, 0.1, 10.0, 100.0],
            Self::Gain => &[0.1, 10.0, 100.0],
            Self::Friction => &[0.0, 0.3, 1.0, 10.0],
            Self::Restitution => &[0.0, 0.5, 1.0],
        }
    }

    /// Returns the scales with this factor at `value` and all others unchanged.
    pub(crate) fn scales(self, value: f64) -> Scales {
        let mut scales = Scales::AS_IS;
        match self {
            Self::Stiffness => scales.stiffness = value,
            Self::Mass => scales.mass = value,
            Self::Damping => scales.damping = value,
            Self::Gain => scales.gain = value,
            Self::Friction => scales.friction = Some(value),
            Self::Restitution => scales.restitution = Some(value),
        }
        scales
    }

    /// Returns the value of this factor in `scales` if no other factor is changed.
    pub fn of(self, scales: &Scales) -> Option<f64> {
        let value = match self {
            Self::Stiffness => Some(scales.stiffness),
            Self::Mass => Some(scales.mass),
            Self::Damping => Some(scales.damping),
            Self::Gain => Some(scales.gain),
            Self::Friction => scales.friction,
            Self::Restitution => scales.restitution,
        }?;
        (self.scales(value) == *scales).then_some(value)
    }

    /// Returns the reason why this factor has no effect in the scenario, if so.
    pub(crate) fn ineffective_in(self, input: &StudyInput) -> Option<&'static str> {
        match self {
            Self::Gain if !input.servos => Some("nothing drives the legs"),
            Self::Friction | Self::Restitution if !input.ground => Some("there is no ground"),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factor_value_is_recovered_from_its_scales() {
        for factor in Factor::ALL {
            for &value in factor.values() {
                assert_eq!(factor.of(&factor.scales(value)), Some(value));
            }
            assert_eq!(
                factor.of(&Scales {
                    stiffness: 2.0,
                    mass: 2.0,
                    ..Scales::AS_IS
                }),
                None
            );
        }
        // The unchanged scenario is part of every sweep of multiples.
        let multiples = Factor::ALL
            .into_iter()
            .filter(|factor| factor.is_multiple());
        assert!(
            multiples
                .into_iter()
                .all(|factor| factor.of(&Scales::AS_IS) == Some(1.0))
        );
    }
}
