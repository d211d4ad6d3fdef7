use serde_json::Value;

use super::{Optimization, SPACE, WALK};
use crate::common::{json, twin};

/// Runs the best scenario; returns the measured value of an expectation.
fn measured(path: &str, name: &str) -> Value {
    let done = twin(&["run", path, "--no-record", "--json"]);
    let report = json(&done.out).remove(0);
    let expectations = report["expectations"].as_array().unwrap();
    let one = expectations.iter().find(|one| one["name"] == name);
    one.unwrap_or_else(|| panic!("{report}"))["measured"].clone()
}

/// From its own folder, with a robot that only the scenario's folder has, all settings of the runs
/// and the comments of the scenario.
#[test]
fn best_scenario_has_the_value_of_the_best_point() {
    let scenario = WALK.replace("cheetah-cub", "own");
    let space = format!("set = {{ plant.ground.friction = 0.5 }}\n{SPACE}");
    let optimization = Optimization::new("best", &scenario, &space);
    let robots = optimization.folder.join("robots");
    std::fs::create_dir(&robots).unwrap();
    let robot = include_str!("../../../../../robots/cheetah-cub.toml");
    std::fs::write(format!("{robots}/own.toml"), robot).unwrap();
    let elsewhere = std::env::temp_dir().join(format!("twinrig-best-{}", std::process::id()));
    let outs = [
        optimization.folder.join("out"),
        elsewhere.display().to_string(),
    ];
    for out in &outs {
        let words = [
            "optimize",
            &optimization.scenario,
            "--space",
            &optimization.space,
        ];
        let more = ["--out", out, "--json", "--set", "actuator.torque=4 N·m"];
        let done = twin(&[&words[..], &more].concat());
        assert_eq!(done.code, 0, "{done:?}");
        let best = json(&done.out).remove(0)["best"].clone();
        let path = format!("{out}/best.toml");
        assert_eq!(measured(&path, "speed"), best["objective"], "{path}");
        let text = std::fs::read_to_string(&path).unwrap();
        for part in [
            "# A walk.",
            "# of all legs",
            "friction = 0.5",
            "torque = \"4 N·m\"",
            "seed 1",
        ] {
            assert!(text.contains(part), "{part}\n{text}");
        }
        assert!(
            !text.contains("fall.end") && !text.contains("signals"),
            "{text}"
        );
    }
    std::fs::remove_dir_all(elsewhere).unwrap();
}

#[test]
fn best_point_at_a_bound_is_noted() {
    // Longer steps are faster, up to the bound.
    let space = SPACE
        .replace("iterations = 4", "iterations = 30")
        .replace("'2 m'", "'5 cm'");
    let space = space
        .replace("'8 cm'", "'120 mm'")
        .replace("'14 cm'", "'130 mm'");
    let optimization = Optimization::new("bound", WALK, &space);
    let done = optimization.run("out", &[]);
    let note = "note: the best point touches bounds of the search space";
    assert!(done.err.contains(note), "{done:?}");
    assert!(done.out.contains("at its bound"), "{}", done.out);
}
