use std::collections::BTreeSet;

use super::{SEEDS, STAND, Sweep, built, texts};
use crate::common::{json, shell_words, twin_of};

/// The command of each row repeats its run, bit for bit: settings of the specification, of the
/// command line and of the point.
#[test]
fn command_of_a_row_has_its_fingerprint() {
    let spec = "design = 'random'\npoints = 6\n[set]\nobserve.period = '2 ms'\n\
                [[dimension]]\nkey = 'plant.ground.friction'\nfrom = 0.3\nto = 0.9\n\
                [[dimension]]\nkey = 'seed'\nfrom = 1\nto = 1000\n\
                [[dimension]]\nkey = 'controller.compute_time.max'\nfrom = '1 ms'\nto = '1.9 ms'\n";
    let sweep = Sweep::new("command", STAND, spec);
    let more = ["--plant", "lcp", "--set", "name=\"it's\""];
    let result = sweep.json(0, "out", &more);
    let rows = result["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 6);
    for row in rows {
        let words = shell_words(row["command"].as_str().unwrap());
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let done = twin_of(&built("other"), &[&words[1..], &["--json"]].concat());
        assert_eq!(done.code, 0, "{done:?}");
        let report = &json(&done.out)[0];
        assert_eq!(report["fingerprint"], row["fingerprint"]);
        assert_eq!(report["plant"], "lcp");
        assert_eq!(report["seed"], row["seed"]);
        let measured = &report["expectations"][0]["measured"];
        assert_eq!(measured, &row["expectations"][0]["measured"]);
    }
    let prints: BTreeSet<&str> = texts(&result["rows"], "fingerprint").into_iter().collect();
    assert_eq!(prints.len(), 6);
}

#[test]
fn number_of_threads_has_no_influence() {
    let sweep = Sweep::new("jobs", STAND, SEEDS);
    let one = sweep.json(0, "one", &["--jobs", "1"]);
    let three = sweep.json(0, "three", &["--jobs", "3"]);
    assert_eq!(one, three);
    assert_eq!(sweep.files("one"), sweep.files("three"));
    // The file is the output of `--json`.
    let file: serde_json::Value = serde_json::from_str(&sweep.files("one")[1]).unwrap();
    assert_eq!(file, one);
    let prints: BTreeSet<&str> = texts(&one["rows"], "fingerprint").into_iter().collect();
    assert_eq!(prints.len(), 12, "each seed has a run of its own");
}

/// Everything that a run depends on is part of its key, and nothing else is.
#[test]
fn rows_are_kept_by_scenario_settings_and_build() {
    let sweep = Sweep::new("keys", STAND, SEEDS);
    let first = sweep.json(0, "out", &[]);
    let keys = |result: &serde_json::Value| -> Vec<String> {
        let keys = texts(&result["rows"], "key");
        keys.into_iter().map(str::to_owned).collect()
    };
    let all = keys(&first);
    assert_eq!(all.iter().collect::<BTreeSet<_>>().len(), 12);
    let again = sweep.run("out", &[]);
    assert!(again.out.contains("12 of earlier calls"), "{}", again.out);
    // Another share asks the same runs.
    let share = format!("{SEEDS}[[share]]\nof = 'stands'\nmin = 0.5");
    sweep.folder.file("spec.toml", &share);
    assert_eq!(keys(&sweep.json(0, "out", &[])), all);
    sweep.folder.file("spec.toml", SEEDS);
    let disjoint = |other: &serde_json::Value| keys(other).iter().all(|key| !all.contains(key));
    assert!(disjoint(&sweep.json(
        0,
        "out",
        &["--set", "duration=90.5 ms"]
    )));
    sweep
        .folder
        .file("stand.toml", &format!("{STAND}# A byte.\n"));
    let changed = sweep.json(0, "out", &[]);
    assert!(disjoint(&changed));
    assert_eq!(changed["hash"], first["hash"], "the runs are the same");
    sweep.folder.file("stand.toml", STAND);
    let other = sweep.run_of(&built("two"), "out", &["--json"]);
    assert!(disjoint(&json(&other.out)[0]));
}

/// A robot file beside the scenario takes the place of the built-in one.
#[test]
fn rows_depend_on_the_robot_file() {
    let sweep = Sweep::new("robot", STAND, SEEDS);
    let first = sweep.json(0, "out", &[]);
    let robots = sweep.folder.join("robots");
    std::fs::create_dir(&robots).unwrap();
    let robot = include_str!("../../../../../robots/cheetah-cub.toml");
    std::fs::write(format!("{robots}/cheetah-cub.toml"), format!("{robot}\n")).unwrap();
    let second = sweep.json(0, "out", &[]);
    assert_ne!(first["rows"][0]["key"], second["rows"][0]["key"]);
    assert_eq!(first["hash"], second["hash"], "the runs are the same");
}

/// Numbers in the CSV are those of the JSON, in the units of the header.
#[test]
fn csv_has_points_and_margins() {
    let spec = "[[dimension]]\nkey = 'plant.step'\nvalues = ['1 ms', '2 ms']\n\
                [[dimension]]\nkey = 'controller.compute_time.min'\nfrom = '0 ms'\nto = '0.2 ms'\ncount = 2\n\
                [[dimension]]\nkey = 'plant.base'\nvalues = ['free']\n";
    let sweep = Sweep::new("csv", STAND, spec);
    let result = sweep.json(0, "out", &["--set", "name=\"a,b\""]);
    let files = sweep.files("out");
    let lines: Vec<Vec<&str>> = files[0]
        .lines()
        .map(|line| line.split(',').collect())
        .collect();
    assert_eq!(
        lines[0][..10],
        [
            "index",
            "plant.step [s]",
            "controller.compute_time.min [s]",
            "plant.base",
            "run seed",
            "verdict",
            "fell_at_s",
            "stands: verdict",
            "stands: measured [m]",
            "stands: margin [m]"
        ]
    );
    assert_eq!(lines[1][..6], ["0", "0.001", "0", "free", "1", "pass"]);
    assert_eq!(lines[4][..6], ["3", "0.002", "0.0002", "free", "1", "pass"]);
    let margin = result["rows"][0]["expectations"][0]["margin"].as_f64();
    assert_eq!(lines[1][9].parse().ok(), margin);
    assert_eq!(result["rows"][3]["point"]["plant.step"], 0.002);
}

/// Heights of a standing robot follow the preload of its springs and not its toes, which the plant
/// does not have.
#[test]
fn screening_of_assumed_values_ranks_their_effects() {
    let spec = "design = 'morris'\ntrajectories = 3\nmeasures = ['stands']\n\
                assumed = ['leg.aslp.parallel.preload', 'leg.aslp.toe']\n";
    let sweep = Sweep::new("morris", STAND, spec);
    let result = sweep.json(0, "out", &[]);
    assert_eq!(result["rows"].as_array().unwrap().len(), 3 * 5);
    let effects = result["effects"].as_array().unwrap();
    let of = effects.iter().filter(|one| one["measure"] == "stands");
    let of: Vec<_> = of.collect();
    assert_eq!(of[0]["dimension"], "override.leg.aslp.parallel.preload");
    assert!(of[0]["mu_star"].as_f64().unwrap() > 0.0, "{effects:?}");
    assert!(
        of[1..].iter().all(|one| one["mu_star"] == 0.0),
        "{effects:?}"
    );
    let path = sweep.folder.join("out/effects.csv");
    let lines = std::fs::read_to_string(path).unwrap().lines().count();
    assert_eq!(lines, effects.len() + 1);
}
