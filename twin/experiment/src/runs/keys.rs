//! Keys of dimensions, as the scenario has them.

use twinrig_campaign::sweep::overlap;
use twinrig_document::{DocumentError, Placed, Problem, suggestion};
use twinrig_rig::registry::Registry;
use twinrig_robot::Robot;
use twinrig_scenario::{Catalogue, Scenario, Setting, language};

use crate::error::Error;
use crate::runs::plan::RunRequest;

/// Table of the process variables.
const CONTROLLER: &str = "controller";

/// Returns the dotted key of each dimension.
pub(super) fn resolved(
    request: &RunRequest<'_>,
    registry: &Registry,
    scenario: &Scenario,
    robot: Option<&Robot>,
) -> Result<Vec<String>, Error> {
    let catalogue = registry.catalogue(robot);
    let mut problems = Vec::new();
    let mut keys: Vec<String> = Vec::new();
    for given in &request.keys {
        match key_of(given, scenario, &catalogue) {
            Ok(key) => {
                let taken = taken(&key, &given.value, request, scenario).or_else(|| {
                    let other = keys.iter().find(|other| overlap(other, &key))?;
                    Some((
                        format!("`{key}` is set by the dimension `{other}` already"),
                        "one dimension for each key".to_owned(),
                    ))
                });
                problems
                    .extend(taken.map(|(message, help)| Problem::at(&given.place, message, help)));
                keys.push(key);
            }
            Err(problem) => problems.push(problem),
        }
    }
    if problems.is_empty() {
        Ok(keys)
    } else {
        Err(DocumentError { problems }.into())
    }
}

/// Returns the problem of a key that a setting of all runs or of a case has, too.
fn taken(
    key: &str,
    given: &str,
    request: &RunRequest<'_>,
    scenario: &Scenario,
) -> Option<(String, String)> {
    if let Some(case) = request.cases.iter().find_map(|case| case.sets(key)) {
        let message = format!("`{given}` is set by {case}");
        return Some((message, "leave out the dimension or the setting".to_owned()));
    }
    let set = |setting: &&Setting| overlap(&setting.key, key);
    let setting = scenario.settings.iter().find(set)?;
    let by = if request.set.iter().any(|(key, _)| *key == setting.key) {
        "`set`"
    } else {
        setting.origin.as_str()
    };
    Some((
        format!("`{given}` is set for all runs, by {by}"),
        "leave out the dimension or the setting".to_owned(),
    ))
}

/// Returns the dotted key of a key or process variable.
pub(crate) fn key_of(
    given: &Placed<String>,
    scenario: &Scenario,
    catalogue: &Catalogue,
) -> Result<String, Problem> {
    let key = &given.value;
    if key.contains('.') {
        // The reader of the scenario knows whether it exists.
        return Ok(key.clone());
    }
    let root = language().into_iter().next();
    let root = root.map_or_else(Vec::new, |table| table.keys);
    if root.iter().any(|known| known.name == key) {
        return Ok(key.clone());
    }
    let kind = scenario.controller.as_ref().and_then(|spec| {
        let mut kinds = catalogue.controllers.iter();
        kinds.find(|kind| kind.name == spec.kind)
    });
    let variables = kind.map_or(&[][..], |kind| &kind.variables);
    let is_variable = |name: &str| {
        let mut known = variables.iter();
        known.any(|variable| variable.name == name || variable.key() == name)
    };
    if is_variable(key) {
        return Ok(format!("{CONTROLLER}.{}", key.replace('/', ".")));
    }
    let mut known: Vec<&str> = Vec::new();
    for name in variables.iter().map(twinrig_scenario::VariableSpec::key) {
        if !known.contains(&name) {
            known.push(name);
        }
    }
    known.extend(root.iter().map(|key| key.name));
    let message = format!(
        "`{key}` is neither a key nor a process variable of {}",
        scenario.file
    );
    let help = suggestion(key, "process variables and keys without a table", known);
    Err(Problem::at(&given.place, message, help))
}
