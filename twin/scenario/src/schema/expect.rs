//! The schema of `[[expect]]`.

use std::ops::Bound;

use serde_json::{Map, Value, json};
use twinrig_document::{Range, percentage_pattern, quantity_name};
use twinrig_kernel::Unit;

use super::builders::{
    any_quantity, boolean, described, duration, list, natural, number, object, object_of_one,
    positive_duration, quantity, reference, table_of, text, texts,
};
use crate::catalogue::Kind;
use crate::expect::{
    BODY_MEASURES, CostMeasure, FOOTSTEP_MEASURES, SIGNAL_MODES, SUBJECTS, TIMING_MEASURES,
};

pub(super) fn expect(plants: &[Kind], defs: &mut Map<String, Value>) -> Value {
    let plants: Vec<&str> = plants.iter().map(|kind| kind.name.as_str()).collect();
    let mut of_plants = list(&json!({ "enum": plants }));
    of_plants["minItems"] = json!(1);
    let mut limits = Limits { defs };
    let properties = json!({
        "name": text(),
        "after": duration(),
        "before": duration(),
        "optional": boolean(),
        "plants": of_plants,
        "footstep": footstep(&mut limits),
        "body": body(&mut limits),
        "timing": timing(&mut limits),
        "signal": signal(&mut limits),
        "energy": object(json!({ "residual": limits.of(Unit::One) }), &["residual"]),
        "cost": cost(&mut limits),
    });
    object_of_one(properties, &[], &SUBJECTS)
}

/// Definitions of tables of limits, each of them once.
struct Limits<'a> {
    defs: &'a mut Map<String, Value>,
}

impl Limits<'_> {
    fn of(&mut self, unit: Unit) -> Value {
        let name = quantity_name(unit);
        let name = name.trim_start_matches("a ").trim_start_matches("an ");
        let name = format!("limits.{}", name.replace(' ', "_"));
        self.define(name, || {
            let mut within = quantity(unit, &Range::NOT_NEGATIVE);
            if unit != Unit::One {
                let share = json!({ "type": "string", "pattern": percentage_pattern() });
                within = json!({ "anyOf": [within, share] });
            }
            limits(&quantity(unit, &Range::ANY), &within, Map::new(), &[])
        })
    }

    /// Returns the table of limits for any unit.
    fn of_any(&mut self) -> Value {
        self.define("limits.quantity".to_owned(), || {
            let within = any_quantity(&Range::NOT_NEGATIVE);
            limits(&any_quantity(&Range::ANY), &within, Map::new(), &[])
        })
    }

    fn define(&mut self, name: String, make: impl FnOnce() -> Value) -> Value {
        let reference = reference(&name);
        self.defs.entry(name).or_insert_with(make);
        reference
    }
}

/// Returns a table of limits with additional keys.
fn limits(value: &Value, within: &Value, more: Map<String, Value>, required: &[&str]) -> Value {
    let mut properties = json!({ "min": value, "max": value, "near": value, "within": within });
    if let Some(properties) = properties.as_object_mut() {
        properties.extend(more);
    }
    let mut limits = object(properties, required);
    limits["oneOf"] = json!([
        { "required": ["near"] },
        { "anyOf": [{ "required": ["min"] }, { "required": ["max"] }] },
    ]);
    limits["dependentRequired"] = json!({ "near": ["within"], "within": ["near"] });
    limits
}

