//! The JSON schema of scenario files, for editors and for programs that write scenarios.
//!
//! It is written by hand in parallel to the reader, because no derive macro can express quantities,
//! near misses and limits. It accepts everything that the reader accepts, and rejects what the
//! reader rejects as far as a schema allows: sums and order of values, properties of a robot or a
//! model, and references between tables are beyond it. Tests compare it with the reader by an
//! independent validator.

mod builders;
mod expect;
mod kinds;
mod plant;
mod share;

use serde_json::{Map, Value, json};
use twinrig_document::Range;
use twinrig_kernel::Unit;

use crate::catalogue::{Catalogue, Kind};
use builders::{
    any_quantity, boolean, by_value, described, duration, list, natural, number, object, only_keys,
    open_object, positive_duration, quantity, reference, text, texts, time,
};
use kinds::{Common, changes, with_kinds};
use plant::{actuator, plant};

/// Returns the schema of the scenarios that a build with this catalogue accepts, in JSON Schema
/// draft 2020-12.
///
/// A kind that the build lacks is valid in the schema, and its keys are unrestricted where they are
/// unknown: the scenario is valid, and another build runs it.
pub fn schema(catalogue: &Catalogue) -> Value {
    let mut defs = Map::new();
    let properties = json!({
        "name": described("Title of the scenario, one line.", text()),
        "robot": described("Name of a robot or path of its file; a standalone plant requires none.", text()),
        "override": described("Values of the robot file to replace, by dotted key.", json!({ "type": "object" })),
        "duration": described("Duration of the run.", positive_duration()),
        "seed": described("Seed of all random streams.", natural()),
        "plant": plant(&catalogue.plants, &mut defs),
        "actuator": actuator(),
        "controller": controller(&catalogue.controllers, &mut defs),
        "bus": bus(&catalogue.buses, &mut defs),
        "io": object(json!({
            "step": positive_duration(),
            "transfer_time": time(),
        }), &[]),
        "observe": object(json!({ "period": positive_duration() }), &[]),
        "fall": described("Thresholds of a fall of the robot.", expect::fall()),
        "footsteps": footsteps(),
        "record": object(json!({
            "signals": described("Names of the recorded signals; * and ** are wildcards.", texts()),
            "frames": described("Rate at which poses are recorded.", quantity(Unit::Hertz, &Range::NOT_NEGATIVE)),
            "bytes": described("Whether the bytes on the wires are recorded.", boolean()),
        }), &[]),
        "change": list(&change()),
        "fault": list(&fault()),
        "expect": list(&expect::expect(&catalogue.plants, &mut defs)),
    });
    let mut schema = json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Twinrig scenario",
    });
    let root = object(properties, &["duration", "plant"]);
    if let (Some(schema), Value::Object(root)) = (schema.as_object_mut(), root) {
        schema.extend(root);
    }
    cross_table_rules(&mut schema, catalogue, &mut defs);
    schema["$defs"] = Value::Object(defs);
    share::share(&mut schema);
    schema
}

/// Adds the conditions between tables.
fn cross_table_rules(schema: &mut Value, catalogue: &Catalogue, defs: &mut Map<String, Value>) {
    let standalone = catalogue.plants.iter().filter(|kind| kind.is_standalone);
    let standalone: Vec<&str> = standalone.map(|kind| kind.name.as_str()).collect();
    let model = json!({ "properties": { "model": { "enum": standalone } }, "required": ["model"] });
    schema["if"] = json!({ "properties": { "plant": model }, "required": ["plant"] });
    schema["then"] = json!({ "properties": { "actuator": false } });
    schema["else"] = json!({ "required": ["robot"] });
    schema["dependentRequired"] = json!({ "override": ["robot"], "change": ["controller"] });
    let none = json!({ "properties": { "change": false } });
    let mut cases = vec![(vec![NONE.to_owned()], none)];
    for kind in &catalogue.controllers {
        let name = format!("change.{}", kind.name);
        let items = reference(&name);
        defs.insert(name, changes(kind));
        let case = json!({ "properties": { "change": { "items": items } } });
        cases.push((vec![kind.name.clone()], case));
    }
    let faults = json!({ "properties": { "fault": { "maxItems": 0 } } });
    schema["dependentSchemas"] = json!({
        "change": of_controller(cases),
        "fault": { "if": faults, "else": { "required": ["bus"] } },
    });
}

