//! The schema of tables of parts that come in kinds: which keys a kind has, and which values each of them takes.

use std::collections::BTreeSet;

use serde_json::{Map, Value, json};

use super::words::{
    boolean, by_word, described, duration, natural, object, only_keys, open_object, or_table,
    quantity, reference, table_of, text, time,
};
use crate::catalogue::{Accepts, Kind, VariableSpec};

/// What all kinds of a part have in common.
pub(super) struct Common<'a> {
    /// The name of the table, for definitions.
    pub table: &'a str,
    /// The key that names the kind.
    pub key: &'a str,
    /// Keys that all kinds have.
    pub properties: Value,
    /// Those of them that every kind must be given.
    pub required: &'a [&'a str],
    /// Those of them that a kind that stands alone does not have.
    pub not_alone: &'a [&'a str],
}

/// The table of a part that comes in kinds.
///
/// One key may mean one thing in one kind and another in another, or nothing at all. So `properties` has all keys; with what
/// they take where that is the same in all kinds, and else with what they may take, for editors to show. What holds for one
/// kind is in its case. `more` is a case of its own, for a word that is no kind of the build.
pub(super) fn with_kinds(
    common: &Common<'_>,
    kinds: &[Kind],
    more: Option<(&str, Value)>,
    defs: &mut Map<String, Value>,
) -> Value {
    let mut properties = common.properties.clone();
    let names = kinds.iter().map(|kind| kind.name.as_str());
    let names: Vec<&str> = names.chain(more.iter().map(|(word, _)| *word)).collect();
    properties[common.key] = json!({ "enum": names });
    // A kind that this build does not have may have keys that it does not know of.
    let open = kinds.iter().any(is_open);
    let all: Vec<Vec<(String, Value)>> = kinds.iter().map(keys).collect();
    let mut words: Vec<&str> = Vec::new();
    for (word, _) in all.iter().flatten() {
        if !words.contains(&word.as_str()) {
            words.push(word);
        }
    }
    // What has one meaning in all kinds that have it is told once.
    let mut told = BTreeSet::new();
    for word in words {
        let mut meanings: Vec<&Value> = Vec::new();
        for (_, meaning) in all.iter().flatten().filter(|(key, _)| key == word) {
            if !meanings.contains(&meaning) {
                meanings.push(meaning);
            }
        }
        properties[word] = match meanings[..] {
            [meaning] if !open => {
                told.insert(word);
                meaning.clone()
            }
            _ => {
                let named = kinds.iter().zip(&all);
                let named = named.filter(|(_, keys)| keys.iter().any(|(key, _)| key == word));
                let named = named.map(|(kind, _)| reference(&definition(common, kind, word)));
                json!({ "anyOf": named.chain([json!({})]).collect::<Vec<_>>() })
            }
        };
    }
    let mut cases = Vec::new();
    for (kind, keys) in kinds.iter().zip(&all) {
        let mut narrowed = Map::new();
        for (word, meaning) in keys
            .iter()
            .filter(|(word, _)| !told.contains(word.as_str()))
        {
            let definition = definition(common, kind, word);
            narrowed.insert(word.clone(), reference(&definition));
            defs.insert(definition, meaning.clone());
        }
        cases.push((vec![kind.name.clone()], case(common, kind, keys, narrowed)));
    }
    cases.extend(more.map(|(word, case)| (vec![word.to_owned()], case)));
    let mut table = open_object(properties, &[common.key]);
    by_word(&mut table, common.key, None, cases.into_iter());
    table
}

fn definition(common: &Common<'_>, kind: &Kind, word: &str) -> String {
    // Both are words of TOML keys, which may hold what a JSON pointer or an URI cannot.
    let plain = |word: &str| word.replace(|c: char| !c.is_ascii_alphanumeric() && c != '_', "-");
    format!("{}.{}.{}", common.table, plain(&kind.name), plain(word))
}

fn is_open(kind: &Kind) -> bool {
    kind.missing_feature.is_some() && kind.options.is_empty()
}

/// What holds where the part is of this kind.
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
        let shared = shared.filter(|key| !(kind.is_standalone && common.not_alone.contains(key)));
        let own = keys.iter().map(|(word, _)| word.as_str());
        if let Value::Object(only) = only_keys([common.key].into_iter().chain(shared).chain(own)) {
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

/// The keys that a kind declares, and what each takes.
fn keys(kind: &Kind) -> Vec<(String, Value)> {
    let mut keys: Vec<(String, Value)> = Vec::new();
    for option in &kind.options {
        let schema = described(&option.about, accepted(&option.accepts));
        keys.push((option.name.clone(), schema));
    }
    for variable in &kind.variables {
        if !keys.iter().any(|(key, _)| key == variable.key()) {
            let schema = described(&variable.about, of_variable(kind, variable));
            keys.push((variable.key().to_owned(), schema));
        }
    }
    keys
}

fn accepted(accepts: &Accepts) -> Value {
    match accepts {
        Accepts::Quantity { unit, range } => quantity(*unit, range),
        Accepts::Duration => duration(),
        Accepts::Natural(range) => {
            let mut schema = natural();
            schema["minimum"] = json!(range.start());
            schema["maximum"] = json!(range.end());
            schema
        }
        Accepts::Boolean => boolean(),
        Accepts::Text | Accepts::Name => text(),
        Accepts::Choice(words) => json!({ "enum": words }),
        Accepts::Time => time(),
        Accepts::Group(options) => {
            let keys = options.iter().map(|option| {
                let schema = described(&option.about, accepted(&option.accepts));
                (option.name.clone(), schema)
            });
            object(Value::Object(keys.collect()), &[])
        }
        Accepts::Table(one) => table_of(&accepted(one)),
        Accepts::Each(one) => {
            let one = accepted(one);
            json!({ "anyOf": [one, table_of(&one)] })
        }
    }
}

/// The value of a variable, or of each of its groups. Groups that are legs have the names that the scenario's robot gives
/// them.
fn of_variable(kind: &Kind, variable: &VariableSpec) -> Value {
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

/// What a `[[change]]` may set of a controller, and in which unit.
pub(super) fn changes(kind: &Kind) -> Value {
    let mut by_unit: Vec<(twinrig_kernel::Unit, Vec<String>)> = Vec::new();
    let mut legs: Vec<&str> = Vec::new();
    for variable in &kind.variables {
        let at = by_unit.iter().position(|(unit, _)| *unit == variable.unit);
        let at = at.unwrap_or_else(|| {
            by_unit.push((variable.unit, Vec::new()));
            by_unit.len() - 1
        });
        for word in [variable.key(), variable.name.as_str()] {
            if !by_unit[at].1.iter().any(|known| known == word) {
                by_unit[at].1.push(word.to_owned());
            }
        }
        if variable.of_leg && !legs.contains(&variable.key()) {
            legs.push(variable.key());
        }
    }
    let words = by_unit.iter().flat_map(|(_, words)| words);
    let mut set = json!({ "enum": words.collect::<Vec<_>>() });
    if !legs.is_empty() {
        let pattern = format!("^(?:{})/[^/]+$", legs.join("|"));
        set = json!({ "anyOf": [set, { "type": "string", "pattern": pattern }] });
    }
    let mut change = json!({ "properties": { "set": set } });
    let cases = by_unit.into_iter().map(|(unit, words)| {
        let amount = quantity(unit, &twinrig_document::Range::ANY);
        let amounts = json!({ "properties": { "to": amount, "by": amount } });
        (words, amounts)
    });
    by_word(&mut change, "set", None, cases);
    change
}
