//! Rows as comma-separated values.

use serde::Serialize;
use serde_json::Value;

/// Returns rows of any kind, with texts, numbers or lists as values, as CSV (RFC 4180), with the
/// JSON keys as header and empty cells for values that do not apply; `settings` are inserted after
/// the column `after`.
pub(crate) fn table(rows: &[impl Serialize], after: &str, settings: &[&str]) -> String {
    let rows: Vec<Value> = rows
        .iter()
        .filter_map(|row| serde_json::to_value(row).ok())
        .collect();
    let mut keys: Vec<&str> = Vec::new();
    for row in &rows {
        for key in row.as_object().into_iter().flat_map(|row| row.keys()) {
            if !keys.contains(&key.as_str()) {
                keys.push(key);
            }
        }
    }
    keys.retain(|key| !settings.contains(key));
    let place = keys.iter().position(|key| *key == after);
    let place = place.map_or(0, |place| place + 1);
    keys.splice(place..place, settings.iter().copied());
    let mut text = keys.join(",") + "\n";
    for row in &rows {
        let cells: Vec<String> = keys
            .iter()
            .map(|key| cell(row.get(*key).unwrap_or(&Value::Null)))
            .collect();
        text += &cells.join(",");
        text.push('\n');
    }
    text
}

fn cell(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) if text.contains([',', '"', '\n', '\r']) => {
            format!("\"{}\"", text.replace('"', "\"\""))
        }
        Value::String(text) => text.clone(),
        Value::Array(_) => cell(&Value::String(value.to_string())),
        other => other.to_string(),
    }
}
