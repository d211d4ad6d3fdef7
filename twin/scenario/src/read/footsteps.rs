//! Reading `[footsteps]`.

use serde_json::json;
use twinrig_document::{Item, Range, Reported};
use twinrig_kernel::{SimDuration, Unit};

use crate::language::{Accepts, Key, Shape, TableSpec, Type, quantity, table};
use crate::scenario::{FootstepSpec, LoadThreshold};

const FORCE: Shape = Shape::One(Accepts::Quantity {
    unit: Unit::Newton,
    range: Range::POSITIVE,
});
const SHARE: Shape = Shape::One(Accepts::Quantity {
    unit: Unit::One,
    range: Range::POSITIVE,
});
const LOAD: Type<LoadThreshold> = Type::new(Shape::Either(&[FORCE, SHARE]), |item, _| load(item));

// The load of a stance foot is a quarter of the body weight in standing and up to the whole in a
// trot; residual loads in swing are below a twentieth, and stance loads above a fiftieth. A swing
// of the gaits takes at least 100 ms, a bounce at most 30 ms.
table! {
    /// Keys of `[footsteps]`.
    pub(super) footsteps_table = TableSpec::new("[footsteps]", "thresholds of a footstep")
        .refined(both_are_forces_or_shares);
    TOUCH_DOWN: LoadThreshold = "touch_down", LOAD,
        "load at which a foot touches down; a number is a share of the weight",
        r#"touch_down = "0.5 N", lift_off = "0.2 N""#, default("0.05");
    LIFT_OFF: LoadThreshold = "lift_off", LOAD, "load below which it lifts off, likewise",
        "lift_off = 0.01", default("0.02");
    SHORTEST_SWING: SimDuration = "shortest_swing", Type::DURATION, "shorter swings are bounces",
        r#"shortest_swing = "30 ms""#, default("'40 ms'");
    LEAST_IMPULSE: f64 = "least_impulse", quantity(Unit::Second, Range::NOT_NEGATIVE),
        "contacts of less impulse, in times of the body weight, are scuffs",
        r#"least_impulse = "2 ms""#, default("'5 ms'");
}

/// Adds the condition that both thresholds are forces, or neither is; by default they are shares.
fn both_are_forces_or_shares(schema: &mut serde_json::Value) {
    use footsteps_table::{LIFT_OFF, TOUCH_DOWN};
    let load = &schema["properties"][TOUCH_DOWN.name]["anyOf"];
    let both = |load: &serde_json::Value| json!({ TOUCH_DOWN.name: load, LIFT_OFF.name: load });
    schema["anyOf"] = json!([
        { "properties": both(&load[1]) },
        { "properties": both(&load[0]), "required": [TOUCH_DOWN.name, LIFT_OFF.name] },
    ]);
}

/// Reads `[footsteps]`.
pub(super) fn footsteps(item: &Item<'_>) -> Result<FootstepSpec, Reported> {
    use footsteps_table::{LEAST_IMPULSE, LIFT_OFF, SHORTEST_SWING, TOUCH_DOWN};
    let table = &item.table()?;
    let table = footsteps_table::TABLE.of(table);
    let (touch_down, lift_off) = (table.read(&TOUCH_DOWN), table.read(&LIFT_OFF));
    let (shortest_swing, least_impulse) = (table.read(&SHORTEST_SWING), table.read(&LEAST_IMPULSE));
    let spec = FootstepSpec {
        touch_down: touch_down?,
        lift_off: lift_off?,
        shortest_swing: shortest_swing?,
        least_impulse: least_impulse?,
    };
    match (spec.lift_off, spec.touch_down) {
        (LoadThreshold::OfWeight(low), LoadThreshold::OfWeight(high))
        | (LoadThreshold::Newton(low), LoadThreshold::Newton(high))
            if low <= high =>
        {
            Ok(spec)
        }
        (LoadThreshold::OfWeight(_), LoadThreshold::OfWeight(_))
        | (LoadThreshold::Newton(_), LoadThreshold::Newton(_)) => {
            let message = "`lift_off` is more than `touch_down`";
            let help = "`lift_off` must not exceed `touch_down` (hysteresis)";
            Err(table.report(&LIFT_OFF, message, help))
        }
        _ => {
            let message =
                "`touch_down` and `lift_off` are not both forces or both shares of the weight";
            let help = "as in \"0.5 N\" and \"0.2 N\", or 0.05 and 0.02";
            Err(table.report(&TOUCH_DOWN, message, help))
        }
    }
}

fn load(item: &Item<'_>) -> Result<LoadThreshold, Reported> {
    if item.spelled_unit() == Unit::Newton {
        let load = item.quantity(Unit::Newton, &Range::POSITIVE)?;
        return Ok(LoadThreshold::Newton(load));
    }
    Ok(LoadThreshold::OfWeight(item.number(&Range::POSITIVE)?))
}
