//! The vocabulary of the schema: objects, lists, quantities, and what depends on a key.
//!
//! Editors complete keys from `properties` and from what `anyOf` names, and show nothing of `allOf`; so a table lists all of
//! its keys in `properties`, and what a key depends on narrows that down by `if` and `then`.

use serde_json::{Map, Value, json};
use twinrig_document::{
    Range, any_quantity_pattern, duration_pattern, fitting_units, quantity_name, quantity_pattern,
};
use twinrig_kernel::Unit;

/// A table with these keys and no others.
pub(super) fn object(properties: Value, required: &[&str]) -> Value {
    let mut object = open_object(properties, required);
    object["additionalProperties"] = json!(false);
    object
}

/// A table with these keys, of which [`by_word`] says when it has which; every key is in one of its cases.
pub(super) fn open_object(properties: Value, required: &[&str]) -> Value {
    let mut object = Map::new();
    object.insert("type".to_owned(), json!("object"));
    object.insert("properties".to_owned(), properties);
    if !required.is_empty() {
        object.insert("required".to_owned(), json!(required));
    }
    Value::Object(object)
}

/// The same, with exactly one of the keys `one`.
pub(super) fn object_of_one(properties: Value, required: &[&str], one: &[&str]) -> Value {
    let mut object = object(properties, required);
    object["oneOf"] = one.iter().map(|key| json!({ "required": [key] })).collect();
    object
}

/// Either `plain`, which is no table, or `table`. Both are told apart by their type, so that an error is about the one that
/// was meant.
pub(super) fn or_table(mut plain: Value, mut table: Value) -> Value {
    let mut types = match plain["type"].take() {
        Value::Array(types) => types,
        one => vec![one],
    };
    types.push(table["type"].take());
    plain["type"] = json!(types);
    if let (Some(plain), Value::Object(table)) = (plain.as_object_mut(), table) {
        let rest = table.into_iter().filter(|(key, _)| key != "type");
        plain.extend(rest);
    }
    plain
}

/// A table whose keys anybody chooses, each with a value like `one`.
pub(super) fn table_of(one: &Value) -> Value {
    json!({ "type": "object", "additionalProperties": one })
}

pub(super) fn described(about: &str, mut value: Value) -> Value {
    if about.is_empty() {
        return value;
    }
    if value.get("$ref").is_some() {
        // Editors look no further than a reference.
        value = json!({ "anyOf": [value] });
    }
    value["description"] = json!(about);
    value
}

pub(super) fn list(of: &Value) -> Value {
    json!({ "type": "array", "items": of })
}

pub(super) fn text() -> Value {
    json!({ "type": "string" })
}

pub(super) fn texts() -> Value {
    list(&text())
}

pub(super) fn boolean() -> Value {
    json!({ "type": "boolean" })
}

pub(super) fn natural() -> Value {
    json!({ "type": "integer", "minimum": 0, "maximum": u64::MAX })
}

pub(super) fn reference(name: &str) -> Value {
    json!({ "$ref": format!("#/$defs/{name}") })
}

/// A quantity in `unit`, or a bare number where that is what has no unit.
pub(super) fn quantity(unit: Unit, range: &Range) -> Value {
    let mut schema = json!({
        "type": "string",
        "title": title(unit),
        "pattern": quantity_pattern(unit, range),
    });
    if unit == Unit::One {
        schema["type"] = json!(["number", "string"]);
        numeric(&mut schema, range);
    }
    schema
}

pub(super) fn number(range: &Range) -> Value {
    quantity(Unit::One, range)
}

/// A quantity of whatever dimension.
pub(super) fn any_quantity(range: &Range) -> Value {
    let mut schema = json!({
        "type": ["number", "string"],
        "title": "a quantity",
        "pattern": any_quantity_pattern(range),
    });
    numeric(&mut schema, range);
    schema
}

pub(super) fn duration() -> Value {
    timed(false)
}

/// A duration longer than zero.
pub(super) fn positive_duration() -> Value {
    timed(true)
}

fn timed(positive: bool) -> Value {
    json!({
        "type": "string",
        "title": title(Unit::Second),
        "pattern": duration_pattern(positive),
    })
}

/// What an editor shows of a quantity: `a length (m, cm, mm, um, km)`.
fn title(unit: Unit) -> String {
    match fitting_units(unit) {
        units if units.is_empty() => quantity_name(unit).to_owned(),
        units => format!("{} ({units})", quantity_name(unit)),
    }
}

/// Bounds of bare numbers; they say nothing of texts.
fn numeric(schema: &mut Value, range: &Range) {
    use std::ops::Bound::{Excluded, Included, Unbounded};
    let (key, end) = match range.min {
        Included(min) => ("minimum", Some(min)),
        Excluded(min) => ("exclusiveMinimum", Some(min)),
        Unbounded => ("minimum", None),
    };
    if let Some(end) = end {
        schema[key] = json!(end);
    }
    let (key, end) = match range.max {
        Included(max) => ("maximum", Some(max)),
        Excluded(max) => ("exclusiveMaximum", Some(max)),
        Unbounded => ("maximum", None),
    };
    if let Some(end) = end {
        schema[key] = json!(end);
    }
}

/// What holds in addition if the key `key` has one of some words: the first case that fits. `default` is the word that is
/// meant where the key is missing.
///
/// The cases are nested in `else`, because editors do not look into `allOf`.
pub(super) fn by_word(
    table: &mut Value,
    key: &str,
    default: Option<&str>,
    cases: impl DoubleEndedIterator<Item = (Vec<String>, Value)>,
) {
    let mut chain: Option<Value> = None;
    for (words, then) in cases.rev() {
        let mut fits = json!({ "properties": { key: { "enum": words } } });
        if !words.iter().any(|word| Some(word.as_str()) == default) {
            fits["required"] = json!([key]);
        }
        let mut case = json!({ "if": fits, "then": then });
        if let Some(rest) = chain.take() {
            case["else"] = rest;
        }
        chain = Some(case);
    }
    if let (Some(Value::Object(chain)), Some(table)) = (chain, table.as_object_mut()) {
        table.extend(chain);
    }
}

/// No other keys than these.
pub(super) fn only_keys<'k>(keys: impl IntoIterator<Item = &'k str>) -> Value {
    let keys: Vec<&str> = keys.into_iter().collect();
    json!({ "propertyNames": { "enum": keys } })
}

/// How long something takes: a duration, a distribution, or a trace.
pub(super) fn time() -> Value {
    let mut table = object(
        json!({
            "min": duration(),
            "max": duration(),
            "mean": duration(),
            "deviation": duration(),
            "trace": list(&duration()),
        }),
        &[],
    );
    table["properties"]["trace"]["minItems"] = json!(1);
    table["anyOf"] = json!([
        { "required": ["trace"], "maxProperties": 1 },
        { "required": ["min", "max"], "properties": { "trace": false } },
    ]);
    table["dependentRequired"] = json!({ "mean": ["deviation"], "deviation": ["mean"] });
    or_table(duration(), table)
}
