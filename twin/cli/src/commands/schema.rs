//! Command `twin schema`: JSON schema of scenarios.

use std::path::Path;

use serde_json::Value;
use twinrig_robot::{Robot, RobotFile};

use super::{FAILURE, SUCCESS, Terminal};
use crate::args::SchemaArgs;
use crate::error::TwinError;
use twinrig_rig::registry::Registry;

pub(super) fn schema(registry: &Registry, args: &SchemaArgs, terminal: &mut Terminal<'_>) -> u8 {
    let robots = match robots(args, terminal) {
        Ok(robots) => robots,
        Err(error) => {
            terminal.print_error(&error);
            return FAILURE;
        }
    };
    terminal.print(&text(registry, &robots));
    SUCCESS
}

/// Returns the schema file of a build, with the process variables for the given robots.
pub(super) fn text(registry: &Registry, robots: &[Robot]) -> String {
    let mut text = String::new();
    write(&registry.schema(robots), "", &mut text);
    text.push('\n');
    text
}

/// Maximum line width, if a line can be broken.
const WIDTH: usize = 120;

/// Writes `value` as JSON: in one line if it fits, otherwise with one item per line.
fn write(value: &Value, indent: &str, text: &mut String) {
    let line = value.to_string();
    let room = WIDTH.saturating_sub(indent.len());
    let deeper = format!("{indent}  ");
    let mut items = |open: char, close: char, items: &mut dyn Iterator<Item = (String, &Value)>| {
        text.push(open);
        for (n, (key, item)) in items.enumerate() {
            text.push_str(if n == 0 { "\n" } else { ",\n" });
            text.extend([deeper.as_str(), key.as_str()]);
            write(item, &deeper, text);
        }
        text.extend(["\n", indent]);
        text.push(close);
    };
    match value {
        Value::Array(values) if line.len() > room => {
            let values = values.iter().map(|value| (String::new(), value));
            items('[', ']', &mut values.into_iter());
        }
        Value::Object(entries) if line.len() > room => {
            let keyed = |(key, value)| (format!("{}: ", Value::String(key)), value);
            let mut entries = entries
                .iter()
                .map(|(key, value)| keyed((key.clone(), value)));
            items('{', '}', &mut entries);
        }
        _ => text.push_str(&line),
    }
}

/// Returns the robots given on the command line, or else all valid robots found.
fn robots(args: &SchemaArgs, terminal: &mut Terminal<'_>) -> Result<Vec<Robot>, TwinError> {
    let folder = Path::new("");
    let read = |name: &str| RobotFile::find(name, folder).and_then(|file| file.robot());
    if !args.robot.is_empty() {
        let robots = args.robot.iter().map(|name| Ok(read(name)?));
        return robots.collect();
    }
    let mut robots = Vec::new();
    for name in RobotFile::names(folder) {
        match read(&name) {
            Ok(robot) => robots.push(robot),
            Err(error) => {
                let error = TwinError::from(error);
                terminal.note(&format!(
                    "the schema does not include the robot `{name}`:\n{error}"
                ));
            }
        }
    }
    Ok(robots)
}
