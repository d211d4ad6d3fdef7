//! The scenarios of the repository do what their expectations say.

use std::path::{Path, PathBuf};

use twinrig::scenario::Setting;
use twinrig::{Assembly, Execution, Registry, execute};

fn scenarios() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios");
    let entries = std::fs::read_dir(&folder).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| {
        path.extension()
            .is_some_and(|extension| extension == "toml")
    });
    paths.sort();
    paths
}

#[test]
fn every_scenario_is_sound_and_expects_something() {
    let registry = Registry::standard();
    assert!(scenarios().len() >= 8);
    for path in scenarios() {
        let assembly =
            Assembly::of_file(&registry, &path, &[]).unwrap_or_else(|error| panic!("{error}"));
        assembly.rig().unwrap_or_else(|error| panic!("{error}"));
        assert!(
            assembly.scenario().expectations.len() >= 3,
            "{}",
            path.display()
        );
    }
}

/// The thesis reports more than 80 % of success.
#[test]
fn a_blind_step_down_succeeds_in_eight_of_ten_phases_of_the_stride() {
    const STRIDE_M: f64 = 0.951 / 3.64;
    let registry = Registry::standard();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/step-down.toml");
    let set = |key: &str, value: String| Setting {
        origin: "the test".to_owned(),
        key: key.to_owned(),
        value,
    };
    let mut phases_stood = Vec::new();
    for phase in 0..10 {
        let edge_m = 2.5 + STRIDE_M * f64::from(phase) / 10.0;
        let settings = [
            set("duration", "\"7 s\"".to_owned()),
            set("plant.ground.at", format!("\"{edge_m} m\"")),
        ];
        let assembly = Assembly::of_file(&registry, &path, &settings)
            .unwrap_or_else(|error| panic!("{error}"));
        let report =
            execute(&assembly, &Execution::default()).unwrap_or_else(|error| panic!("{error}"));
        let outcomes = || report.expectations.iter().map(|line| &line.0);
        let stood = outcomes().find(|outcome| outcome.name == "does not fall");
        if stood.is_some_and(twinrig::scenario::Outcome::holds) {
            phases_stood.push(phase);
        }
    }
    assert!(phases_stood.len() >= 8, "{phases_stood:?}");
}
