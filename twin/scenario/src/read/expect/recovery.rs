//! Reading the recovery from a disturbance.

use serde_json::json;
use twinrig_document::{Item, Range, Reported, suggestion};
use twinrig_kernel::{SimDuration, SimTime, Unit};

use super::context::{Context, instant};
use crate::body::BodyClaim;
use crate::expect::{Claim, Expectation, SignalClaim, SignalMode};
use crate::language::{
    Accepts, Declared, Key, Shape, TableSpec, Type, contextual, quantity, table,
};
use crate::read::print_duration;
use crate::recovery::{Recovery, TrunkQuantity};

table! {
    /// Keys of `recovers` of the trunk.
    pub(super) body_recovers_table =
        TableSpec::new("recovers", "recovery of the trunk from a disturbance").refined(a_quantity);
    AFTER: () = "after", contextual(TIME_OR_NAME), "name of a push, or time of another disturbance",
        r#"after = "3 s", roll = "2 deg""#, required();
    WITHIN: SimDuration = "within", Type::POSITIVE_DURATION, "greatest time of the recovery",
        r#"within = "2 s", roll = "2 deg""#, required();
    ROLL: f64 = "roll", quantity(Unit::Radian, Range::NOT_NEGATIVE), "tolerance of the roll",
        r#"roll = "2 deg""#;
    PITCH: f64 = "pitch", quantity(Unit::Radian, Range::NOT_NEGATIVE), "tolerance of the pitch",
        r#"pitch = "2 deg""#;
    YAW: f64 = "yaw", quantity(Unit::Radian, Range::NOT_NEGATIVE), "tolerance of the heading",
        r#"yaw = "10 deg""#;
    HEIGHT: f64 = "height", quantity(Unit::Meter, Range::NOT_NEGATIVE), "tolerance of the height",
        r#"height = "5 mm""#;
    SPEED: f64 = "speed", quantity(Unit::MeterPerSecond, Range::NOT_NEGATIVE),
        "tolerance of the speed along the heading", r#"speed = "10 cm/s""#;
}

table! {
    /// Keys of `recovers` of signals.
    pub(super) signal_recovers_table =
        TableSpec::new("signal.recovers", "recovery of signals from a disturbance");
    TIME: () = "after", contextual(TIME_OR_NAME), "name of a push, or time of another disturbance",
        r#"after = "3 s""#, required();
    LIMIT: SimDuration = "within", Type::POSITIVE_DURATION, "greatest time of the recovery",
        r#"within = "2 s""#, required();
    TOLERANCE: () = "tolerance", contextual(Shape::Measured(Range::NOT_NEGATIVE)),
        "distance from the range before, in the unit of the signal", r#"tolerance = "2 deg""#,
        required();
}

const TIME_OR_NAME: Shape =
    Shape::Either(&[Shape::One(Accepts::Duration), Shape::One(Accepts::Name)]);

/// Tolerances of the trunk.
const TOLERANCES: [(Key<f64>, TrunkQuantity); 5] = [
    (body_recovers_table::ROLL, TrunkQuantity::Roll),
    (body_recovers_table::PITCH, TrunkQuantity::Pitch),
    (body_recovers_table::YAW, TrunkQuantity::Yaw),
    (body_recovers_table::HEIGHT, TrunkQuantity::Height),
    (body_recovers_table::SPEED, TrunkQuantity::Speed),
];

/// Adds the condition that there is a tolerance.
fn a_quantity(schema: &mut serde_json::Value) {
    let keys = TOLERANCES.map(|(key, _)| json!({ "required": [key.name] }));
    schema["anyOf"] = json!(keys);
}

