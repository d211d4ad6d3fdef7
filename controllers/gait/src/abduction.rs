//! Hip abduction: held at one angle for all legs.

use std::f64::consts::FRAC_PI_2;

use twinrig_kernel::Unit;
use twinrig_runtime::{ProcessVariable, VariableError};

use crate::limb::Limb;

/// Whether a controller commands the abduction of the hips, and how.
///
/// The angle of `leg/X/abduction/command` \[rad\] turns about the trunk's x axis, which points forward: positive swings
/// the foot to the left. The process variable `splay` \[rad\], in which every controller has it, is the angle outwards:
/// legs on the left are commanded +`splay`, those on the right −`splay`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Abduction {
    /// There is no such signal, and any `splay` but 0 is refused.
    #[default]
    None,
    /// Every leg is commanded `splay`, outwards.
    Hold,
}

impl Abduction {
    /// Every way of commanding it.
    pub const ALL: [Self; 2] = [Self::None, Self::Hold];

    /// The name a scenario uses.
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

    /// Whether `splay` may become `value` \[rad\].
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

    /// Those of `limbs` that abduct: all that are active, or none.
    pub(crate) fn of(self, limbs: &[Limb]) -> impl Iterator<Item = &Limb> {
        let active = limbs.iter().filter(|limb| limb.active);
        active.filter(move |_| self == Self::Hold)
    }

    /// Writes the commands of `limbs` that abduct, `splay` \[rad\] outwards.
    pub(crate) fn command(self, limbs: &[Limb], splay: f64, outputs: &mut [f64]) {
        for (limb, output) in self.of(limbs).zip(outputs) {
            *output = if limb.corner.left { splay } else { -splay };
        }
    }
}
