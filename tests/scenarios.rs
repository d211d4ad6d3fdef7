//! The scenarios of the repository do what their expectations say.

use std::path::{Path, PathBuf};

use twinrig::{Assembly, Registry};

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
