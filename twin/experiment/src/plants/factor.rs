//! Factors varied to find the limit of the step size.

use twinrig_report::number::plain;
use twinrig_rig::Scales;

use crate::plants::factory::StudyInput;

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
    /// Stiffness of compliant stops, cables and soles, a multiple.
    Compliance,
    /// Their damping, a multiple.
    ComplianceDamping,
    /// Longest step of a method with error control \[s\].
    LongestStep,
    /// Speed of the commands, a multiple.
    Speed,
    /// Cells along each axis of a table of forces.
    Cells,
}

impl Factor {
    /// All factors, in the order of the study.
    pub const ALL: [Self; 11] = [
        Self::Stiffness,
        Self::Mass,
        Self::Damping,
        Self::Gain,
        Self::Friction,
        Self::Restitution,
        Self::Compliance,
        Self::ComplianceDamping,
        Self::LongestStep,
        Self::Speed,
        Self::Cells,
    ];

    /// Returns the word for the command line.
    pub fn word(self) -> &'static str {
        match self {
            Self::Stiffness => "stiffness",
            Self::Mass => "mass",
            Self::Damping => "damping",
            Self::Gain => "gain",
            Self::Friction => "friction",
            Self::Restitution => "restitution",
            Self::Compliance => "compliance",
            Self::ComplianceDamping => "compliance-damping",
            Self::LongestStep => "longest-step",
            Self::Speed => "speed",
            Self::Cells => "cells",
        }
    }

    /// Returns the name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stiffness => "stiffness",
            Self::Mass => "mass of the segments",
            Self::Damping => "damping of the joints",
            Self::Gain => "gain of the position loop",
            Self::Friction => "friction of the ground",
            Self::Restitution => "restitution of the ground",
            Self::Compliance => "stiffness of the compliance",
            Self::ComplianceDamping => "damping of the compliance",
            Self::LongestStep => "longest step in seconds",
            Self::Speed => "speed of the commands",
            Self::Cells => "cells of the table of forces",
        }
    }

    /// Returns whether the value is a multiple of the robot's, not an absolute value.
    pub fn is_multiple(self) -> bool {
        !matches!(
            self,
            Self::Friction | Self::Restitution | Self::LongestStep | Self::Cells
        )
    }

    /// Returns whether only plants with compliant constraints are run with changes of this factor.
    pub(crate) fn is_of_compliance(self) -> bool {
        matches!(
            self,
            Self::Compliance | Self::ComplianceDamping | Self::LongestStep | Self::Speed
        )
    }

    /// Formats a value of this factor: `stiffness × 0.1`, `friction of the ground 0.3`.
    pub fn label(self, value: f64) -> String {
        let times = if self.is_multiple() { "× " } else { "" };
        format!("{} {times}{}", self.name(), plain(value))
    }

    /// Returns whether the factor can have a value.
    pub fn accepts(self, value: f64) -> bool {
        match self {
            // Those of the plant option `cells`.
            Self::Cells => value.fract() == 0.0 && (16.0..=512.0).contains(&value),
            Self::LongestStep | Self::Speed | Self::Gain => value > 0.0 && value < 1e6,
            _ => (0.0..1e6).contains(&value),
        }
    }

    /// Returns the values of the sweep, those of the thesis first.
    pub(crate) fn values(self) -> &'static [f64] {
        match self {
            Self::Stiffness => &[1.0, 0.75, 0.5, 0.25, 0.1, 0.01, 10.0, 100.0, 1e3, 1e4],
            Self::Mass => &[0.1, 1e-2, 1e-3, 1e-4, 1e-6],
            Self::Damping => &[0.0, 0.1, 10.0, 100.0],
            Self::Gain => &[0.1, 10.0, 100.0],
            Self::Friction => &[0.0, 0.3, 1.0, 2.0, 10.0],
            Self::Restitution => &[0.0, 0.5, 1.0],
            Self::Compliance => &[1e-2, 0.1, 10.0, 100.0, 1e3, 1e4],
            Self::ComplianceDamping => &[0.0, 0.1, 10.0, 100.0, 1e3, 1e4],
            Self::LongestStep => &[1e-3, 2e-4, 2e-5],
            Self::Speed => &[0.5, 2.0, 4.0],
            Self::Cells => &[16.0, 32.0, 64.0, 128.0],
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
            Self::Compliance => scales.compliance = value,
            Self::ComplianceDamping => scales.compliance_damping = value,
            Self::LongestStep => scales.longest_step_s = Some(value),
            Self::Speed => scales.speed = value,
            Self::Cells => scales.cells = Some(value),
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
            Self::Compliance => Some(scales.compliance),
            Self::ComplianceDamping => Some(scales.compliance_damping),
            Self::LongestStep => scales.longest_step_s,
            Self::Speed => Some(scales.speed),
            Self::Cells => scales.cells,
        }?;
        (self.scales(value) == *scales).then_some(value)
    }

    /// Returns the reason why this factor has no effect in the scenario, if so.
    pub(crate) fn ineffective_in(self, input: &StudyInput) -> Option<&'static str> {
        match self {
            Self::Speed if !input.servos || !input.commands.change() => {
                Some("no servo is commanded")
            }
            Self::Gain if !input.servos => Some("the legs have no position servos"),
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
