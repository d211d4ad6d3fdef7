//! The JSON schema of scenario files, for editors.
//!
//! It is built by hand beside the reader, because the reader accepts what no derive could say (quantities, near misses,
//! limits); a test compares the keys of every table with those that the reader knows.

use serde_json::{Map, Value, json};
use twinrig_document::quantity_name;
use twinrig_kernel::Unit;

use crate::catalogue::{Accepts, Catalogue, Kind, VariableSpec};
use crate::expect::CostMeasure;

/// The schema of the scenarios that a build with this catalogue accepts.
pub fn schema(catalogue: &Catalogue) -> Value {
    let properties = json!({
        "name": described("A line for a person.", json!({ "type": "string" })),
        "robot": described("A robot's name, or the path of its file; a plant that stands alone needs none.", json!({ "type": "string" })),
        "override": described("Values of the robot file to replace, by dotted key.", json!({ "type": "object" })),
        "duration": described("How long to run.", duration()),
        "seed": described("What all random streams spring from.", natural()),
        "plant": plant(&catalogue.plants),
        "actuator": actuator(),
        "controller": controller(&catalogue.controllers),
        "bus": bus(&catalogue.buses),
        "io": object(&json!({
            "step": duration(),
            "transfer_time": time(),
        }), &[]),
        "observe": object(&json!({ "period": duration() }), &[]),
        "footsteps": object(&json!({
            "touch_down": load(),
            "lift_off": load(),
            "shortest_swing": duration(),
            "least_impulse": described("Body weight times this, an impulse.", quantity(Unit::Second)),
        }), &[]),
        "record": object(&json!({
            "signals": described("Names of signals; * and ** are wild.", texts()),
            "frames": described("How often poses are written.", quantity(Unit::Hertz)),
            "bytes": described("Whether the bytes on the wires are written.", json!({ "type": "boolean" })),
        }), &[]),
        "change": list(&object(&json!({
            "at": duration(),
            "set": { "type": "string" },
            "to": any_quantity(),
            "by": any_quantity(),
        }), &["at", "set"])),
        "fault": list(&object(&json!({
            "at": duration(),
            "on": described("wire/NAME of a bus, or a place on it: wire/NAME/PLACE.", json!({ "type": "string" })),
            "kind": { "enum": ["drop", "flip", "delay", "duplicate", "reorder", "unplug", "stuck", "babble"] },
            "for": duration(),
            "probability": number(),
            "rate": number(),
            "by": duration(),
            "fails": { "type": "boolean" },
            "pause": duration(),
        }), &["at", "on", "kind"])),
        "expect": list(&expect()),
    });
    let mut schema = object(&properties, &["duration", "plant"]);
    let alone = catalogue.plants.iter().filter(|kind| kind.stands_alone);
    let alone: Vec<&str> = alone.map(|kind| kind.name.as_str()).collect();
    // Without such a plant no word is one of none, and the robot is always required.
    schema["if"] =
        json!({ "properties": { "plant": { "properties": { "model": { "enum": alone } } } } });
    schema["else"] = json!({ "required": ["robot"] });
    schema["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    schema["title"] = json!("Twinrig scenario");
    schema
}

fn plant(kinds: &[Kind]) -> Value {
    let ground = object(
        &json!({
            "friction": number(),
            "restitution": json!({ "type": "number", "minimum": 0, "maximum": 1 }),
            "profile": { "enum": ["flat", "step-down", "heights"] },
            "at": quantity(Unit::Meter),
            "height": quantity(Unit::Meter),
            "spacing": quantity(Unit::Meter),
            "values": list(&texts()),
            "amplitude": quantity(Unit::Meter),
            "seed": natural(),
        }),
        &[],
    );
    let start = object(
        &json!({
            "q1": quantity(Unit::Radian),
            "q2": quantity(Unit::Radian),
            "q3": quantity(Unit::Radian),
            "q1_rate": quantity(Unit::RadianPerSecond),
            "q2_rate": quantity(Unit::RadianPerSecond),
            "q3_rate": quantity(Unit::RadianPerSecond),
        }),
        &[],
    );
    let common = json!({
        "base": { "enum": ["free", "planar", "fixed"] },
        "legs": described("The legs to simulate; without it, all.", texts()),
        "ground": described("Without it, the robot hangs in the air.", ground),
        "start": described("Joint angles and rates of all legs; without it, where the controller first wants them.", start),
        "step": duration(),
        "coupling": described("How the plant meets boards: moved to each instant of theirs, or on a grid.", coupling()),
    });
    with_kinds(kinds, "model", &common)
}

fn coupling() -> Value {
    let grid = object(
        &json!({
            "grid": described("Its step; it divides the observation period.", duration()),
            "inputs": { "enum": ["mean", "held"] },
        }),
        &["grid"],
    );
    json!({ "anyOf": [{ "enum": ["exact"] }, grid] })
}

fn actuator() -> Value {
    let figures = json!({
        "lag": quantity(Unit::Second),
        "speed": quantity(Unit::RadianPerSecond),
        "torque": quantity(Unit::NewtonMeter),
        "dead_band": quantity(Unit::Radian),
    });
    let joint = object(&figures, &[]);
    let mut properties = figures;
    properties["kind"] = json!({ "enum": ["servo", "ideal", "none", "motor"] });
    properties["hip"] = joint.clone();
    properties["knee"] = joint;
    object(&properties, &[])
}

fn controller(kinds: &[Kind]) -> Value {
    let common = json!({
        "period": duration(),
        "compute_time": time(),
    });
    let mut schema = with_kinds(kinds, "kind", &common);
    if let Some(Value::Array(words)) = schema.pointer_mut("/properties/kind/enum") {
        words.push(json!("none"));
    }
    schema
}

fn bus(kinds: &[Kind]) -> Value {
    let name = described(
        "What it is called; without it, its kind.",
        json!({ "type": "string" }),
    );
    let one = with_kinds(kinds, "kind", &json!({ "name": name }));
    json!({ "anyOf": [one, list(&one)] })
}

/// The table of a part that comes in kinds: the keys of all kinds together, so that a schema stays one a person can read;
/// which kind has which key, the reader says. Without a catalogue any key goes.
fn with_kinds(kinds: &[Kind], key: &str, common: &Value) -> Value {
    let mut properties = common.clone();
    if kinds.is_empty() {
        properties[key] = json!({ "type": "string" });
        return json!({ "type": "object", "properties": properties, "required": [key] });
    }
    let names: Vec<&str> = kinds.iter().map(|kind| kind.name.as_str()).collect();
    properties[key] = json!({ "enum": names });
    for kind in kinds {
        for option in &kind.options {
            properties[&option.name] = described(&option.about, accepted(&option.accepts));
        }
        for variable in &kind.variables {
            properties[variable.key()] = described(&variable.about, of_variable(kind, variable));
        }
    }
    object(&properties, &[key])
}

fn accepted(accepts: &Accepts) -> Value {
    match accepts {
        Accepts::Quantity { unit, .. } => quantity(*unit),
        Accepts::Duration => duration(),
        Accepts::Natural(range) => {
            json!({ "type": "integer", "minimum": range.start(), "maximum": range.end() })
        }
        Accepts::Boolean => json!({ "type": "boolean" }),
        Accepts::Text | Accepts::Name => json!({ "type": "string" }),
        Accepts::Choice(words) => json!({ "enum": words }),
        Accepts::Time => time(),
        Accepts::Group(options) => {
            let keys = options.iter().map(|option| {
                let schema = described(&option.about, accepted(&option.accepts));
                (option.name.clone(), schema)
            });
            object(&Value::Object(keys.collect()), &[])
        }
        Accepts::Table(one) => {
            json!({ "type": "object", "additionalProperties": accepted(one) })
        }
        Accepts::Each(one) => {
            let one = accepted(one);
            json!({ "anyOf": [one, { "type": "object", "additionalProperties": one }] })
        }
    }
}

fn of_variable(kind: &Kind, variable: &VariableSpec) -> Value {
    let one = quantity(variable.unit);
    let variables = kind.variables_of(variable.key());
    let groups = variables.iter().filter_map(|variable| variable.group());
    let groups: Map<String, Value> = groups
        .map(|group| (group.to_owned(), one.clone()))
        .collect();
    if groups.is_empty() {
        return one;
    }
    json!({ "anyOf": [one, object(&Value::Object(groups), &[])] })
}

fn expect() -> Value {
    object(
        &json!({
            "name": { "type": "string" },
            "after": duration(),
            "before": duration(),
            "optional": { "type": "boolean" },
            "plants": { "type": "array", "items": { "type": "string" } },
            "footstep": footstep(),
            "body": body(),
            "timing": timing(),
            "signal": signal(),
            "energy": object(&json!({ "residual": limits(Unit::One) }), &["residual"]),
            "cost": cost(),
        }),
        &[],
    )
}

fn footstep() -> Value {
    let leg = json!({ "anyOf": [{ "type": "string" }, texts()] });
    let phases = json!({ "type": "object", "additionalProperties": { "type": "number" } });
    let patterns = json!({ "enum": ["trot", "pace", "walk", "bound"] });
    let properties = json!({
        "leg": leg,
        "slip": limits(Unit::Meter),
        "duty_factor": limits(Unit::One),
        "stance": limits(Unit::Second),
        "swing": limits(Unit::Second),
        "frequency": limits(Unit::Hertz),
        "stride": limits(Unit::Meter),
        "impulse": limits(Unit::NewtonSecond),
        "peak_load": limits(Unit::Newton),
        "position": limits(Unit::Meter),
        "axis": { "enum": ["x", "y", "z", "horizontal"] },
        "count": limits(Unit::One),
        "phase": { "anyOf": [patterns, phases] },
        "tolerance": number(),
        "phase_spread": limits(Unit::One),
        "order": list(&leg),
        "displacement": limits(Unit::Meter),
        "against": { "enum": ["without changes"] },
        "cycle": natural(),
    });
    object(&properties, &[])
}

fn body() -> Value {
    let thresholds = json!({ "height": number(), "tilt": quantity(Unit::Radian) });
    let properties = json!({
        "speed": limits(Unit::MeterPerSecond),
        "along": { "enum": ["heading", "path"] },
        "height": limits(Unit::Meter),
        "height_range": limits(Unit::Meter),
        "roll": limits(Unit::Radian),
        "roll_range": limits(Unit::Radian),
        "pitch": limits(Unit::Radian),
        "pitch_range": limits(Unit::Radian),
        "yaw_drift": limits(Unit::Radian),
        "fall": { "anyOf": [{ "const": false }, object(&thresholds, &[])] },
        "settles": settles(&quantity(Unit::Meter)),
    });
    object(&properties, &[])
}

fn timing() -> Value {
    let properties = json!({
        "of": described("control, or the name of a bus.", json!({ "type": "string" })),
        "deadline_misses": limits(Unit::One),
        "cycle_rate": limits(Unit::Hertz),
        "jitter": limits(Unit::Second),
        "latency": limits(Unit::Second),
        "longest_cycle": limits(Unit::Second),
        "half_range": limits(Unit::Second),
    });
    object(&properties, &["of"])
}

fn signal() -> Value {
    let any = any_quantity();
    let component = json!({ "anyOf": [{ "enum": ["x", "y", "z"] }, natural()] });
    let until = json!({
        "name": { "type": "string" },
        "component": component,
        "min": any, "max": any, "near": any, "within": any,
    });
    let properties = json!({
        "name": { "type": "string" },
        "component": component,
        "always": limits_of(&any),
        "until": object(&until, &["name"]),
        "eventually": limits_of(&any),
        "within": duration(),
        "settles": settles(&any),
    });
    object(&properties, &["name"])
}

fn cost() -> Value {
    let measures = CostMeasure::COUNTS.iter().chain(&["real_time_factor"]);
    let properties: Map<String, Value> = measures
        .map(|measure| ((*measure).to_owned(), limits(Unit::One)))
        .collect();
    object(&Value::Object(properties), &[])
}

fn settles(within: &Value) -> Value {
    object(
        &json!({ "within": within, "by": duration() }),
        &["within", "by"],
    )
}

fn limits(unit: Unit) -> Value {
    limits_of(&quantity(unit))
}

fn limits_of(value: &Value) -> Value {
    object(
        &json!({ "min": value, "max": value, "near": value, "within": any_quantity() }),
        &[],
    )
}

fn object(properties: &Value, required: &[&str]) -> Value {
    let mut object = json!({
        "type": "object",
        "properties": properties,
        "additionalProperties": false,
    });
    if !required.is_empty() {
        object["required"] = json!(required);
    }
    object
}

fn described(about: &str, mut value: Value) -> Value {
    if !about.is_empty() {
        value["description"] = json!(about);
    }
    value
}

fn list(of: &Value) -> Value {
    json!({ "type": "array", "items": of })
}

fn texts() -> Value {
    list(&json!({ "type": "string" }))
}

fn natural() -> Value {
    json!({ "type": "integer", "minimum": 0 })
}

fn number() -> Value {
    quantity(Unit::One)
}

fn quantity(unit: Unit) -> Value {
    if unit == Unit::One {
        return json!({ "type": ["number", "string"] });
    }
    json!({ "type": "string", "pattern": "^[+-]?[0-9]", "title": quantity_name(unit) })
}

fn any_quantity() -> Value {
    json!({ "type": ["number", "string"], "title": "a quantity" })
}

fn duration() -> Value {
    quantity(Unit::Second)
}

fn load() -> Value {
    json!({ "type": ["number", "string"], "title": "a force, or a share of the body's weight" })
}

fn time() -> Value {
    let table = object(
        &json!({
            "min": duration(),
            "max": duration(),
            "mean": duration(),
            "deviation": duration(),
            "trace": list(&duration()),
        }),
        &[],
    );
    json!({ "anyOf": [duration(), table] })
}
