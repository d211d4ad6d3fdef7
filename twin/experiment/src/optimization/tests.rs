//! The recorded optimisations of the repository.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use twinrig_campaign::optimization::SearchSpace;
use twinrig_document::Document;
use twinrig_rig::assembly::Assembly;
use twinrig_rig::registry::Registry;
use twinrig_scenario::Scenario;

use super::plan::OptimizationPlan;

/// Columns of a history before those of the dimensions.
const SUMMARY: usize = 6;

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Returns the search spaces of the repository with their scenarios, which the command in the
/// comment of each file names: `twin optimize SCENARIO --space FILE`.
fn spaces() -> Vec<(PathBuf, PathBuf)> {
    let folder = repository().join("scenarios/optimizations");
    let paths = std::fs::read_dir(folder).unwrap();
    let paths = paths.map(|entry| entry.unwrap().path());
    let spaces = paths.filter(|path| path.extension().is_some_and(|it| it == "toml"));
    let pairs = spaces.map(|space| {
        let text = std::fs::read_to_string(&space).unwrap();
        let command = text.split_once("twin optimize ");
        let scenario = command.and_then(|(_, rest)| rest.split_whitespace().next());
        let message = || panic!("{}: no comment with its command", space.display());
        (repository().join(scenario.unwrap_or_else(message)), space)
    });
    pairs.collect()
}

/// Returns the process variables that the scenario sets, by their dotted keys, in SI units.
fn variables(scenario: &Scenario) -> BTreeMap<String, f64> {
    let variables = &scenario.controller.as_ref().unwrap().variables;
    let dotted = |name: &String| format!("controller.{}", name.replace('/', "."));
    let pairs = variables.iter();
    pairs.map(|(name, value)| (dotted(name), *value)).collect()
}

/// Returns keys and values of the best point, the last line of a history.
fn best_point(history: &str) -> Vec<(String, f64)> {
    let mut lines = history.lines();
    let keys = lines.next().unwrap().split(',').skip(SUMMARY);
    let values = lines.last().unwrap().split(',').skip(SUMMARY);
    // The key is followed by its unit.
    let key = |cell: &str| cell.split(' ').next().unwrap().to_owned();
    keys.zip(values)
        .map(|(cell, value)| (key(cell), value.parse().unwrap()))
        .collect()
}

/// Without it, scenarios and their records would drift apart.
#[test]
fn scenarios_of_recorded_searches_have_the_best_settings() {
    let registry = Registry::standard();
    let mut recorded = 0;
    for (scenario, file) in spaces() {
        let space = SearchSpace::read(&Document::read(&file).unwrap()).unwrap();
        let plan = OptimizationPlan::new(&registry, &scenario, space, &[]);
        let plan = plan.unwrap_or_else(|error| panic!("{error}"));
        let Ok(history) = std::fs::read_to_string(file.with_extension("csv")) else {
            continue;
        };
        recorded += 1;
        let best = best_point(&history);
        let keys: Vec<&String> = best.iter().map(|(key, _)| key).collect();
        assert!(keys.iter().copied().eq(&plan.runs.keys), "{keys:?}");
        // The best points of several searches, of which no scenario has the settings.
        if history.starts_with("seed,") {
            continue;
        }
        let assembly = Assembly::builder(&registry).file(&scenario).unwrap();
        let variables = variables(assembly.scenario());
        for (key, value) in best {
            let is = variables[&key];
            // Another unit may round otherwise.
            let near = (is - value).abs() <= 1e-12 * value.abs();
            assert!(near, "{}: {key} is {is}, not {value}", scenario.display());
        }
    }
    assert!(recorded >= 1, "no optimisation is recorded");
}

/// A trot on other grounds, with a change or with other clocks is the same gait.
#[test]
fn scenarios_that_share_a_trot_have_its_settings() {
    let registry = Registry::standard();
    let gait = |name: &str| {
        let path = repository().join(format!("scenarios/{name}.toml"));
        let assembly = Assembly::builder(&registry).file(&path).unwrap();
        variables(assembly.scenario())
    };
    for (trot, other) in [
        ("trot", "step-down"),
        ("trot", "step-change"),
        ("oncilla-trot", "oncilla-clocks"),
    ] {
        assert_eq!(
            gait(trot),
            gait(other),
            "{other} has another gait than {trot}"
        );
    }
}
