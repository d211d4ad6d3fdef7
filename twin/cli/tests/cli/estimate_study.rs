//! End-to-end tests of `twin study estimate` on a short run of the bench.

use crate::common::{Done, Folder, study_result, twin};

/// Three frequencies, five periods each.
const BENCH: &str = r#"
name = "a short bench"
duration = "9.2 s"
seed = 5
plant = { model = "bench", file = "tactile" }
controller = { kind = "turn", period = "10 ms", frequency = "2 Hz", acceleration = "125 rad/s²" }
observe = { period = "10 ms" }

[[change]]
at = "3.7 s"
set = "frequency"
to = "3 Hz"

[[change]]
at = "6.6 s"
set = "frequency"
by = "1 Hz"

[[bus]]
kind = "sbcp"

[[bus]]
kind = "tactile"
"#;

fn study(folder: &Folder, text: &str, more: &[&str]) -> Done {
    let scenario = folder.file("bench.toml", text);
    let out = folder.join("out");
    let words = ["study", "estimate", &scenario, "--out", &out];
    twin(&[&words[..], more].concat())
}

const SMALL: [&str; 4] = ["--particles", "2", "--iterations", "1"];

#[test]
fn study_is_the_same_twice_and_its_filters_fit_into_the_scenario() {
    let folder = Folder::new("study-estimate");
    let parts = folder.join("out/estimate-bench/parts");
    let mut printed = [(); 2].map(|()| {
        // Nothing is kept of the first study.
        let _ = std::fs::remove_dir_all(&parts);
        let done = study(&folder, BENCH, &[&SMALL[..], &["--json"]].concat());
        study_result(&done)
    });
    assert_eq!(printed[0], printed[1]);
    let found = printed[0].take();
    assert_eq!(found["seeds"], serde_json::json!([5, 6, 7]));
    let frequencies = found["identification"]["coefficients"]["frequencies"]
        .as_array()
        .unwrap();
    let frequencies: Vec<f64> = frequencies
        .iter()
        .map(|it| it["hz"].as_f64().unwrap())
        .collect();
    assert_eq!(frequencies, [2.0, 3.0, 4.0]);
    // The amplifier of benches/tactile.toml.
    let amplifier = &found["identification"]["amplifier"];
    for (key, expected) in [
        ("sensitivity_v_s_per_n", -0.05),
        ("feedback_s", 0.1),
        ("lag_s", 0.005),
    ] {
        let value = amplifier[key].as_f64().unwrap();
        assert!((value / expected - 1.0).abs() < 0.02, "{key}: {value}");
    }
    for ending in ["html", "csv", "json"] {
        let path = folder.join(&format!("out/estimate-bench.{ending}"));
        assert!(std::path::Path::new(&path).exists(), "{path}");
    }
    let settings = found["settings"].as_str().unwrap();
    let measured = BENCH.replace("/s²\"", "/s²\", measure = true");
    let filtered = folder.file("filtered.toml", &format!("{measured}\n{settings}"));
    let checked = twin(&["check", &filtered]);
    assert_eq!(checked.code, 0, "{}\n{settings}", checked.err);
}

#[test]
fn filters_tuned_on_other_runs_are_not_used() {
    let folder = Folder::new("study-estimate-kept");
    let searches = |more: &[&str]| {
        let done = study(&folder, BENCH, &[&SMALL[..], more].concat());
        assert_eq!((done.code, done.err.as_str()), (0, ""), "{}", done.out);
        let log = folder.join("out/estimate-bench/parts/all.jsonl");
        let log = std::fs::read_to_string(log).unwrap();
        log.lines()
            .filter(|line| line.contains("evaluations"))
            .count()
    };
    assert_eq!(searches(&[]), 5);
    assert_eq!(searches(&[]), 5);
    assert_eq!(searches(&["--duration", "8.9 s"]), 10);
}

#[test]
fn table_shows_the_thesis_beside_the_results() {
    let folder = Folder::new("study-estimate-table");
    let done = study(&folder, BENCH, &SMALL);
    assert_eq!((done.code, done.err.as_str()), (0, ""));
    for expected in [
        "0.9997",
        "too low",
        "[bus.filter.F3]",
        "piezoresistive",
        "estimate-bench.html",
    ] {
        assert!(
            done.out.contains(expected),
            "no {expected} in\n{}",
            done.out
        );
    }
}

#[test]
fn scenario_without_what_the_study_needs_is_an_error_with_a_remedy() {
    let folder = Folder::new("study-estimate-wrong");
    let unchanged = BENCH
        .replace("set = \"frequency\"", "set = \"acceleration\"")
        .replace("to = \"3 Hz\"", "to = \"100 rad/s²\"")
        .replace("by = \"1 Hz\"", "by = \"1 rad/s²\"");
    let without_bus = BENCH.replace("\n[[bus]]\nkind = \"tactile\"\n", "");
    for (text, more, why, help) in [
        (
            &without_bus,
            &[][..],
            "no tactile bus",
            "kind = \"tactile\"",
        ),
        (&unchanged, &[], "does not change", "[[change]]"),
        (
            &BENCH.replace("6.6 s", "4.9 s"),
            &["--duration", "6 s"],
            "last long enough: 1, of 2",
            "one second after a change",
        ),
        (&BENCH.to_owned(), &["--particles", "0"], "--particles", ""),
    ] {
        let done = study(&folder, text, more);
        assert_eq!(
            (done.code, done.out.as_str()),
            (2, ""),
            "{why}: {}",
            done.err
        );
        assert!(
            done.err.contains(why) && done.err.contains(help),
            "{}",
            done.err
        );
    }
}
