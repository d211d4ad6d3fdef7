//! Tables to which a key belongs that another table does not know.

use twinrig_document::DocumentError;

use super::root::root_table;
use crate::catalogue::{Catalogue, Kind, VariableSpec};
use crate::language::{KeySpec, TableSpec};

/// Tables that a message names.
const NAMED_MOST: usize = 3;
/// Tables of robot files that scenarios do not have.
const OF_ROBOT: [&str; 2] = ["trunk", "leg"];
/// Tables with a key that nearly every table has: none of them explains the mistake.
const COMMON_LEAST: usize = 7;

/// Adds to the help of unknown keys the tables that have a key of that name.
pub(super) fn with_other_tables(mut error: DocumentError, catalogue: &Catalogue) -> DocumentError {
    for problem in &mut error.problems {
        let Some(path) = &problem.unknown_key else {
            continue;
        };
        let (table, key) = path.rsplit_once('.').unwrap_or(("", path));
        if table.is_empty() && OF_ROBOT.contains(&key) {
            let over = root_table::OVERRIDE.name;
            problem.help = format!("`{key}` is of the robot: write `{over}.{key}`");
            continue;
        }
        let mut owners = owners(table, key, catalogue);
        if owners.is_empty() || owners.len() >= COMMON_LEAST {
            continue;
        }
        if owners.len() > NAMED_MOST {
            owners.truncate(NAMED_MOST);
            owners.push("another table".to_owned());
        }
        let belongs = format!("`{key}` belongs to {}", owners.join(" or "));
        // Keys that are known here do not matter for one that is known elsewhere.
        problem.help = if problem.help.starts_with("did you mean") {
            format!("{} {belongs}", problem.help)
        } else {
            belongs
        };
    }
    error
}

/// Returns the tables with a key of that name: others than `table`, and this one where another of
/// its keys decides.
fn owners(table: &str, key: &str, catalogue: &Catalogue) -> Vec<String> {
    let here = table.rsplit('.').next().unwrap_or_default();
    let mut tables = vec![root_table::TABLE];
    let mut owners = Vec::new();
    let mut next = 0;
    while let Some(&table) = tables.get(next) {
        next += 1;
        let keys = table.all_keys();
        if let Some(known) = keys.iter().find(|known| known.name == key) {
            owners.extend(owner(table, known, here));
        }
        for inner in keys.iter().flat_map(|key| key.shape.tables()) {
            // By name: a table in a constant has no one address.
            if tables.iter().all(|known| known.name != inner.name) {
                tables.push(inner);
            }
        }
    }
    owners.extend(of_kinds("[plant]", &catalogue.plants, key));
    owners.extend(of_kinds("[controller]", &catalogue.controllers, key));
    owners.extend(of_kinds("[bus]", &catalogue.buses, key));
    owners
}

/// Names a table with that key; none for the table `here`, unless the value of another key decides.
fn owner(table: &TableSpec, key: &KeySpec, here: &str) -> Option<String> {
    let bare = table.name.trim_matches(['[', ']']);
    match table.selector.filter(|_| !key.only_with.is_empty()) {
        Some(selector) => Some(format!(
            "`{}` with `{selector}` {}",
            table.name,
            key.only_with.join(", ")
        )),
        None if bare == here => None,
        None if table.name == root_table::TABLE.name && here.is_empty() => None,
        None if table.name == root_table::TABLE.name => {
            Some("the top level, above the first table".to_owned())
        }
        None => Some(format!("`{}`", table.name)),
    }
}

/// Names the kinds of a part that have an option or a variable of that name.
fn of_kinds(table: &str, kinds: &[Kind], key: &str) -> Option<String> {
    let has = |kind: &&Kind| {
        let mut variables = kind.variables.iter().map(VariableSpec::key);
        kind.options.iter().any(|option| option.name == key) || variables.any(|name| name == key)
    };
    let names: Vec<&str> = kinds
        .iter()
        .filter(has)
        .map(|kind| kind.name.as_str())
        .collect();
    match names[..] {
        [] => None,
        _ if names.len() > NAMED_MOST => Some(format!("`{table}`")),
        _ => Some(format!("`{table}` of {}", names.join(", "))),
    }
}
