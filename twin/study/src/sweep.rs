//! What is varied to see what limits a step.

use crate::factory::{Scales, Scene};

/// A property of robot or scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Factor {
    /// Of all springs, a factor.
    Stiffness,
    /// Of the segments, a factor.
    Mass,
    /// Of the joints, a factor.
    Damping,
    /// Of the servos' position loop, a factor.
    Gain,
    /// Of the ground.
    Friction,
    /// Of the ground.
    Restitution,
}

impl Factor {
    /// All, in the order in which they are studied.
    pub const ALL: [Self; 6] = [
        Self::Stiffness,
        Self::Mass,
        Self::Damping,
        Self::Gain,
        Self::Friction,
        Self::Restitution,
    ];

    /// Its name.
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

    /// Whether it is a multiple of what the robot has, and not a value.
    pub fn is_multiple(self) -> bool {
        !matches!(self, Self::Friction | Self::Restitution)
    }

    /// The values it takes: those of the thesis first.
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

    /// The scene with this factor at `value`.
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

    /// What it is in `scales`, if those differ from the scene in nothing else.
    pub(crate) fn of(self, scales: &Scales) -> Option<f64> {
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

    /// Why it says nothing about `scene`.
    pub(crate) fn idle_in(self, scene: &Scene) -> Option<&'static str> {
        match self {
            Self::Gain if !scene.servos => Some("nothing drives the legs"),
            Self::Friction | Self::Restitution if !scene.ground => Some("there is no ground"),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_is_found_again_in_the_scene_that_it_made() {
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
        // The scene as it is belongs to every sweep of multiples.
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
