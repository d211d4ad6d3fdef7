//! Definitions of quantities that several keys have in common, which keep the schema readable.

use std::collections::BTreeMap;

use serde_json::{Map, Value, json};

/// Moves quantities that occur more than once to `$defs` and replaces them with references.
pub(super) fn share(schema: &mut Value) {
    let mut uses = BTreeMap::new();
    visit(schema, &mut |quantity| {
        *uses.entry(quantity.to_string()).or_insert(0_usize) += 1;
    });
    let mut names: BTreeMap<String, String> = BTreeMap::new();
    let mut defs = Map::new();
    visit(schema, &mut |quantity| {
        let text = quantity.to_string();
        if uses.get(&text).is_none_or(|uses| *uses < 2) {
            return;
        }
        let name = names.entry(text).or_insert_with(|| {
            let name = free_name(quantity, &defs);
            defs.insert(name.clone(), quantity.clone());
            name
        });
        *quantity = json!({ "$ref": format!("#/$defs/{name}") });
    });
    if let Some(existing) = schema.get_mut("$defs").and_then(Value::as_object_mut) {
        existing.extend(defs);
    }
}

/// Returns `length` for the title "a length (m, cm)", or `length.2` if the name is taken.
fn free_name(quantity: &Value, defs: &Map<String, Value>) -> String {
    let title = quantity["title"].as_str().unwrap_or("quantity");
    let title = title.split(" (").next().unwrap_or(title);
    let name = title.trim_start_matches("a ").trim_start_matches("an ");
    let name = name.replace(' ', "_");
    let numbered = (2..).map(|count| format!("{name}.{count}"));
    let mut names = std::iter::once(name.clone()).chain(numbered);
    let free = names.find(|name| !defs.contains_key(name));
    free.unwrap_or(name)
}

/// Calls `found` with every schema that consists of a quantity only.
fn visit(schema: &mut Value, found: &mut impl FnMut(&mut Value)) {
    const OF_QUANTITIES: [&str; 7] = [
        "type",
        "title",
        "pattern",
        "minimum",
        "maximum",
        "exclusiveMinimum",
        "exclusiveMaximum",
    ];
    match schema {
        Value::Object(object) => {
            let only = object
                .keys()
                .all(|key| OF_QUANTITIES.contains(&key.as_str()));
            if only && object.contains_key("title") && object.contains_key("pattern") {
                found(schema);
                return;
            }
            for value in object.values_mut() {
                visit(value, found);
            }
        }
        Value::Array(values) => values.iter_mut().for_each(|value| visit(value, found)),
        _ => {}
    }
}
