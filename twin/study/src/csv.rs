//! Rows as comma-separated values.

use serde_json::Value;

use crate::row::Row;

/// The rows as CSV (RFC 4180), with the keys of the JSON as its first line; what does not apply is empty.
pub fn csv(rows: &[Row]) -> String {
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
    // The two that are left out where they do not apply stand together.
    keys.retain(|&key| key != "step_s" && key != "tolerance");
    let place = keys.len().min(2);
    keys.splice(place..place, ["step_s", "tolerance"]);
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
        other => other.to_string(),
    }
}
