//! The JSON schema of scenario files, for editors and for whoever writes scenarios by a program.
//!
//! It is built by hand beside the reader, because the reader accepts what no derive could say (quantities, near misses,
//! limits). It never refuses what the reader accepts, and it refuses what the reader refuses as far as a schema can look:
//! not at sums and orders of values, at what only a robot or a model knows, nor at whether a name that one place uses is
//! given at another. Tests hold it to both, with a validator of other people's.

mod expect;
mod kinds;
mod plant;
mod share;
mod words;

use serde_json::{Map, Value, json};
use twinrig_document::Range;
use twinrig_kernel::Unit;

use crate::catalogue::{Catalogue, Kind};
use kinds::{Common, changes, with_kinds};
use plant::{actuator, plant};
use words::{
    any_quantity, boolean, by_word, described, duration, list, natural, number, object, only_keys,
    open_object, positive_duration, quantity, reference, text, texts, time,
};

/// The schema of the scenarios that a build with this catalogue accepts, in JSON Schema's draft 2020-12.
///
/// A kind that the build lacks is a word of the schema all the same, and its keys, where they are not known, are whatever
/// they may be: the scenario is sound, and another build runs it.
pub fn schema(catalogue: &Catalogue) -> Value {
    let mut defs = Map::new();
    let properties = json!({
        "name": described("A line for a person.", text()),
        "robot": described("A robot's name, or the path of its file; a plant that stands alone needs none.", text()),
        "override": described("Values of the robot file to replace, by dotted key.", json!({ "type": "object" })),
        "duration": described("How long to run.", positive_duration()),
        "seed": described("What all random streams spring from.", natural()),
        "plant": plant(&catalogue.plants, &mut defs),
        "actuator": actuator(),
        "controller": controller(&catalogue.controllers, &mut defs),
        "bus": bus(&catalogue.buses, &mut defs),
        "io": object(json!({
            "step": positive_duration(),
            "transfer_time": time(),
        }), &[]),
        "observe": object(json!({ "period": positive_duration() }), &[]),
        "fall": described("When the robot has fallen.", expect::fall()),
        "footsteps": footsteps(),
        "record": object(json!({
            "signals": described("Names of signals; * and ** are wild.", texts()),
            "frames": described("How often poses are written.", quantity(Unit::Hertz, &Range::NOT_NEGATIVE)),
            "bytes": described("Whether the bytes on the wires are written.", boolean()),
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
    between_tables(&mut schema, catalogue, &mut defs);
    schema["$defs"] = Value::Object(defs);
    share::share(&mut schema);
    schema
}

/// What one table has to do with another.
fn between_tables(schema: &mut Value, catalogue: &Catalogue, defs: &mut Map<String, Value>) {
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

/// What holds in a scenario whose controller is of a kind, the first case that fits.
fn of_controller(cases: Vec<(Vec<String>, Value)>) -> Value {
    let mut chain = json!({});
    for (words, then) in cases.into_iter().rev() {
        let kind = json!({ "properties": { "kind": { "enum": words } }, "required": ["kind"] });
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
        not_alone: &[],
    };
    let none = (NONE, only_keys(["kind"]));
    with_kinds(&common, kinds, Some(none), defs)
}

fn bus(kinds: &[Kind], defs: &mut Map<String, Value>) -> Value {
    if kinds.is_empty() {
        return json!(false);
    }
    let mut name = described("What it is called; without it, its kind.", text());
    name["pattern"] = json!("^[^/=]+$");
    let common = Common {
        table: "bus",
        key: "kind",
        properties: json!({ "name": name }),
        required: &[],
        not_alone: &[],
    };
    // One table or a list of them: what is said of a table says nothing of a list, so one schema is both.
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
                "Body weight times this, an impulse.",
                quantity(Unit::Second, &Range::NOT_NEGATIVE),
            ),
        }),
        &[],
    );
    // Both are forces, or neither is; shares are what they are where nothing is said.
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
    let cases = cases.map(|(words, case)| (words.iter().map(|w| (*w).to_owned()).collect(), case));
    by_word(&mut fault, "kind", None, cases.into_iter());
    fault
}