fn footstep(limits: &mut Limits<'_>) -> Value {
    let mut named = texts();
    named["minItems"] = json!(1);
    named["uniqueItems"] = json!(true);
    let leg = json!({ "anyOf": [text(), named] });
    let phases = table_of(&number(&Range::between(0.0, 1.0)));
    let patterns = json!({ "enum": ["trot", "pace", "walk", "bound"] });
    let mut order = list(&leg);
    order["minItems"] = json!(2);
    order["uniqueItems"] = json!(true);
    let below_half = Range {
        max: Bound::Excluded(0.5),
        ..Range::NOT_NEGATIVE
    };
    let mut cycle = natural();
    cycle["minimum"] = json!(1);
    cycle["maximum"] = json!(u32::MAX);
    let properties = json!({
        "leg": leg,
        "slip": limits.of(Unit::Meter),
        "duty_factor": limits.of(Unit::One),
        "stance": limits.of(Unit::Second),
        "swing": limits.of(Unit::Second),
        "frequency": limits.of(Unit::Hertz),
        "stride": limits.of(Unit::Meter),
        "impulse": limits.of(Unit::NewtonSecond),
        "peak_load": limits.of(Unit::Newton),
        "position": limits.of(Unit::Meter),
        "axis": { "enum": ["x", "y", "z", "horizontal"] },
        "count": limits.of(Unit::One),
        "phase": { "anyOf": [patterns, phases] },
        "tolerance": number(&below_half),
        "phase_spread": limits.of(Unit::One),
        "order": order,
        "displacement": limits.of(Unit::Meter),
        "against": { "enum": ["without changes"] },
        "cycle": cycle,
    });
    let mut footstep = object_of_one(properties, &[], &FOOTSTEP_MEASURES);
    footstep["dependentRequired"] = json!({
        "phase": ["tolerance"],
        "tolerance": ["phase"],
        "displacement": ["against"],
        "against": ["displacement"],
        "cycle": ["displacement"],
    });
    let position = json!({
        "required": ["position"],
        "properties": { "axis": { "enum": ["x", "y", "z"] } },
    });
    footstep["dependentSchemas"] =
        json!({ "axis": { "anyOf": [{ "required": ["displacement"] }, position] } });
    footstep
}

/// Returns the table of the thresholds of a fall.
pub(super) fn fall() -> Value {
    let thresholds = json!({
        "height": described(
            "Least height of the trunk, as a share of its initial height.",
            number(&Range::between(0.0, 1.0)),
        ),
        "tilt": quantity(Unit::Radian, &Range::NOT_NEGATIVE),
        "end": described("Whether a fall ends the run.", boolean()),
    });
    object(thresholds, &[])
}

fn body(limits: &mut Limits<'_>) -> Value {
    let properties = json!({
        "speed": limits.of(Unit::MeterPerSecond),
        "along": { "enum": ["heading", "path"] },
        "height": limits.of(Unit::Meter),
        "height_range": limits.of(Unit::Meter),
        "roll": limits.of(Unit::Radian),
        "roll_range": limits.of(Unit::Radian),
        "pitch": limits.of(Unit::Radian),
        "pitch_range": limits.of(Unit::Radian),
        "yaw_drift": limits.of(Unit::Radian),
        "fall": { "anyOf": [{ "const": false }, fall()] },
        "settles": settles(&quantity(Unit::Meter, &Range::NOT_NEGATIVE)),
    });
    let mut body = object_of_one(properties, &[], &BODY_MEASURES);
    body["dependentRequired"] = json!({ "along": ["speed"] });
    body
}

fn timing(limits: &mut Limits<'_>) -> Value {
    let mut properties = json!({
        "of": described("control, or the name of a bus.", text()),
    });
    for (key, measure) in TIMING_MEASURES {
        properties[key] = limits.of(measure.unit());
    }
    object_of_one(properties, &["of"], &TIMING_MEASURES.map(|(key, _)| key))
}

fn signal(any: &mut Limits<'_>) -> Value {
    let component = json!({ "anyOf": [{ "enum": ["x", "y", "z"] }, natural()] });
    let until: Map<String, Value> = [
        ("name".to_owned(), text()),
        ("component".to_owned(), component.clone()),
    ]
    .into_iter()
    .collect();
    let within = any_quantity(&Range::NOT_NEGATIVE);
    let properties = json!({
        "name": text(),
        "component": component,
        "always": any.of_any(),
        "until": limits(&any_quantity(&Range::ANY), &within, until, &["name"]),
        "eventually": any.of_any(),
        "within": positive_duration(),
        "settles": settles(&within),
    });
    let mut signal = object_of_one(properties, &["name"], &SIGNAL_MODES);
    signal["dependentRequired"] = json!({ "until": ["always"], "within": ["eventually"] });
    signal
}

fn cost(limits: &mut Limits<'_>) -> Value {
    let counts = CostMeasure::counts().into_iter();
    let measures: Vec<&str> = counts.chain([CostMeasure::FACTOR]).collect();
    let properties: Map<String, Value> = measures
        .iter()
        .map(|measure| ((*measure).to_owned(), limits.of(Unit::One)))
        .collect();
    object_of_one(Value::Object(properties), &[], &measures)
}

fn settles(within: &Value) -> Value {
    object(
        json!({ "within": within, "by": duration() }),
        &["within", "by"],
    )
}
