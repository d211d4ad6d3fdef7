//! Assembly mode of the legs: the side to which the knee bends, and the side of the line from the
//! diagonal's end to the ankle on which the rod holds the third segment.
//!
//! Lengths of rods and springs are the same in all modes, and a leg that has left its own is
//! another mechanism: every plant fails there.

use libm::sin;
use twinrig_robot::LegMount;

use crate::dynamics::PartFault;

/// Angles between second and third segment, and between first and third, within which the rod is on
/// its side for every lΔ < l₂: sin 0.4 < sin 0.5 \[rad\].
const ANKLE: std::ops::RangeInclusive<f64> = 0.5..=2.6;
const OPENING: f64 = 0.4;

/// Sine by which knee or rod may be on the other side. A rigid stop of the diagonal l, violated by
/// δ, lets a leg whose stop is at the straight leg turn by √(2 δ l/(lΔ l₂)): 1.1° for 2.5 µm.
/// Compliant stops hold before the straight leg.
const BESIDE: f64 = 0.02;

const REMEDY: &str = "soften what drives it there, or shorten the steps if they are unstable";

/// Watch on one leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AssemblyWatch {
    /// lΔ/l₂.
    ratio: f64,
}

impl AssemblyWatch {
    /// Creates the watch on a leg.
    pub(crate) fn new(mount: &LegMount) -> Self {
        let ratio = mount.leg.l_delta / mount.leg.l2;
        Self { ratio }
    }

    /// Checks the absolute angles of the segments \[rad\], by their differences alone where these
    /// are far from any other mode. Angles that are not finite are left to other checks.
    ///
    /// # Errors
    /// [`PartFault`] of `leg` if knee or rod have changed their side.
    pub(crate) fn check(self, leg: &str, angles: [f64; 3]) -> Result<(), PartFault> {
        let [first, second, third] = angles;
        let (bend, ankle, opening) = (first - second, third - second, third - first);
        if (0.05..3.0).contains(&bend) && ANKLE.contains(&ankle) && opening.abs() < OPENING {
            return Ok(());
        }
        let knee = sin(bend);
        let rod = sin(ankle) + self.ratio * sin(opening);
        let why = if knee < -BESIDE {
            let degrees = -libm::asin(knee).to_degrees();
            format!(
                "the knee has passed the straight or the folded leg ({degrees:.1}° beyond): it bends \
                 the other way, and the leg is another mechanism; {REMEDY}"
            )
        } else if rod < -BESIDE {
            format!(
                "the rod of the pantograph has passed the line from diagonal to ankle: the leg is \
                 another mechanism; {REMEDY}"
            )
        } else {
            return Ok(());
        };
        Err(PartFault::new(twinrig_kernel::signal::leg_path(leg), why))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WATCH: AssemblyWatch = AssemblyWatch { ratio: 0.21 };

    fn check(bend: f64, opening: f64) -> Result<(), PartFault> {
        let first = 0.4;
        WATCH.check("LF", [first, first - bend, first + opening])
    }

    #[test]
    fn other_modes_are_told_apart_and_turns_are_none() {
        for bend in [0.01, 0.6, 1.5, 2.9, 3.1] {
            for opening in [-0.005, 0.0, 0.2] {
                let is_near = bend + opening > 3.1;
                assert!(is_near || check(bend, opening).is_ok(), "{bend} {opening}");
            }
            let whole = 2.0 * std::f64::consts::PI;
            assert!(
                WATCH.check("LF", [whole, -bend, 0.0]).is_ok(),
                "whole turns"
            );
        }
        assert!(
            check(-0.019, 0.0).is_ok(),
            "straight, but for a violated stop"
        );
        for bend in [-0.021, -0.6, 3.2] {
            let fault = check(bend, 0.0).unwrap_err();
            assert_eq!(fault.part, "leg/LF");
            assert!(fault.why.contains("knee"), "{fault:?}");
        }
        // In line with the rod: sin(β + o) = −ratio · sin o.
        for (bend, opening) in [(0.6, -0.9), (2.5, 1.2)] {
            let fault = check(bend, opening).unwrap_err();
            assert!(fault.why.contains("rod"), "{fault:?}");
        }
    }

    #[test]
    fn quick_acceptance_agrees_with_the_sines() {
        for i in 0..200 {
            for j in 0..200 {
                let (bend, opening) = (0.01 + 0.015 * f64::from(i), -0.5 + 0.005 * f64::from(j));
                let rod = sin(bend + opening) + WATCH.ratio * sin(opening);
                assert_eq!(
                    check(bend, opening).is_ok(),
                    rod >= -BESIDE,
                    "{bend} {opening}"
                );
            }
        }
    }
}
