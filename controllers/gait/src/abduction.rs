//! Hip abduction: a common constant angle of all legs, or steps to the side.

use std::f64::consts::{FRAC_PI_2, PI};

use twinrig_kernel::Unit;
use twinrig_runtime::{ProcessVariable, VariableError};

use crate::limb::Limb;

/// Mode of the hips' abduction commands.
///
/// The angle of `leg/X/abduction/command` \[rad\] is about the trunk's x axis, which points
/// forward: positive swings the foot to the left. The process variable `splay` \[rad\] of every
/// controller is the angle outwards: legs on the left are commanded +`splay`, those on the right
/// −`splay`.
///
/// With [`Abduction::Steer`] feet are placed to the side, at the height of the foot locus. The
/// trunk moves over them with the velocity v = L/T of the gait, T the duration of stance,
/// `sidestep` to the left and `turn` about z, so that a foot at (x, y) of the trunk moves at −(v −
/// ω y, s + ω x) in stance: its step is L − ω y T long and (s + ω x) T wide. Of a foot, (x, y) is
/// that at mid-stance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Abduction {
    /// No abduction signals; any `splay` other than 0 is rejected.
    #[default]
    None,
    /// The command of every leg is `splay`, outwards.
    Hold,
    /// Feet step to the side, by `turn`, `sidestep` and `lateral_offset/X`; mid-stance is at
    /// `splay`.
    Steer,
}

impl Abduction {
    /// All modes.
    pub const ALL: [Self; 3] = [Self::None, Self::Hold, Self::Steer];

    /// Name in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Hold => "hold",
            Self::Steer => "steer",
        }
    }

    /// The process variable `splay`.
    pub(crate) fn variable() -> ProcessVariable {
        let upright = -FRAC_PI_2..=FRAC_PI_2;
        ProcessVariable::new("splay", Unit::Radian, upright, 0.0)
    }

    /// Checks a new value of `splay` \[rad\].
    pub(crate) fn check(self, splay: &ProcessVariable, value: f64) -> Result<(), VariableError> {
        if self == Self::None && value != 0.0 {
            return Err(refused(splay, value, "abduction is not commanded"));
        }
        Ok(())
    }

    /// Checks a new value of a variable of steps to the side.
    pub(crate) fn check_steering(
        self,
        variable: &ProcessVariable,
        value: f64,
    ) -> Result<(), VariableError> {
        if self != Self::Steer && value != 0.0 {
            let why = "feet do not step to the side: set `abduction = \"steer\"`";
            return Err(refused(variable, value, why));
        }
        Ok(())
    }

    /// Returns those of `limbs` that abduct: all active ones, or none.
    pub(crate) fn of(self, limbs: &[Limb]) -> impl Iterator<Item = &Limb> {
        let active = limbs.iter().filter(|limb| limb.active);
        active.filter(move |_| self != Self::None)
    }

    /// Writes the abduction commands of `limbs`, `splay` \[rad\] outwards.
    pub(crate) fn command(self, limbs: &[Limb], splay: f64, outputs: &mut [f64]) {
        for (limb, output) in self.of(limbs).zip(outputs) {
            *output = if limb.corner.left { splay } else { -splay };
        }
    }
}

fn refused(variable: &ProcessVariable, value: f64, why: &str) -> VariableError {
    VariableError::Refused {
        name: variable.name().to_owned(),
        value,
        why: why.to_owned(),
    }
}

/// Steps to the side in one instant.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Course {
    /// Angle of abduction outwards at mid-stance \[rad\].
    pub(crate) splay: f64,
    /// Rate of yaw \[rad/s\], and velocity to the left \[m/s\].
    pub(crate) turn: f64,
    pub(crate) sidestep: f64,
}

/// Step of a foot.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Step {
    /// Place at mid-stance, to the left of its place with an upright leg \[m\].
    middle: f64,
    /// Length that turning adds, and width \[m\].
    pub(crate) lengthening: f64,
    width: f64,
}

impl Course {
    /// Returns the step of a foot that is `x` ahead of the trunk's centre of mass and `z` above the
    /// hip at mid-stance, and stands for a time \[s\]; `offset` is its place to the left beside
    /// that of `splay` \[m\].
    pub(crate) fn step(&self, limb: &Limb, [x, z]: [f64; 2], offset: f64, stance_s: f64) -> Step {
        let splay = if limb.corner.left {
            self.splay
        } else {
            -self.splay
        };
        let middle = limb.place_aside(splay, z) + offset;
        let y = limb.hip[1] + middle;
        Step {
            middle,
            lengthening: -(self.turn * y * stance_s),
            width: (self.sidestep + self.turn * (limb.hip[0] + x)) * stance_s,
        }
    }
}

impl Step {
    /// Returns the direction in which the foot moves at phase Θ: 1 to the left, −1 to the right, 0
    /// for a step without width.
    pub(crate) fn direction(&self, phase: f64) -> f64 {
        let in_swing = if phase < PI { 1.0 } else { -1.0 };
        if self.width == 0.0 {
            0.0
        } else {
            in_swing * self.width.signum()
        }
    }

    /// Returns the place of the foot at phase Θ, to the left of its place with an upright leg
    /// \[m\]: in stance it moves at constant speed.
    pub(crate) fn place(&self, phase: f64) -> f64 {
        let half_turns = phase * (1.0 / PI);
        let share = if half_turns < 1.0 {
            half_turns * half_turns * (3.0 - 2.0 * half_turns) - 0.5
        } else {
            1.5 - half_turns
        };
        self.middle + self.width * share
    }
}
