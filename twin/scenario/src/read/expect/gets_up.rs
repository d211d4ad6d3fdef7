//! Reading the rising of a trunk that lies.

use std::f64::consts::PI;

use twinrig_document::{Item, Range, Reported};
use twinrig_kernel::{SimDuration, Unit};

use crate::body::{BodyClaim, GetsUp};
use crate::language::{Key, TableSpec, Type, quantity, table};

table! {
    /// Keys of `gets_up`.
    pub(super) gets_up_table =
        TableSpec::new("gets_up", "rising of the trunk from lying to standing");
    WITHIN: SimDuration = "within", Type::POSITIVE_DURATION,
        "greatest time from the instant at which it lies", r#"within = "5 s""#, required();
    LYING: f64 = "lying", quantity(Unit::Radian, Range::between(0.0, PI)),
        "roll or pitch from which on it lies", r#"within = "5 s", lying = "80 deg""#,
        default("'60 deg'");
    TILT: f64 = "tilt", quantity(Unit::Radian, Range::between(0.0, PI)),
        "greatest roll and pitch at which it stands", r#"within = "5 s", tilt = "10 deg""#,
        default("'20 deg'");
    HEIGHT: f64 = "height", quantity(Unit::One, Range::between(0.0, 1.0)),
        "least height at which it stands, as a share of its initial height",
        r#"within = "5 s", height = 0.9"#, default("0.7");
    HOLD: SimDuration = "hold", Type::DURATION, "time for which it stands",
        r#"within = "5 s", hold = "1 s""#, default("'0.5 s'");
}

/// Reads `gets_up = { … }`.
pub(super) fn gets_up(item: &Item<'_>) -> Result<BodyClaim, Reported> {
    use gets_up_table::{HEIGHT, HOLD, LYING, TABLE, TILT, WITHIN};
    let table = &item.table()?;
    let table = TABLE.of(table);
    let (within, hold) = (table.read(&WITHIN), table.read(&HOLD));
    let (lying, tilt, height) = (table.read(&LYING), table.read(&TILT), table.read(&HEIGHT));
    let claim = GetsUp {
        within: within?,
        lying: lying?,
        tilt: tilt?,
        height: height?,
        hold: hold?,
    };
    if claim.tilt >= claim.lying {
        let help = "a trunk that stands does not lie: give a `tilt` below `lying`";
        return Err(item.report("`tilt` is not below `lying`", help));
    }
    Ok(BodyClaim::GetsUp(claim))
}
