//! The planner of steps on complete plants: counts of the hole that is moved over a stride, and
//! commands that depend on the robot's own signals alone.

use serde_json::Value;
use twinrig::{BuildKey, Registry};

const SCENARIOS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios");

/// Runs a command and returns its output for programs.
fn json(words: &[&str]) -> Value {
    let registry = Registry::standard().with_build(BuildKey::of_bytes(b"obstacle"));
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let words = [words, &["--json"]].concat();
    twinrig::run_with(&registry, words, &mut out, &mut err);
    let error = String::from_utf8_lossy(&err).into_owned();
    serde_json::from_slice(&out).unwrap_or_else(|_| panic!("{error}"))
}

/// Runs a sweep of the scenario; returns the held and all runs of each share by its name.
fn sweep(spec: &str) -> Vec<(String, u64, u64)> {
    let name = format!("twinrig-obstacle-{spec}-{}", std::process::id());
    let folder = std::env::temp_dir().join(name);
    let [scenario, file] = [
        format!("{SCENARIOS}/obstacle.toml"),
        format!("{SCENARIOS}/sweeps/{spec}.toml"),
    ];
    let result = json(&["sweep", &scenario, &file, "--out", folder.to_str().unwrap()]);
    std::fs::remove_dir_all(&folder).unwrap();
    let shares = result["shares"].as_array().unwrap().iter();
    let count = |share: &Value, key: &str| share[key].as_u64().unwrap();
    shares
        .map(|share| {
            let name = share["of"].as_str().unwrap().to_owned();
            (name, count(share, "held"), count(share, "runs"))
        })
        .collect()
}

#[test]
fn hole_is_cleared_at_45_of_50_places_and_hit_by_blind_steps_at_20() {
    let planned = sweep("obstacle");
    assert_eq!(planned.len(), 2);
    for (share, held, runs) in planned {
        assert!(held >= 45 && runs == 50, "{share}: {held} of {runs}");
    }
    for (share, held, runs) in sweep("obstacle-blind") {
        assert!(held <= 30 && runs == 50, "{share}: {held} of {runs}");
    }
}

/// Until a foot meets the hole its place has no effect, and the place that the planner is told has.
#[test]
fn hole_that_the_planner_is_not_told_changes_nothing_before_a_foot_is_there() {
    let scenario = format!("{SCENARIOS}/obstacle.toml");
    let fingerprint = |settings: &[&str]| {
        // All feet are in front of the places of the hole.
        let shorter = [
            "run",
            &scenario,
            "--no-record",
            "--set",
            "duration=\"3.2 s\"",
        ];
        let settings = settings.iter().flat_map(|setting| ["--set", *setting]);
        let words: Vec<&str> = shorter.into_iter().chain(settings).collect();
        json(&words)["fingerprint"].as_str().unwrap().to_owned()
    };
    let told = fingerprint(&[]);
    assert_eq!(told, fingerprint(&["plant.ground.at=\"1.65 m\""]));
    assert_eq!(told, fingerprint(&["plant.ground.profile=\"bar\""]));
    let other = "controller.obstacle_distance=\"1.65 m\"";
    assert_ne!(told, fingerprint(&[other]));
}