/// Reads `recovers = { … }` of the trunk.
pub(super) fn of_body(item: &Item<'_>, context: &Context<'_>) -> Result<BodyClaim, Reported> {
    use body_recovers_table::{AFTER, TABLE, WITHIN};
    let table = &item.table()?;
    let table = TABLE.of(table);
    let recovery = recovery(table, &AFTER, &WITHIN, context);
    let tolerances: Vec<_> = TOLERANCES
        .iter()
        .map(|(key, quantity)| Ok(table.get(key)?.map(|tolerance| (*quantity, tolerance))))
        .collect();
    let tolerances: Result<Vec<Option<_>>, Reported> = tolerances.into_iter().collect();
    let (recovery, tolerances) = (recovery?, tolerances?);
    let tolerances: Vec<_> = tolerances.into_iter().flatten().collect();
    if tolerances.is_empty() {
        let names = TOLERANCES.map(|(key, _)| key.name).join(", ");
        let help = format!("give a tolerance of one or more of {names}");
        return Err(item.report("no quantity that recovers is named", help));
    }
    Ok(BodyClaim::Recovers(recovery, tolerances))
}

/// Reads `recovers = { … }` of a signal.
pub(super) fn of_signal(
    item: &Item<'_>,
    context: &Context<'_>,
) -> Result<(Unit, SignalMode), Reported> {
    use signal_recovers_table::{LIMIT, TABLE, TIME, TOLERANCE};
    let table = &item.table()?;
    let table = TABLE.of(table);
    let recovery = recovery(table, &TIME, &LIMIT, context);
    let tolerance = table.read_with(&TOLERANCE, |item| {
        let unit = item.any_unit()?;
        Ok((unit, item.quantity(unit, &Range::NOT_NEGATIVE)?))
    });
    let (unit, tolerance) = tolerance?;
    Ok((unit, SignalMode::Recovers(recovery?, tolerance)))
}

fn recovery(
    table: Declared<'_, '_>,
    after: &Key<()>,
    within: &Key<SimDuration>,
    context: &Context<'_>,
) -> Result<Recovery, Reported> {
    let disturbance = table.read_with(after, |item| disturbance(item, context));
    let within = table.read(within);
    let (start, end) = disturbance?;
    Ok(Recovery {
        start,
        end,
        within: within?,
    })
}

/// Reads start and end of a disturbance: the name of a push, or a time, which is both.
fn disturbance(item: &Item<'_>, context: &Context<'_>) -> Result<(SimTime, SimTime), Reported> {
    let text = item.text()?;
    if text
        .trim_start()
        .starts_with(|first: char| !first.is_alphabetic())
    {
        let at = instant(item, context)?;
        return Ok((at, at));
    }
    context.push(text).ok_or_else(|| {
        let message = format!("there is no push `{text}`");
        let known = context.pushes.iter().map(|push| push.name.as_str());
        if known.len() == 0 {
            return item.report(message, "give a time, such as \"3 s\"");
        }
        item.report(message, suggestion(text, "pushes", known))
    })
}

/// Reports a recovery whose window lacks the time before the disturbance, or the time to recover.
pub(super) fn check(
    item: &Item<'_>,
    expectation: &Expectation,
    context: &Context<'_>,
) -> Result<(), Reported> {
    let (Claim::Body(BodyClaim::Recovers(recovery, _))
    | Claim::Signal(SignalClaim {
        mode: SignalMode::Recovers(recovery, _),
        ..
    })) = &expectation.claim
    else {
        return Ok(());
    };
    let Some(item) = item.peek("recovers") else {
        return Ok(());
    };
    if recovery.start <= expectation.after {
        let message = "there is no time before the disturbance in this window";
        let help = "the state before is that from the `after` of the expectation on: give an \
                    earlier one, or a later disturbance";
        return Err(item.report(message, help));
    }
    let end = SimTime::ZERO + context.duration;
    let end = expectation.before.map_or(end, |before| before.min(end));
    let recovered_by = recovery.end.checked_add(recovery.within);
    if recovered_by.is_none_or(|by| by >= end) {
        let message = format!(
            "`within` reaches to the end of the window, at {}",
            print_duration(end.since_start())
        );
        let help = "a recovery is shown by the time after it: give a shorter `within`, or a \
                    longer `duration`";
        return Err(item.report(message, help));
    }
    Ok(())
}
