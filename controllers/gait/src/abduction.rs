//! Hip abduction: a common constant angle of all legs, or steps to the side.

use std::f64::consts::FRAC_PI_2;

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
///
/// With [`Abduction::Capture`] a foot touches down farther to the left by `capture` · (`v_y` −
/// `sidestep`), where `v_y` is the measured velocity of the trunk to the left; in stance this shift
/// is held. A mass on massless legs of the length h stops above the foot for `capture` = √(h/g),
/// the capture point of the linear inverted pendulum.
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
    /// As [`Abduction::Steer`], and a foot that swings is placed by the motion of the trunk to the
    /// side, too.
    Capture,
}

impl Abduction {
    /// All modes.
    pub const ALL: [Self; 4] = [Self::None, Self::Hold, Self::Steer, Self::Capture];

    /// Name in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Hold => "hold",
            Self::Steer => "steer",
            Self::Capture => "capture",
        }
    }

    /// Whether feet step to the side.
    pub(crate) fn steers(self) -> bool {
        matches!(self, Self::Steer | Self::Capture)
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
        if !self.steers() && value != 0.0 {
            let why = "feet do not step to the side: set `abduction = \"steer\"`";
            return Err(refused(variable, value, why));
        }
        Ok(())
    }

    /// Checks a new value of `capture` \[s\].
    pub(crate) fn check_capture(
        self,
        capture: &ProcessVariable,
        value: f64,
    ) -> Result<(), VariableError> {
        if self != Self::Capture && value != 0.0 {
            let why = "the velocity of the trunk is not measured: set `abduction = \"capture\"`";
            return Err(refused(capture, value, why));
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
