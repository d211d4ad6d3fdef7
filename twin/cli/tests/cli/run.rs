//! Command `twin run`: reports, verdicts, exit codes.

use crate::common::{Folder, SOUND, json, twin};
use serde_json::json;

#[test]
fn run_prints_documented_keys_first_and_in_order() {
    let folder = Folder::new("keys");
    let scenario = folder.file("bob.toml", SOUND);
    let done = twin(&["run", &scenario, "--json", "--out", &folder.join("out")]);
    assert_eq!((done.code, done.err.as_str()), (0, ""));
    let report = &json(&done.out)[0];
    let keys: Vec<&str> = report
        .as_object()
        .unwrap()
        .keys()
        .map(String::as_str)
        .collect();
    assert_eq!(
        keys[..11],
        [
            "scenario",
            "verdict",
            "seed",
            "plant",
            "fingerprint",
            "simulated_s",
            "wall_s",
            "real_time_factor",
            "expectations",
            "left_out",
            "recording"
        ]
    );
    let first = report["expectations"][0].as_object().unwrap();
    let keys: Vec<&str> = first.keys().map(String::as_str).collect();
    let documented = [
        "name",
        "verdict",
        "measured",
        "bound",
        "unit",
        "margin",
        "first_violation_s",
    ];
    assert_eq!(keys[..7], documented);
    assert_eq!(report["verdict"], "pass");
    assert_eq!(report["scenario"], "bobbing <& fast>");
    assert_eq!(report["seed"], 7);
    assert_eq!(report["simulated_s"], 1.0);
    assert_eq!(first["unit"], "m/s");
    let recording = report["recording"].as_str().unwrap();
    assert!(recording.ends_with("bob-seed7.mcap"), "{recording}");
    assert!(std::path::Path::new(recording).is_file());
}

#[test]
fn exit_codes_distinguish_pass_fail_and_error() {
    let folder = Folder::new("codes");
    let sound = folder.file("sound.toml", SOUND);
    let failing = folder.file("failing.toml", &SOUND.replace("109 mm", "119 mm"));
    let wrong = folder.file("wrong.toml", &SOUND.replace("duration", "duratoin"));
    let code = |words: &[&str]| twin(&[words, &["--no-record"]].concat()).code;
    assert_eq!(code(&["run", &sound]), 0);
    assert_eq!(code(&["run", &failing]), 1);
    assert_eq!(code(&["run", &wrong]), 2);
    assert_eq!(code(&["run", &sound, &failing]), 1);
    assert_eq!(code(&["run", &failing, &wrong, &sound]), 2);
    assert_eq!(twin(&["run"]).code, 2);
    assert_eq!(twin(&["jump"]).code, 2);
    assert_eq!(twin(&["--help"]).code, 0);
}

#[test]
fn error_of_one_scenario_does_not_affect_others() {
    let folder = Folder::new("others");
    let wrong = folder.file("wrong.toml", &SOUND.replace("duration", "duratoin"));
    let missing = folder.join("missing.toml");
    let sound = folder.file("sound.toml", SOUND);
    let done = twin(&["run", &wrong, &missing, &sound, "--json", "--no-record"]);
    let reports = json(&done.out);
    let verdicts: Vec<_> = reports.iter().map(|report| &report["verdict"]).collect();
    assert_eq!(verdicts, ["error", "error", "pass"]);
    let error = reports[0]["error"].as_str().unwrap();
    assert!(
        error.contains("did you mean `duration`?") && error.contains("wrong.toml:4:1"),
        "{error}"
    );
    assert!(
        reports[1]["error"]
            .as_str()
            .unwrap()
            .contains("cannot be read")
    );

    let done = twin(&["run", &wrong, &sound, "--no-record"]);
    let summary: Vec<&str> = done.out.lines().rev().take(2).collect();
    assert!(
        summary[0].contains("PASS") && summary[0].contains("2 of 2 hold"),
        "{}",
        done.out
    );
    assert!(summary[1].contains("ERROR"), "{}", done.out);
    assert!(done.err.contains("^^^^^^^^"), "{}", done.err);
}

#[test]
fn failure_reports_value_bound_margin_and_first_violation() {
    let folder = Folder::new("failure");
    let scenario = folder.file("failing.toml", &SOUND.replace("109 mm", "119 mm"));
    let report = &json(&twin(&["run", &scenario, "--json", "--no-record"]).out)[0];
    let height = &report["expectations"][1];
    assert_eq!(height["verdict"], "fail");
    assert_eq!(height["bound"], 0.119);
    let (measured, margin) = (
        height["measured"].as_f64().unwrap(),
        height["margin"].as_f64().unwrap(),
    );
    assert!((0.1095..0.1105).contains(&measured) && (measured - 0.119 - margin).abs() < 1e-12);
    // 10 mm cos(20 t) falls to −1 mm at 84 ms.
    let at = height["first_violation_s"].as_f64().unwrap();
    assert!((0.080..0.088).contains(&at), "{at}");
    let text = twin(&["run", &scenario, "--no-record"]).out;
    assert!(
        text.contains("✗  height") && text.contains("first at 0.08"),
        "{text}"
    );
}

