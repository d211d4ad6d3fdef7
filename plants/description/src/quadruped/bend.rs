//! Range of a knee.

use core::f64::consts::PI;

use twinrig_document::Problem;

use crate::tree::Joint;

/// Least angle between the first two segments of a stretched leg that a pantograph can have here
/// \[rad\].
const STRETCHED_MIN: f64 = 0.02;

/// Value in place of a smaller angle: 10° \[rad\].
const STRETCHED: f64 = PI / 18.0;

/// Greatest angle of a knee, 170°: beyond it the leg is folded flat \[rad\].
const FOLDED_MAX: f64 = PI / 18.0 * 17.0;

/// Range of a knee without limits, that of Cheetah-cub: 35° to 130° \[rad\].
const USUAL: [f64; 2] = [PI / 36.0 * 7.0, PI / 18.0 * 13.0];

/// Least difference of both angles \[rad\].
const TRAVEL_MIN: f64 = 0.05;

/// Angles between the first two segments.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bend {
    /// Of the stretched leg, positive \[rad\].
    pub(crate) stretched: f64,
    /// Of the bottomed-out leg, greater \[rad\].
    pub(crate) bottomed: f64,
    /// Whether they are not those of the description.
    pub(crate) is_stretched_assumed: bool,
    pub(crate) is_bottomed_assumed: bool,
    /// Whether the knee points backward.
    pub(crate) is_backward: bool,
}

impl Bend {
    /// Returns the range of a knee whose segments are at `angle` where it is zero \[rad\]; positive
    /// angles of the joint turn the second segment forward if `direction` is 1, else −1.
    pub(crate) fn of(knee: &Joint, angle: f64, direction: f64) -> Result<Self, Problem> {
        let Some(range) = knee.range else {
            let stretched = if angle.abs() < STRETCHED_MIN {
                USUAL[0]
            } else {
                angle.abs().min(USUAL[0])
            };
            return Ok(Self {
                stretched,
                bottomed: USUAL[1],
                is_stretched_assumed: true,
                is_bottomed_assumed: true,
                is_backward: angle > STRETCHED_MIN,
            });
        };
        let [a, b] = range.map(|limit| angle + direction * limit);
        let (low, high) = (a.min(b), a.max(b));
        let is_backward = high > -low;
        let (near, far) = if is_backward {
            (low, high)
        } else {
            (-high, -low)
        };
        let is_stretched_assumed = near < STRETCHED_MIN;
        let stretched = if is_stretched_assumed {
            STRETCHED
        } else {
            near
        };
        let is_bottomed_assumed = far > FOLDED_MAX;
        let bottomed = far.min(FOLDED_MAX);
        // Also false for NaN.
        if bottomed - stretched >= TRAVEL_MIN {
            return Ok(Self {
                stretched,
                bottomed,
                is_stretched_assumed,
                is_bottomed_assumed,
                is_backward,
            });
        }
        let message = format!(
            "the knee `{}` bends the leg from {stretched:.3} rad to {bottomed:.3} rad only",
            knee.name
        );
        let help = "check its limits; a leg needs a travel of 0.05 rad below 170°";
        Err(Problem::at(&knee.place, message, help))
    }
}
