//! `twin thesis`: printed figures beside ours.

use crate::common::{Done, twin};

const SCENARIOS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios");

fn thesis(words: &[&str]) -> Done {
    twin(&[&["thesis", "--scenarios", SCENARIOS], words].concat())
}

#[test]
fn item_shows_the_printed_figure_beside_ours_with_the_ground_of_the_verdict() {
    let done = thesis(&["fig-2-9"]);
    assert_eq!((done.code, done.err.as_str()), (0, ""), "{}", done.out);
    for expected in [
        "253.27 N/m",
        "251.48 N/m",
        "consistent",
        "within 1 %",
        "fitted: geometry of the leg",
        "not printed",
    ] {
        assert!(done.out.contains(expected), "no {expected} in {}", done.out);
    }
}

/// A verdict follows from the physics: half of the stiffness is another leg.
#[test]
fn other_spring_contradicts_the_stiffness_of_the_leg() {
    let soft = "override.leg.aslp.diagonal.stiffness=\"2200 N/m\"";
    let done = thesis(&["fig-2-9", "--set", soft]);
    assert_eq!((done.code, done.err.as_str()), (1, ""), "{}", done.out);
    assert!(done.out.contains(" contradicted"), "{}", done.out);
}

#[test]
fn setting_without_a_scenario_is_an_error() {
    let done = thesis(&["table-4-5", "--set", "seed=2"]);
    assert_eq!((done.code, done.out.as_str()), (2, ""));
    assert!(done.err.contains("runs no scenario"), "{}", done.err);
}

#[test]
fn json_has_values_and_verdicts() {
    let done = thesis(&["table-4-4", "--json"]);
    assert_eq!((done.code, done.err.as_str()), (0, ""), "{}", done.out);
    let result: serde_json::Value = serde_json::from_str(&done.out).unwrap();
    let figure = &result["items"][0]["figures"][0];
    assert_eq!(figure["printed_value"], 16.0);
    assert_eq!(figure["ours"]["value"], 16.0);
    assert_eq!(figure["verdict"], "recomputed");
    assert_eq!(figure["inputs"][0], "set: printed numbers");
}

/// A number that the verdict rests on is found without being listed anywhere.
#[test]
fn verdict_flips_with_the_spring_from_which_it_follows() {
    let done = thesis(&["fig-2-9", "--flips", "--json"]);
    assert_eq!((done.code, done.err.as_str()), (0, ""), "{}", done.out);
    let result: serde_json::Value = serde_json::from_str(&done.out).unwrap();
    let figures = result["items"][0]["figures"].as_array().unwrap();
    let closed = figures
        .iter()
        .find(|figure| figure["key"] == "closed")
        .unwrap();
    let keys = closed["by"]
        .as_array()
        .unwrap()
        .iter()
        .map(|flip| &flip["key"]);
    let keys: Vec<_> = keys.collect();
    assert!(
        keys.iter().any(|key| *key == "leg.aslp.diagonal.stiffness"),
        "{keys:?}"
    );
    // The mass of the trunk is read, and has no influence.
    assert!(keys.iter().all(|key| *key != "trunk.mass"), "{keys:?}");
}

#[test]
fn unknown_item_is_an_error_with_a_similar_name() {
    let done = thesis(&["table-4-6"]);
    assert_eq!((done.code, done.out.as_str()), (2, ""));
    assert!(done.err.contains("did you mean `table-4-"), "{}", done.err);
    let done = thesis(&["chapter"]);
    assert_eq!(done.code, 2);
    assert!(done.err.contains("`twin thesis --list`"), "{}", done.err);
}

#[test]
fn missing_scenarios_are_an_error_with_a_remedy() {
    let done = twin(&["thesis", "fig-2-9", "--scenarios", "nowhere"]);
    assert_eq!((done.code, done.out.as_str()), (2, ""));
    assert!(done.err.contains("`--scenarios DIR`"), "{}", done.err);
}

#[test]
fn list_has_every_item_once() {
    let done = thesis(&["--list"]);
    assert_eq!((done.code, done.err.as_str()), (0, ""));
    for id in ["fig-2-9", "step-down", "table-5-4", "fig-4-9"] {
        let lines = done
            .out
            .lines()
            .filter(|line| line.starts_with(&format!("{id} ")));
        assert_eq!(lines.count(), 1, "{id} in {}", done.out);
    }
}
