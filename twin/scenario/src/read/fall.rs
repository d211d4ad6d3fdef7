//! Reading `fall`: thresholds of a fall, of the run and of an expectation.

use std::f64::consts::PI;

use twinrig_document::{Item, Range, Reported};
use twinrig_kernel::Unit;

use crate::body::BodyClaim;
use crate::expect::{Claim, Expectation};
use crate::language::{Declared, Key, Shape, TableSpec, Type, quantity, table};
use crate::scenario::FallSpec;

/// The table, or `false` in an expectation.
pub(super) const FALSE_OR_THRESHOLDS: Type<BodyClaim> = Type::new(
    Shape::Either(&[Shape::False, Shape::Table(fall_table::TABLE)]),
    |item, _| upright(item),
);

table! {
    /// Keys of `fall`.
    pub(super) fall_table = TableSpec::new("fall", "thresholds of a fall of the robot");
    HEIGHT: f64 = "height", quantity(Unit::One, Range::between(0.0, 1.0)),
        "least height of the trunk above the ground below it, as a share of its initial height",
        "height = 0.2", otherwise("0.3; 0.5 in an expectation");
    TILT: f64 = "tilt", quantity(Unit::Radian, Range::between(0.0, PI)), "greatest roll or pitch",
        r#"tilt = "80 deg""#, otherwise("60 deg; 45 deg in an expectation");
    END: bool = "end", Type::BOOLEAN, "whether a fall ends the run", "end = true", default("false");
}

/// Content of the table `fall`.
#[derive(Clone, Copy, Default)]
pub(crate) struct FallTable {
    height: Option<f64>,
    tilt: Option<f64>,
    end: bool,
}

impl FallTable {
    fn read(table: Declared<'_, '_>) -> Result<Self, Reported> {
        let (height, tilt) = (table.get(&fall_table::HEIGHT), table.get(&fall_table::TILT));
        let end = table.read(&fall_table::END);
        Ok(FallTable {
            height: height?,
            tilt: tilt?,
            end: end?,
        })
    }
}

/// Reads `fall` of the run.
pub(super) fn fall(item: &Item<'_>) -> Result<FallTable, Reported> {
    if !item.is_table() {
        let help = "as in { height = 0.3, tilt = \"60 deg\", end = true }; to expect that the robot \
                    does not fall, write [[expect]] body = { fall = false }";
        return Err(item.report("`fall` requires the thresholds of a fall", help));
    }
    FallTable::read(fall_table::TABLE.of(&item.table()?))
}

/// Reads `fall` of an expectation.
fn upright(item: &Item<'_>) -> Result<BodyClaim, Reported> {
    const HEIGHT: f64 = 0.5;
    const TILT: f64 = PI / 4.0;
    let mut thresholds = FallTable::default();
    if item.is_table() {
        thresholds = FallTable::read(fall_table::TABLE.of(&item.table()?))?;
    } else if item.boolean()? {
        let message = "a fall cannot be expected";
        return Err(item.report(message, "write `fall = false`: the robot does not fall"));
    }
    let height = thresholds.height.unwrap_or(HEIGHT);
    let tilt = thresholds.tilt.unwrap_or(TILT);
    if height == 0.0 && tilt >= PI {
        let help = "a `height` above 0, or a `tilt` below 180 deg";
        return Err(item.report("no state is a fall by these thresholds", help));
    }
    Ok(BodyClaim::Upright {
        height,
        tilt,
        end: thresholds.end,
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
