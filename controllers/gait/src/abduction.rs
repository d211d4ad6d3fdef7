//! Hip abduction: a common constant angle of all legs.

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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Abduction {
    /// No abduction signals; any `splay` other than 0 is rejected.
    #[default]
    None,
    /// The command of every leg is `splay`, outwards.
    Hold,
}

impl Abduction {
    /// All modes.
    pub const ALL: [Self; 2] = [Self::None, Self::Hold];

    /// Name in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Hold => "hold",
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
            return Err(VariableError::Refused {
                name: splay.name().to_owned(),
                value,
                why: "abduction is not commanded".to_owned(),
            });
        }
        Ok(())
    }

    /// Returns those of `limbs` that abduct: all active ones, or none.
    pub(crate) fn of(self, limbs: &[Limb]) -> impl Iterator<Item = &Limb> {
        let active = limbs.iter().filter(|limb| limb.active);
        active.filter(move |_| self == Self::Hold)
    }

    /// Writes the abduction commands of `limbs`, `splay` \[rad\] outwards.
    pub(crate) fn command(self, limbs: &[Limb], splay: f64, outputs: &mut [f64]) {
        for (limb, output) in self.of(limbs).zip(outputs) {
            *output = if limb.corner.left { splay } else { -splay };
        }
    }
}
