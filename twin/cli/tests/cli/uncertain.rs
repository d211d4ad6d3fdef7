//! Verdicts over the distribution of a fit.

use std::fs;

use crate::common::{Folder, json, twin};

/// A servo without a torque, whose supply has the voltage of the file: normal around 7.5 V with a
/// standard deviation of 0.1 V.
const FIT: &str = r#"
[fit]
name = "supply"

[[fit.parameter]]
key = "override.supply.voltage"
from = "7 V"
to = "8 V"
share = 0.5

[[fit.direction]]
vector = [1.0]
deviation = 0.1

[values]
supply.voltage = "7.5 V"
"#;

fn scenario(limit: &str) -> String {
    format!(
        r#"
duration = "20 ms"
plant = {{ model = "servo", file = "xl330" }}

[[expect]]
name = "supply"
signal = {{ name = "servo/supply", always = {{ max = "{limit}" }} }}
"#
    )
}

/// The share of the draws in which a supply stays below a limit is the normal distribution: 0.5 at
/// its mean, 0.841 a standard deviation above. An interval of 95 % misses one in twenty.
#[test]
fn verdict_has_the_probability_of_the_distribution() {
    let folder = Folder::new("uncertain");
    let (path, fit) = (folder.join("supply.toml"), folder.join("supply.fit.toml"));
    fs::write(&fit, FIT).unwrap();
    for (limit, probability) in [("7.5 V", 0.5), ("7.6 V", 0.8413), ("7.9 V", 1.0)] {
        fs::write(&path, scenario(limit)).unwrap();
        let run = || {
            let done = twin(&["run", &path, "--uncertain", &fit, "--no-record", "--json"]);
            (json(&done.out).remove(0), done.code)
        };
        let (report, code) = run();
        let ensemble = &report["expectations"][0]["ensemble"];
        assert_eq!(ensemble["runs"], 200);
        assert_eq!(ensemble["differ_by"], "parameters");
        let end = |end: &str| ensemble["interval"][end].as_f64().unwrap();
        assert!(
            (end("low")..=end("high")).contains(&probability),
            "{limit} {ensemble}"
        );
        // The scenario requires 95 %.
        assert_eq!(code == 0, probability > 0.9);
        assert_eq!(run().0["expectations"], report["expectations"]);
    }
    let done = twin(&["run", &path, "--uncertain", &fit, "--no-record"]);
    let share = "holds in 200 of 200 runs (95 %: 98.1 % … 100.0 %)";
    assert!(done.out.contains(share), "{}", done.out);
    assert!(
        done.out
            .contains("200 more runs with other values of the fit")
    );
}

#[test]
fn overlay_without_a_distribution_or_with_a_key_of_the_scenario_is_an_error() {
    let folder = Folder::new("uncertain-errors");
    let (path, fit) = (folder.join("supply.toml"), folder.join("supply.fit.toml"));
    fs::write(&path, scenario("8 V")).unwrap();
    let message = |text: &str| {
        fs::write(&fit, text).unwrap();
        let done = twin(&["run", &path, "--uncertain", &fit, "--no-record"]);
        assert_eq!(done.code, 2);
        done.err + &done.out
    };
    let gone = message(&FIT.replace("[[fit.direction]]", "[[fit.other]]"));
    assert!(gone.contains("supply.fit.toml"), "{gone}");
    let foreign = message(&FIT.replace("override.supply.voltage", "controller.period"));
    assert!(foreign.contains("is a key of the scenario"), "{foreign}");
    let unknown = message(&FIT.replace("supply.voltage\"", "supply.volts\""));
    assert!(unknown.contains("volts"), "{unknown}");
    fs::remove_file(&fit).unwrap();
    let done = twin(&["run", &path, "--uncertain", &fit, "--no-record"]);
    assert!(done.code == 2 && done.err.contains("supply.fit.toml"));
    let done = twin(&["check", &path, "--set", "ensemble={runs=9, vary='fit'}"]);
    assert!(done.code == 2 && done.err.contains("there is no `fit`"));
    // Before the first run.
    let gone = "ensemble={runs=9, fit='gone.fit.toml'}";
    let done = twin(&["check", &path, "--set", gone]);
    assert!(done.code == 2 && done.err.contains("gone.fit.toml"));
}

/// Values that the scenario sets are not drawn, and options replace what varies.
#[test]
fn values_of_the_scenario_and_other_ensembles_are_held() {
    let folder = Folder::new("uncertain-held");
    let (path, fit) = (folder.join("supply.toml"), folder.join("supply.fit.toml"));
    fs::write(&fit, FIT).unwrap();
    fs::write(&path, scenario("7.5 V")).unwrap();
    let held = |settings: &[&str]| {
        let words = ["run", &path, "--no-record", "--json"];
        let done = twin(&[&words, settings].concat());
        json(&done.out).remove(0)["expectations"][0]["ensemble"].clone()
    };
    let set = "override.supply.voltage=\"7.4 V\"";
    let all = held(&["--uncertain", &fit, "--set", set]);
    assert_eq!((&all["held"], &all["runs"]), (&200.into(), &200.into()));
    let beside = "ensemble={runs=9, fit='supply.fit.toml'}";
    assert_eq!(held(&["--set", beside])["differ_by"], "parameters");
    let seeds = held(&["--set", beside, "--seeds", "4"]);
    assert_eq!(
        (&seeds["differ_by"], &seeds["runs"]),
        (&"seeds".into(), &4.into())
    );
}
