//! The schema of tables of parts with kinds: the keys of each kind, and their values.

use std::collections::BTreeSet;

use serde_json::{Map, Value, json};

use super::builders::{by_value, object, only_keys, open_object, or_table, quantity, reference};
use crate::catalogue::{Kind, VariableSpec};

/// Properties that all kinds of a part have in common.
pub(super) struct Common<'a> {
    /// Name of the table, for definitions.
    pub table: &'a str,
    /// Key that names the kind.
    pub key: &'a str,
    /// Keys of all kinds.
    pub properties: Value,
    /// Keys that every kind requires.
    pub required: &'a [&'a str],
    /// Keys that a standalone kind does not have.
    pub not_standalone: &'a [&'a str],
}

/// Returns the table of a part with kinds.
///
/// One key may have different meanings in several kinds, and none in others. `properties` therefore
/// lists all keys: with their values where these are equal in all kinds, else with the union of the
/// values, for editors. The case of a kind has the exact values. `more` is an additional case, for
/// a value that is not a kind of the build. `all` has the keys that each kind declares, with the
/// schemas of their values.
pub(super) fn with_kinds(
    common: &Common<'_>,
    kinds: &[Kind],
    all: &[Vec<(String, Value)>],
    more: Option<(&str, Value)>,
    defs: &mut Map<String, Value>,
) -> Value {
    let mut properties = common.properties.clone();
    let names = kinds.iter().map(|kind| kind.name.as_str());
    let names: Vec<&str> = names.chain(more.iter().map(|(name, _)| *name)).collect();
    properties[common.key] = json!({ "enum": names });
    // The keys of a kind that is not in this build may be unknown.
    let open = kinds.iter().any(is_open);
    let mut names: Vec<&str> = Vec::new();
    for (name, _) in all.iter().flatten() {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    // Keys with one meaning in all kinds that have them are defined once.
    let mut shared_keys = BTreeSet::new();
    for name in names {
        let mut schemas: Vec<&Value> = Vec::new();
        for (_, schema) in all.iter().flatten().filter(|(key, _)| key == name) {
            if !schemas.contains(&schema) {
                schemas.push(schema);
            }
        }
        properties[name] = match schemas[..] {
            [schema] if !open => {
                shared_keys.insert(name);
                schema.clone()
            }
            _ => {
                let cases = kinds.iter().zip(all);
                let cases = cases.filter(|(_, keys)| keys.iter().any(|(key, _)| key == name));
                let cases = cases.map(|(kind, _)| reference(&definition(common, kind, name)));
                json!({ "anyOf": cases.chain([json!({})]).collect::<Vec<_>>() })
            }
        };
    }
    let mut cases = Vec::new();
    for (kind, keys) in kinds.iter().zip(all) {
        let mut narrowed = Map::new();
        for (name, schema) in keys
            .iter()
            .filter(|(name, _)| !shared_keys.contains(name.as_str()))
        {
            let definition = definition(common, kind, name);
            narrowed.insert(name.clone(), reference(&definition));
            defs.insert(definition, schema.clone());
        }
        cases.push((vec![kind.name.clone()], case(common, kind, keys, narrowed)));
    }
    cases.extend(more.map(|(name, case)| (vec![name.to_owned()], case)));
    let mut table = open_object(properties, &[common.key]);
    by_value(&mut table, common.key, None, cases.into_iter());
    table
}

fn definition(common: &Common<'_>, kind: &Kind, name: &str) -> String {
    // TOML keys may contain characters that JSON pointers and URIs do not allow.
    let plain = |name: &str| name.replace(|c: char| !c.is_ascii_alphanumeric() && c != '_', "-");
    format!("{}.{}.{}", common.table, plain(&kind.name), plain(name))
}

fn is_open(kind: &Kind) -> bool {
    kind.remedy.is_some() && kind.options.is_empty()
}

/// Returns the case of a kind.
fn case(
    common: &Common<'_>,
    kind: &Kind,
    keys: &[(String, Value)],
    narrowed: Map<String, Value>,
) -> Value {
    let mut case = Map::new();
    if !is_open(kind) {
        let shared = common.properties.as_object();
        let shared = shared.into_iter().flat_map(Map::keys).map(String::as_str);
        let shared =
            shared.filter(|key| kind.has_robot_keys() || !common.not_standalone.contains(key));
        let declared = keys.iter().map(|(name, _)| name.as_str());
        if let Value::Object(only) =
            only_keys([common.key].into_iter().chain(shared).chain(declared))
        {
            case.extend(only);
        }
    }
    if !common.required.is_empty() {
        case.insert("required".to_owned(), json!(common.required));
    }
    if !narrowed.is_empty() {
        case.insert("properties".to_owned(), Value::Object(narrowed));
    }
    Value::Object(case)
}

/// Returns the schema of a variable: one value, or one for each of its groups. The names of groups
/// that are legs depend on the robot.
pub(super) fn of_variable(kind: &Kind, variable: &VariableSpec) -> Value {
    let of = |variable: &VariableSpec| quantity(variable.unit, &variable.range);
    let variables = kind.variables_of(variable.key());
    let grouped = variables.iter().filter_map(|one| Some((one.group()?, one)));
    let groups: Map<String, Value> = grouped
        .map(|(group, one)| (group.to_owned(), of(one)))
        .collect();
    if groups.is_empty() {
        return of(variable);
    }
    let mut table = object(Value::Object(groups), &[]);
    if variables.iter().any(|one| one.of_leg) {
        table["additionalProperties"] = of(variable);
    }
    or_table(of(variable), table)
}

/// Returns the variables of a controller that a `[[change]]` can set, with their units.
pub(super) fn changes(kind: &Kind) -> Value {
    let mut by_unit: Vec<(twinrig_kernel::Unit, Vec<String>)> = Vec::new();
    let mut legs: Vec<&str> = Vec::new();
    for variable in &kind.variables {
        let at = by_unit.iter().position(|(unit, _)| *unit == variable.unit);
        let at = at.unwrap_or_else(|| {
            by_unit.push((variable.unit, Vec::new()));
            by_unit.len() - 1
        });
        for name in [variable.key(), variable.name.as_str()] {
            if !by_unit[at].1.iter().any(|known| known == name) {
                by_unit[at].1.push(name.to_owned());
            }
        }
        if variable.of_leg && !legs.contains(&variable.key()) {
            legs.push(variable.key());
        }
    }
    let names = by_unit.iter().flat_map(|(_, names)| names);
    let mut set = json!({ "enum": names.collect::<Vec<_>>() });
    if !legs.is_empty() {
        let pattern = format!("^(?:{})/[^/]+$", legs.join("|"));
        set = json!({ "anyOf": [set, { "type": "string", "pattern": pattern }] });
    }
    let mut change = json!({ "properties": { "set": set } });
    let cases = by_unit.into_iter().map(|(unit, names)| {
        let amount = quantity(unit, &twinrig_document::Range::ANY);
        let amounts = json!({ "properties": { "to": amount, "by": amount } });
        (names, amounts)
    });
    by_value(&mut change, "set", None, cases);
    change
}