#[test]
fn plant_fault_ends_run_with_verdict_and_recording() {
    let folder = Folder::new("fault");
    let scenario = folder.file("snap.toml", SOUND);
    let out = folder.join("out");
    let done = twin(&[
        "run", &scenario, "--plant", "snapping", "--out", &out, "--json",
    ]);
    assert_eq!(done.code, 2);
    let report = &json(&done.out)[0];
    assert_eq!(report["verdict"], "error");
    let error = report["error"].as_str().unwrap();
    for part in ["toy/spring", "498", "1.500e0 J", "it snapped", "snap.toml"] {
        assert!(error.contains(part), "{part} in {error}");
    }
    for line in report["expectations"].as_array().unwrap() {
        assert_ne!(line["verdict"], "pass", "{line}");
    }
    let recording =
        twinrig_record::Recording::open(report["recording"].as_str().unwrap().as_ref()).unwrap();
    assert_eq!(recording.series("body/position").unwrap().times.len(), 250);
    assert!(recording.is_complete());
}

#[test]
fn settings_apply_to_scenario_and_recording_name() {
    let folder = Folder::new("settings");
    let scenario = folder.file("bob.toml", SOUND);
    let out = folder.join("out");
    let run = |words: &[&str]| {
        let all = [&["run", &scenario, "--out", &out, "--json"], words].concat();
        json(&twin(&all).out).remove(0)
    };
    let (plain, shorter) = (
        run(&[]),
        run(&["--set", "duration=500 ms", "--set", "seed=8"]),
    );
    assert_eq!(
        (&shorter["simulated_s"], &shorter["seed"]),
        (&json!(0.5), &json!(8))
    );
    assert_ne!(plain["recording"], shorter["recording"]);
    assert_eq!(
        shorter["recording"],
        run(&["--set", "duration=500 ms", "--set", "seed=8"])["recording"]
    );
    let wrong = run(&["--set", "plant.modle=toy"]);
    assert!(
        wrong["error"]
            .as_str()
            .unwrap()
            .contains("did you mean `model`?"),
        "{wrong}"
    );
}

#[test]
fn junit_has_one_case_per_expectation_and_error() {
    let folder = Folder::new("junit");
    let failing = folder.file("failing.toml", &SOUND.replace("109 mm", "119 mm"));
    let scenario = folder.file("snap.toml", SOUND);
    let file = folder.join("junit.xml");
    twin(&["run", &failing, "--no-record", "--junit", &file]);
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(
        text.contains(
            r#"<testsuite name="bobbing &lt;&amp; fast&gt;" tests="2" failures="1" errors="0""#
        ),
        "{text}"
    );
    assert!(
        text.contains("0.110 m is not ≥ 0.119 m, first at 0.084 s"),
        "{text}"
    );
    twin(&[
        "run",
        &scenario,
        "--plant",
        "snapping",
        "--no-record",
        "--junit",
        &file,
    ]);
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(
        text.contains(r#"errors="1""#) && text.contains("<error message="),
        "{text}"
    );
    let done = twin(&[
        "run",
        &scenario,
        "--no-record",
        "--junit",
        &folder.join("no/such/folder.xml"),
    ]);
    assert_eq!(done.code, 2);
}

#[test]
fn errors_are_json_objects_with_json_option() {
    let folder = Folder::new("errors");
    let wrong = folder.file("wrong.toml", &SOUND.replace("duration", "duratoin"));
    let lost = folder.join("lost.mcap");
    for words in [
        &["diff", &lost, &lost][..],
        &["replay", &lost],
        &["plan", &wrong],
        &["check", &wrong],
        &["run", &wrong],
    ] {
        let done = twin(&[words, &["--json"]].concat());
        assert_eq!((done.code, done.err.as_str()), (2, ""), "{words:?}");
        let objects = json(&done.out);
        assert_eq!(objects.len(), 1, "{}", done.out);
        let error = objects[0]["error"].as_str().unwrap();
        assert!(error.starts_with("error: "), "{error}");
    }
}

#[test]
fn times_are_printed_without_rounding_errors() {
    let folder = Folder::new("times");
    let scenario = folder.file("bob.toml", &SOUND.replace("1 s", "1148 ms"));
    let done = twin(&["run", &scenario, "--json", "--no-record"]);
    assert!(done.out.contains("\"simulated_s\":1.148,"), "{}", done.out);
    let shown = twin(&["run", &scenario, "--no-record"]).out;
    assert!(shown.contains(" 1.148 s simulated"), "{shown}");
    let plan = twin(&["plan", &scenario]).out;
    assert!(plan.contains(" 1.148 s, seed 7"), "{plan}");
}

#[test]
fn failure_of_a_plant_names_the_push_that_acts() {
    let trot = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/trot.toml");
    let push = |force: &str, at: &str| {
        let push =
            format!("{{on=\"body\",at=\"{at}\",for=\"0.1 s\",force=\"{force}\",direction=\"y\"}}");
        let pushes = format!("push=[{push}]");
        twin(&[
            "run",
            trot,
            "--no-record",
            "--json",
            "--until",
            "2 s",
            "--set",
            &pushes,
        ])
    };
    let failed = push("1e6 N", "1 s");
    let error = json(&failed.out)[0]["error"].as_str().unwrap().to_owned();
    assert_eq!(failed.code, 2);
    assert!(
        error.contains("the push `push 1` (--set:1) acts from 1 s to 1.1 s with 1000000 N"),
        "{error}"
    );
    assert!(json(&push("1 N", "1 s").out)[0]["error"].is_null());
}
