//! The schema of `[plant]` and `[actuator]`.

use serde_json::{Value, json};
use twinrig_document::Range;
use twinrig_kernel::Unit;

use super::builders::{
    by_value, described, list, natural, number, object, only_keys, open_object, positive_duration,
    quantity, texts,
};
use super::kinds::{Common, with_kinds};
use crate::catalogue::Kind;

pub(super) fn plant(kinds: &[Kind], defs: &mut serde_json::Map<String, Value>) -> Value {
    let angle = quantity(Unit::Radian, &Range::ANY);
    let rate = quantity(Unit::RadianPerSecond, &Range::ANY);
    let start = object(
        json!({
            "q1": angle, "q2": angle, "q3": angle,
            "q1_rate": rate, "q2_rate": rate, "q3_rate": rate,
        }),
        &[],
    );
    let mut legs = texts();
    legs["uniqueItems"] = json!(true);
    legs["minItems"] = json!(1);
    let common = json!({
        "base": { "enum": ["free", "planar", "fixed"] },
        "legs": described("The legs to simulate; by default all.", legs),
        "ground": described("The ground; without it the robot hangs in the air.", ground()),
        "start": described("Initial joint angles and rates of all legs; by default the controller's first command.", start),
        "step": positive_duration(),
        "coupling": described("Coupling of the plant to the boards: exact, at each of their instants, or on a fixed grid.", coupling()),
    });
    let common = Common {
        table: "plant",
        key: "model",
        properties: common,
        required: &[],
        // Properties that a standalone model defines itself.
        not_standalone: &["base", "legs", "ground", "start"],
    };
    with_kinds(&common, kinds, None, defs)
}

fn ground() -> Value {
    let length = quantity(Unit::Meter, &Range::ANY);
    let mut row = list(&length);
    row["minItems"] = json!(1);
    let mut rows = list(&row);
    rows["minItems"] = json!(1);
    let mut ground = open_object(
        json!({
            "friction": number(&Range::NOT_NEGATIVE),
            "restitution": number(&Range::between(0.0, 1.0)),
            "profile": { "enum": ["flat", "step-down", "heights"] },
            "at": length,
            "height": quantity(Unit::Meter, &Range::NOT_NEGATIVE),
            "spacing": quantity(Unit::Meter, &Range::POSITIVE),
            "values": rows,
            "amplitude": quantity(Unit::Meter, &Range::NOT_NEGATIVE),
            "seed": natural(),
        }),
        &[],
    );
    let profile = |more: &[&'static str], required: &[&str]| {
        let keys = ["friction", "restitution", "profile"].iter().chain(more);
        let mut keys = only_keys(keys.copied());
        keys["required"] = json!(required);
        keys
    };
    let mut heights = profile(&["spacing", "values", "amplitude", "seed"], &["spacing"]);
    heights["oneOf"] = json!([{ "required": ["values"] }, { "required": ["amplitude"] }]);
    heights["dependentRequired"] = json!({ "seed": ["amplitude"] });
    let cases = [
        ("flat", profile(&[], &[])),
        ("step-down", profile(&["at", "height"], &["at", "height"])),
        ("heights", heights),
    ];
    let cases = cases.map(|(value, case)| (vec![value.to_owned()], case));
    by_value(&mut ground, "profile", Some("flat"), cases.into_iter());
    ground
}

fn coupling() -> Value {
    let grid = object(
        json!({
            "grid": described("Step of the grid; it must divide the observation period.", positive_duration()),
            "inputs": { "enum": ["mean", "held"] },
        }),
        &["grid"],
    );
    json!({ "anyOf": [{ "enum": ["exact"] }, grid] })
}

pub(super) fn actuator() -> Value {
    let parameters = json!({
        "lag": quantity(Unit::Second, &Range::POSITIVE),
        "speed": quantity(Unit::RadianPerSecond, &Range::POSITIVE),
        "torque": quantity(Unit::NewtonMeter, &Range::POSITIVE),
        "dead_band": quantity(Unit::Radian, &Range::NOT_NEGATIVE),
    });
    let joint = object(parameters.clone(), &[]);
    let mut properties = parameters;
    properties["kind"] = json!({ "enum": ["servo", "ideal", "none", "motor"] });
    properties["hip"] = joint.clone();
    properties["knee"] = joint;
    let mut actuator = object(properties, &[]);
    let mut without = only_keys(["kind", "hip", "knee"]);
    without["properties"] =
        json!({ "hip": { "maxProperties": 0 }, "knee": { "maxProperties": 0 } });
    let values = ["ideal", "none", "motor"].map(str::to_owned);
    by_value(
        &mut actuator,
        "kind",
        None,
        [(values.into(), without)].into_iter(),
    );
    actuator
}