/// Returns the conditions on the kind of the controller; the first case that contains it applies.
fn of_controller(cases: Vec<(Vec<String>, Value)>) -> Value {
    let mut chain = json!({});
    for (names, then) in cases.into_iter().rev() {
        let kind = json!({ "properties": { "kind": { "enum": names } }, "required": ["kind"] });
        let fits = json!({ "properties": { "controller": kind }, "required": ["controller"] });
        chain = json!({ "if": fits, "then": then, "else": chain });
    }
    chain
}

const NONE: &str = "none";

fn controller(kinds: &[Kind], defs: &mut Map<String, Value>) -> Value {
    let common = Common {
        table: "controller",
        key: "kind",
        properties: json!({ "period": positive_duration(), "compute_time": time() }),
        required: &["period"],
        not_standalone: &[],
    };
    let none = (NONE, only_keys(["kind"]));
    with_kinds(&common, kinds, Some(none), defs)
}

fn bus(kinds: &[Kind], defs: &mut Map<String, Value>) -> Value {
    if kinds.is_empty() {
        return json!(false);
    }
    let mut name = described("Name of the bus; by default its kind.", text());
    name["pattern"] = json!("^[^/=]+$");
    let common = Common {
        table: "bus",
        key: "kind",
        properties: json!({ "name": name }),
        required: &[],
        not_standalone: &[],
    };
    // One table or a list of them: conditions on tables do not apply to lists, so one schema covers
    // both.
    let mut bus = with_kinds(&common, kinds, None, defs);
    bus["type"] = json!(["object", "array"]);
    bus["items"] = json!({ "allOf": [{ "type": "object" }, { "$ref": "#/properties/bus" }] });
    bus
}

fn footsteps() -> Value {
    let share = number(&Range::POSITIVE);
    let force = quantity(Unit::Newton, &Range::POSITIVE);
    let load = json!({
        "title": "a force, or a share of the body's weight",
        "anyOf": [force, share],
    });
    let mut footsteps = object(
        json!({
            "touch_down": load,
            "lift_off": load,
            "shortest_swing": duration(),
            "least_impulse": described(
                "Least impulse of a footstep, as a multiple of the body weight.",
                quantity(Unit::Second, &Range::NOT_NEGATIVE),
            ),
        }),
        &[],
    );
    // Both thresholds are forces, or neither is; by default they are shares.
    let both = |load: &Value| json!({ "touch_down": load, "lift_off": load });
    footsteps["anyOf"] = json!([
        { "properties": both(&share) },
        { "properties": both(&force), "required": ["touch_down", "lift_off"] },
    ]);
    footsteps
}

fn change() -> Value {
    let amount = any_quantity(&Range::ANY);
    let mut change = object(
        json!({ "at": duration(), "set": text(), "to": amount, "by": amount }),
        &["at", "set"],
    );
    change["oneOf"] = json!([{ "required": ["to"] }, { "required": ["by"] }]);
    change
}

fn fault() -> Value {
    let share = number(&Range::between(0.0, 1.0));
    let mut on = described(
        "wire/NAME of a bus, or a place on it: wire/NAME/PLACE.",
        text(),
    );
    on["pattern"] = json!("^wire/");
    let mut fault = open_object(
        json!({
            "at": duration(),
            "on": on,
            "kind": { "enum": ["drop", "flip", "delay", "duplicate", "reorder", "unplug", "stuck", "babble"] },
            "for": positive_duration(),
            "probability": share,
            "rate": share,
            "by": duration(),
            "fails": boolean(),
            "pause": duration(),
        }),
        &["at", "on", "kind"],
    );
    let with = |more: &[&'static str], required: &[&str]| {
        let every = ["at", "on", "kind", "for"].iter().chain(more);
        let mut keys = only_keys(every.copied());
        keys["required"] = json!(required);
        keys
    };
    let cases = [
        (
            &["drop", "duplicate", "reorder"][..],
            with(&["probability"], &[]),
        ),
        (&["flip"], with(&["rate"], &["rate"])),
        (&["delay"], with(&["by"], &["by"])),
        (&["unplug"], with(&["fails"], &[])),
        (&["stuck"], with(&[], &[])),
        (&["babble"], with(&["pause"], &[])),
    ];
    let cases = cases.map(|(names, case)| (names.iter().map(|w| (*w).to_owned()).collect(), case));
    by_value(&mut fault, "kind", None, cases.into_iter());
    fault
}
