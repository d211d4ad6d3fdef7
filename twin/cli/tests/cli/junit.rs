//! `JUnit` files and the JSON of outcomes.

use std::path::Path;

use serde_json::{Value, json};
use twinrig_testing::python;

use crate::common::{Folder, SOUND, json as objects, twin};

/// Returns the violations of the schemas of Jenkins and Ant in a document; none without Python.
fn violations(file: &str) -> Option<Value> {
    let python = python::python("json")?;
    let script = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/junit.py"));
    Some(python::run(&python, script, &[Path::new(file)], &json!({})))
}

#[test]
fn documents_are_valid_by_the_schemas_of_jenkins_and_ant() {
    let folder = Folder::new("junit-schemas");
    let twice = SOUND.replace("name = \"height\"", "name = \"speed\"");
    let mixed = format!(
        "{}optional = true\n[[expect]]\nname = 'absent'\noptional = true\nenergy = {{ residual = {{ max = 1 }} }}\n",
        twice.replace("109 mm", "119 mm")
    );
    let mixed = folder.file("mixed.toml", &mixed);
    let wrong = folder.file("wrong.toml", "nothing");
    let file = folder.join("junit.xml");
    let plants = ["--plant", "toy", "--plant", "snapping"];
    let out = folder.join("out");
    let words = ["run", &mixed, "--out", &out, "--junit", &file];
    twin(&[&words[..], &plants].concat());
    let text = std::fs::read_to_string(&file).unwrap();
    for part in [
        " on toy\" tests=",
        " on snapping\" tests=",
        "name=\"speed (2)\"",
        "type=\"body\"",
        "mixed.toml:13: speed (2): 0.110 m is not ≥ 0.119 m, first at 0.084 s (1.084 s in the recording)",
        "<property name=\"plant\" value=\"toy\"/>",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    if let Some(found) = violations(&file) {
        assert_eq!(found, json!([]), "{text}");
    }
    twin(&[
        "run",
        &mixed,
        &mixed,
        &wrong,
        "--no-record",
        "--junit",
        &file,
    ]);
    if let Some(found) = violations(&file) {
        let text = std::fs::read_to_string(&file).unwrap();
        assert_eq!(found, json!([]), "{text}");
        // The rules find what they are for.
        let broken = [
            ("<properties>", "<properties file=\"x\">"),
            (" type=\"body\"", ""),
            (" hostname=\"localhost\"", ""),
            ("classname=", "line=\"1\" classname="),
            ("timestamp=\"", "timestamp=\" "),
            ("failures=\"1\"", "failures=\"2\""),
        ];
        for (from, to) in broken {
            let broken = folder.file("broken.xml", &text.replace(from, to));
            assert_ne!(violations(&broken), Some(json!([])), "{from} → {to}");
        }
    }
}

#[test]
fn outcomes_have_place_instant_and_limits_as_fields() {
    let folder = Folder::new("outcome-fields");
    let failing = folder.file("failing.toml", &SOUND.replace("109 mm", "119 mm"));
    let done = twin(&["run", &failing, "--json", "--no-record"]);
    let report = &objects(&done.out)[0];
    let height = &report["expectations"][1];
    assert_eq!(height["signal"], "body/position");
    assert_eq!(
        (&height["element"], &height["line"]),
        (&json!(2), &json!(13))
    );
    assert_eq!(height["file"], failing.as_str());
    assert_eq!(
        (&height["min"], &height["max"]),
        (&json!(0.119), &Value::Null)
    );
    // The value is the measured one, and recordings begin at 1 s.
    assert_eq!(height["value"], height["measured"]);
    let seconds = |key: &str| height[key].as_f64().unwrap();
    assert!((seconds("recording_s") - seconds("instant_s") - 1.0).abs() < 1e-9);
    let speed = &report["expectations"][0];
    assert!(speed["min"].as_f64() < speed["max"].as_f64(), "{speed}");
}

#[test]
fn output_repeats_the_run_and_has_its_tracking() {
    let folder = Folder::new("junit-output");
    let file = folder.join("junit.xml");
    let trot = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/trot.toml");
    let words = ["run", trot, "--no-record", "--junit", &file];
    let settings = [
        "--seed",
        "2",
        "--until",
        "2 s",
        "--set",
        "plant.ground.friction=0.5",
    ];
    twin(&[&words[..], &settings].concat());
    let text = std::fs::read_to_string(&file).unwrap();
    let output = text.split("<system-out>").nth(1).unwrap();
    let output = output.split("</system-out>").next().unwrap();
    assert!(output.contains("tracking: hip "), "{output}");
    let repeat = format!(
        "repeat: twin run {trot} --plant massless --set plant.ground.friction=0.5 --seed 2 --until \
         &apos;2 s&apos;"
    );
    assert!(output.contains(&repeat), "{output}");
}

#[test]
fn error_of_a_run_stands_before_what_it_left_unobserved() {
    let folder = Folder::new("junit-error");
    let scenario = SOUND.replace("[[expect]]", "[[expect]]\nafter = \"600 ms\"");
    let scenario = folder.file("snaps.toml", &scenario);
    let file = folder.join("junit.xml");
    let words = [
        "run",
        &scenario,
        "--plant",
        "snapping",
        "--no-record",
        "--junit",
        &file,
    ];
    assert_eq!(twin(&words).code, 2);
    let text = std::fs::read_to_string(&file).unwrap();
    let cases: Vec<&str> = text
        .lines()
        .filter(|line| line.contains("<testcase "))
        .collect();
    assert!(cases[0].contains("runs to its end"), "{text}");
    assert_eq!(text.matches("<error ").count(), 1, "{text}");
    assert_eq!(text.matches("<failure ").count(), 0, "{text}");
    assert_eq!(text.matches("<skipped").count(), 2, "{text}");
}
