//! Reading expectations of the trunk.

use twinrig_document::{Item, Reported};
use twinrig_kernel::Unit;

use super::context::Context;
use super::gets_up::{gets_up, gets_up_table};
use super::one_of::one_of;
use super::recovery::{self, body_recovers_table};
use super::settles::{settles, settles_table};
use crate::body::{Along, BodyClaim, BodyMeasure};
use crate::domain::Domain;
use crate::language::{Key, Shape, Special, TableSpec, Type, choice, contextual, table};
use crate::read::fall::FALSE_OR_THRESHOLDS;
use crate::read::limits::{limits_of, read};

/// Returns limits of a measure.
macro_rules! body {
    ($measure:ident, $domain:ident) => {
        limits_of!(BodyMeasure::$measure.unit(), Domain::$domain, |limits| {
            BodyClaim::Limited(BodyMeasure::$measure, limits)
        })
    };
}

table! {
    /// Keys of `body`.
    pub(super) body_table = TableSpec::new("body", "claim about the trunk");
    SPEED: () = "speed", contextual(Shape::Other(Special::Limits(Unit::MeterPerSecond, Domain::ANY))), "mean speed",
        r#"speed = { min = "30 cm/s" }"#, one_of();
    ALONG: Along = "along", choice(), "direction of the speed",
        r#"speed = { min = "30 cm/s" }, along = "path""#, default("'heading'"), needs("speed"),
        qualifier();
    HEIGHT: BodyClaim = "height", body!(Height, ANY), "height of the trunk",
        r#"height = { min = "9 cm" }"#, one_of();
    ROLL: BodyClaim = "roll", body!(Roll, HALF_TURN), "greatest roll, either way", r#"roll = { max = "10 deg" }"#, one_of();
    PITCH: BodyClaim = "pitch", body!(Pitch, QUARTER_TURN), "greatest pitch, either way", r#"pitch = { max = "10 deg" }"#, one_of();
    ROLL_RANGE: BodyClaim = "roll_range", body!(RollRange, TURN), "greatest less least roll",
        r#"roll_range = { max = "5 deg" }"#, one_of();
    PITCH_RANGE: BodyClaim = "pitch_range", body!(PitchRange, HALF_TURN),
        "greatest less least pitch", r#"pitch_range = { max = "5 deg" }"#, one_of();
    HEIGHT_RANGE: BodyClaim = "height_range", body!(HeightRange, NOT_NEGATIVE),
        "greatest less least height", r#"height_range = { max = "20 mm" }"#, one_of();
    YAW_DRIFT: BodyClaim = "yaw_drift", body!(YawDrift, NOT_NEGATIVE),
        "greatest turn from the start of the window", r#"yaw_drift = { max = "20 deg" }"#, one_of();
    TURN_RATE: BodyClaim = "turn_rate", body!(TurnRate, ANY),
        "mean rate of the heading, positive to the left",
        r#"turn_rate = { near = "20 deg/s", within = "10 %" }"#, one_of();
    FALL: BodyClaim = "fall", FALSE_OR_THRESHOLDS, "no fall, by these thresholds",
        r#"fall = { height = 0.5, tilt = "45 deg" }"#, one_of();
    SETTLES: BodyClaim = "settles",
        Type::new(Shape::TableIn(Some(Unit::Meter), settles_table::TABLE), |item, _| {
            let (within, by) = settles(item, Unit::Meter)?;
            Ok(BodyClaim::Settles { within, by })
        }),
        "settling to the final position", r#"settles = { within = "2 mm", by = "4 s" }"#, one_of();
    RECOVERS: () = "recovers", contextual(Shape::Table(body_recovers_table::TABLE)),
        "recovery from a disturbance",
        r#"recovers = { after = "3 s", within = "2 s", roll = "2 deg", height = "5 mm" }"#,
        one_of();
    GETS_UP: BodyClaim = "gets_up",
        Type::new(Shape::Table(gets_up_table::TABLE), |item, _| gets_up(item)),
        "rising from lying to standing", r#"gets_up = { within = "5 s" }"#, one_of();
}

/// Reads `body = { … }`.
pub(super) fn claim(item: &Item<'_>, context: &Context<'_>) -> Result<BodyClaim, Reported> {
    use body_table::{ALONG, RECOVERS, SPEED};
    let table = &item.table()?;
    let table = body_table::TABLE.of(table);
    let measure = one_of(table, item, "no measure of the body is given")?;
    if measure == RECOVERS.name {
        return table.read_with(&RECOVERS, |item| recovery::of_body(item, context));
    }
    if measure != SPEED.name {
        return table.read_named(measure);
    }
    let along = table.read(&ALONG);
    let domain = match along {
        Ok(Along::Path) => Domain::NOT_NEGATIVE,
        _ => Domain::ANY,
    };
    let limits = table.read_with(&SPEED, |item| read(item, Unit::MeterPerSecond, &domain))?;
    Ok(BodyClaim::Limited(BodyMeasure::Speed(along?), limits))
}
