//! Building blocks of the schema: objects, lists, quantities, and conditions on the value of a key.
//!
//! Editors complete keys from `properties` and from the references in `anyOf`, and ignore `allOf`.
//! A table therefore lists all of its keys in `properties`; conditions narrow them by `if` and
//! `then`.

use std::ops::RangeInclusive;

use serde_json::{Map, Value, json};
use twinrig_document::{
    Range, any_quantity_pattern, duration_pattern, fitting_units, quantity_name, quantity_pattern,
};
use twinrig_kernel::Unit;

/// Returns a table with these keys and no others.
pub(super) fn object(properties: Value, required: &[&str]) -> Value {
    let mut object = open_object(properties, required);
    object["additionalProperties"] = json!(false);
    object
}

/// Returns a table with these keys; the cases of [`by_value`] define when it has which, and every
/// key is in one of its cases.
pub(super) fn open_object(properties: Value, required: &[&str]) -> Value {
    let mut object = Map::new();
    object.insert("type".to_owned(), json!("object"));
    object.insert("properties".to_owned(), properties);
    if !required.is_empty() {
        object.insert("required".to_owned(), json!(required));
    }
    Value::Object(object)
}

/// Returns the union of `plain`, which is not a table, and `table`. The type distinguishes the two,
/// so that an error refers to the intended one.
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

/// Returns a table with arbitrary keys, each with a value like `one`.
pub(super) fn table_of(one: &Value) -> Value {
    json!({ "type": "object", "additionalProperties": one })
}

pub(super) fn described(about: &str, mut value: Value) -> Value {
    if about.is_empty() {
        return value;
    }
    if value.get("$ref").is_some() {
        // Editors ignore siblings of a reference.
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

pub(super) fn boolean() -> Value {
    json!({ "type": "boolean" })
}

pub(super) fn natural(range: &RangeInclusive<u64>) -> Value {
    json!({ "type": "integer", "minimum": range.start(), "maximum": range.end() })
}

pub(super) fn reference(name: &str) -> Value {
    json!({ "$ref": format!("#/$defs/{name}") })
}

/// Returns a quantity in `unit`; also a bare number if it is dimensionless.
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

/// Returns a quantity of any dimension.
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

/// Returns a duration longer than zero.
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

/// Returns the title of a quantity: `a length (m, cm, mm, um, km)`.
fn title(unit: Unit) -> String {
    match fitting_units(unit) {
        units if units.is_empty() => quantity_name(unit).to_owned(),
        units => format!("{} ({units})", quantity_name(unit)),
    }
}

/// Adds the bounds of bare numbers, which do not apply to texts.
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

/// Adds conditions on the value of the key `key`: the first case that contains the value applies.
/// `default` is the value where the key is missing.
///
/// The cases are nested in `else`, because editors ignore `allOf`.
pub(super) fn by_value(
    table: &mut Value,
    key: &str,
    default: Option<&str>,
    cases: impl DoubleEndedIterator<Item = (Vec<String>, Value)>,
) {
    let mut chain: Option<Value> = None;
    for (values, then) in cases.rev() {
        let mut fits = json!({ "properties": { key: { "enum": values } } });
        if !values.iter().any(|value| Some(value.as_str()) == default) {
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

/// Restricts the keys to these.
pub(super) fn only_keys<'k>(keys: impl IntoIterator<Item = &'k str>) -> Value {
    let keys: Vec<&str> = keys.into_iter().collect();
    json!({ "propertyNames": { "enum": keys } })
}
