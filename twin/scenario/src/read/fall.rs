//! Reading `fall`.

use twinrig_document::{Item, Reported};

use crate::expect::{BodyClaim, Claim, Expectation, thresholds};
use crate::scenario::FallSpec;

/// What the top table says of it.
#[derive(Clone, Copy, Default)]
pub(super) struct Given {
    height: Option<f64>,
    tilt: Option<f64>,
    end: bool,
}

/// `fall`
pub(super) fn fall(item: &Item<'_>) -> Result<Given, Reported> {
    if !item.is_table() {
        let help = "as in { height = 0.3, tilt = \"60 deg\", end = true }; that the robot does not \
                    fall is expected by [[expect]] body = { fall = false }";
        return Err(item.report("`fall` says when the robot has fallen", help));
    }
    let (height, tilt, end) = thresholds(&item.table()?);
    Ok(Given {
        height: height?,
        tilt: tilt?,
        end: end?.unwrap_or(false),
    })
}

/// The thresholds of a fall: those given, or else the defaults, widened to those of the
/// expectations `fall`.
pub(super) fn spec(given: Given, expectations: &[Expectation]) -> FallSpec {
    const HEIGHT: f64 = 0.3;
    const TILT: f64 = std::f64::consts::FRAC_PI_3;
    let (mut least, mut greatest) = (HEIGHT, TILT);
    for expectation in expectations {
        if let Claim::Body(BodyClaim::Upright { height, tilt, .. }) = expectation.claim {
            least = least.min(height);
            greatest = greatest.max(tilt);
        }
    }
    FallSpec {
        height: given.height.unwrap_or(least),
        tilt: given.tilt.unwrap_or(greatest),
        end: given.end,
    }
}
