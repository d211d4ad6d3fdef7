//! Reading `fall`.

use twinrig_document::{Item, Reported};

use crate::expect::{BodyClaim, Claim, Expectation, thresholds};
use crate::scenario::FallSpec;

/// Content of the table `fall`.
#[derive(Clone, Copy, Default)]
pub(super) struct FallTable {
    height: Option<f64>,
    tilt: Option<f64>,
    end: bool,
}

/// Reads `fall`.
pub(super) fn fall(item: &Item<'_>) -> Result<FallTable, Reported> {
    if !item.is_table() {
        let help = "as in { height = 0.3, tilt = \"60 deg\", end = true }; to expect that the robot \
                    does not fall, write [[expect]] body = { fall = false }";
        return Err(item.report("`fall` requires the thresholds of a fall", help));
    }
    let (height, tilt, end) = thresholds(&item.table()?);
    Ok(FallTable {
        height: height?,
        tilt: tilt?,
        end: end?.unwrap_or(false),
    })
}

/// Returns the thresholds of a fall: those of the table, or else the defaults, widened to those of
/// the expectations `fall`.
pub(super) fn spec(table: FallTable, expectations: &[Expectation]) -> FallSpec {
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
        height: table.height.unwrap_or(least),
        tilt: table.tilt.unwrap_or(greatest),
        end: table.end,
    }
}
