//! Runs with a fall of the robot.

use crate::common::{Folder, json, twin};
use serde_json::Value;

/// Writes a scenario of a robot that walks over an edge, with further keys and expectations.
fn falls(folder: &Folder, name: &str, more: &str) -> String {
    let text = format!(
        r#"
robot = "cheetah-cub"
duration = "2 s"
plant = {{ model = "massless", ground = {{ profile = "step-down", at = "5 cm", height = "50 cm" }} }}
controller = {{ kind = "cpg", gait = "walk", period = "2 ms" }}
{more}
"#
    );
    folder.file(name, &text)
}

fn report(words: &[&str]) -> (u8, Value) {
    let done = twin(words);
    assert_eq!(done.err, "");
    (done.code, json(&done.out).remove(0))
}

#[test]
fn expectations_of_the_gait_are_unobserved_after_a_fall() {
    let folder = Folder::new("fell");
    let more = "[[expect]]\nfootstep = { frequency = { max = \"99 Hz\" } }\n\
                [[expect]]\nbody = { speed = { max = \"9 m/s\" } }\n\
                [[expect]]\nbody = { yaw_drift = { max = \"999 deg\" } }";
    let file = falls(&folder, "falls.toml", more);
    let (code, report) = report(&["run", &file, "--no-record", "--json"]);
    assert_eq!((code, &report["verdict"]), (1, &"fail".into()));
    let fell_at = report["fell_at_s"].as_f64().unwrap();
    assert!(0.1 < fell_at && fell_at < 1.9, "{fell_at}");
    assert_eq!(report["simulated_s"], 2.0, "the run continues");
    for line in report["expectations"].as_array().unwrap() {
        assert_eq!(line["verdict"], "unobserved");
        assert_eq!(line["detail"], format!("fell at {fell_at} s"));
    }
    let text = twin(&["run", &file, "--no-record"]).out;
    assert!(
        text.contains(&format!("fall         at {fell_at} s\n")),
        "{text}"
    );
}

#[test]
fn fall_that_ends_run_is_failure_regardless_of_expectations() {
    let folder = Folder::new("ended");
    let excused = "[[expect]]\noptional = true\nbody = { speed = { max = \"9 m/s\" } }";
    let of_run = falls(
        &folder,
        "run.toml",
        &format!("fall = {{ end = true }}\n{excused}"),
    );
    let expected = "[[expect]]\nbody = { fall = { end = true } }";
    let of_expectation = falls(&folder, "expectation.toml", expected);
    for file in [&of_run, &of_expectation] {
        let (code, report) = report(&["run", file, "--no-record", "--json"]);
        assert_eq!((code, &report["verdict"]), (1, &"fail".into()), "{report}");
        assert_eq!(report["error"], Value::Null);
        let reached = report["simulated_s"].as_f64().unwrap();
        assert!(0.1 < reached && reached < 1.9, "{reached}");
        let text = twin(&["run", file, "--no-record"]).out;
        let fact = format!("fall         at {reached} s, which ended the run\n");
        assert!(text.contains("FAIL") && text.contains(&fact), "{text}");
    }
    // The run continues after the fall.
    let (_, report) = report(&[
        "run",
        &of_run,
        "--set",
        "fall.end=false",
        "--no-record",
        "--json",
    ]);
    assert_eq!(
        (&report["verdict"], &report["simulated_s"]),
        (&"pass".into(), &2.0.into())
    );
}

#[test]
fn run_ended_by_fall_equals_start_of_continued_run_and_is_replayable() {
    let folder = Folder::new("ended-again");
    let file = falls(&folder, "falls.toml", "fall = { end = true }");
    let (ended, continued) = (folder.join("ended"), folder.join("whole"));
    let run = |out: &str, end: &str| {
        let set = format!("fall.end={end}");
        let words = ["run", &file, "--set", &set, "--out", out, "--json"];
        report(&words).1["recording"].as_str().unwrap().to_owned()
    };
    let (ended, continued) = (run(&ended, "true"), run(&continued, "false"));
    let diff = twin(&["diff", &ended, &continued]);
    // They are equal up to the fall.
    assert!(diff.out.contains("a  no sample"), "{}", diff.out);
    let replay = twin(&["replay", &ended]);
    assert_eq!(replay.code, 0, "{}{}", replay.out, replay.err);
}

#[test]
fn plant_cannot_resume_after_the_end_of_the_first_run() {
    let folder = Folder::new("ended-from");
    let file = falls(&folder, "falls.toml", "fall = { end = true }");
    let out = folder.join("out");
    let words = ["run", &file, "--plant", "massless,lcp", "--from", "1.9 s"];
    let done = twin(&[&words[..], &["--out", &out]].concat());
    assert_eq!(done.code, 2, "{}", done.out);
    assert!(done.out.contains("which ended the run"), "{}", done.out);
}
