//! A panic of a part ends its run or study row with an error that names the part, and does not
//! affect others; the exit code is 2.

use twinrig::kernel::Unit;
use twinrig::runtime::ProcessVariable;
use twinrig_record::Recording;

use crate::common::{Done, Folder, SOUND, json, panicking, registry, twin_of};
use crate::studies::{STILL, spring};

/// Returns a valid scenario whose controller panics at its third step.
fn clumsy() -> String {
    format!("controller = {{ kind = \"clumsy\", period = \"10 ms\" }}\n{SOUND}")
}

/// Checks that `report` is an error that names the part and the place of the panic.
fn reports_panic(report: &serde_json::Value, part: &str, message: &str, file: &str) {
    assert_eq!(report["verdict"], "error");
    let error = report["error"].as_str().unwrap();
    for expected in [part, "panicked: ", message, file] {
        assert!(error.contains(expected), "{expected} in {error}");
    }
}

#[test]
fn panic_affects_only_its_scenario() {
    let folder = Folder::new("panic-scenarios");
    let clumsy = folder.file("clumsy.toml", &clumsy());
    let broken = folder.file("broken.toml", &SOUND.replace("\"toy\"", "\"panicking\""));
    let unbuildable = SOUND.replace("\"toy\"", "\"unbuildable\"");
    let unbuildable = folder.file("unbuildable.toml", &unbuildable);
    let sound = folder.file("sound.toml", SOUND);
    let (out, junit) = (folder.join("out"), folder.join("junit.xml"));
    let files = [&clumsy, &broken, &unbuildable, &sound].map(String::as_str);
    let options = ["--json", "--out", &out, "--junit", &junit];
    let done = twin_of(
        &panicking(),
        &[&["run"][..], &files[..], &options[..]].concat(),
    );
    assert_eq!((done.code, done.err.as_str()), (2, ""));
    let reports = json(&done.out);
    assert_eq!(reports.len(), 4, "{}", done.out);
    reports_panic(
        &reports[0],
        "controller `clumsy`",
        "index out of bounds",
        "common.rs",
    );
    reports_panic(&reports[1], "plant `toy`", "out of cheese", "common.rs");
    reports_panic(
        &reports[2],
        "plant `unbuildable`",
        "no blueprint",
        "common.rs",
    );
    assert_eq!(reports[3]["verdict"], "pass");

    // The recording ends at the panic, and no expectation passes.
    for (report, until_s) in [(&reports[0], 0.02), (&reports[1], 0.5)] {
        assert_eq!(report["simulated_s"].as_f64(), Some(until_s), "{report}");
        for line in report["expectations"].as_array().unwrap() {
            assert_ne!(line["verdict"], "pass", "{line}");
        }
        let recording = report["recording"].as_str().unwrap();
        let recording = Recording::open(recording.as_ref()).unwrap();
        assert!(recording.is_complete());
        assert_eq!(recording.fingerprint(), report["fingerprint"].as_str());
    }
    let bobbed = Recording::open(reports[1]["recording"].as_str().unwrap().as_ref()).unwrap();
    assert_eq!(bobbed.series("body/position").unwrap().times.len(), 250);

    let junit = std::fs::read_to_string(&junit).unwrap();
    assert_eq!(junit.matches("<testsuite ").count(), 4, "{junit}");
    assert_eq!(junit.matches("<error message=").count(), 3, "{junit}");
}

#[test]
fn panic_affects_only_its_plant() {
    let folder = Folder::new("panic-plants");
    let scenario = folder.file("bob.toml", SOUND);
    let plants = [
        "--plant",
        "toy",
        "--plant",
        "panicking",
        "--plant",
        "snapping",
    ];
    let words = [
        &["run", &scenario, "--json", "--out", &folder.join("out")],
        &plants[..],
    ];
    let done = twin_of(&panicking(), &words.concat());
    assert_eq!(done.code, 2);
    let reports = json(&done.out);
    let verdicts: Vec<_> = reports[..3]
        .iter()
        .map(|report| &report["verdict"])
        .collect();
    assert_eq!(verdicts, ["pass", "error", "error"], "{}", done.out);
    reports_panic(&reports[1], "plant `toy`", "out of cheese", "common.rs");
    assert_eq!(reports[1]["plant"], "panicking");
    // Both are compared with the first up to their ends.
    assert_eq!(reports.len(), 5, "{}", done.out);
}

#[test]
fn panic_is_printed_once() {
    let folder = Folder::new("panic-text");
    let scenario = folder.file("bob.toml", SOUND);
    let words = ["run", &scenario, "--no-record", "--plant", "panicking"];
    let done = twin_of(&panicking(), &words);
    assert_eq!(done.code, 2);
    assert_eq!(done.out.matches("out of cheese").count(), 1, "{}", done.out);
    assert!(done.out.contains("RUST_BACKTRACE=1"), "{}", done.out);
}

#[test]
fn all_commands_report_panic_as_error() {
    let folder = Folder::new("panic-commands");
    let text = SOUND.replace("\"toy\"", "\"unbuildable\"");
    let scenario = folder.file("unbuildable.toml", &text);
    let sound = folder.file("sound.toml", SOUND);
    let done = twin_of(&panicking(), &["check", &scenario, &sound, "--json"]);
    assert_eq!(done.code, 2);
    let checked = json(&done.out);
    assert_eq!(checked[1]["valid"], true, "{}", done.out);
    let blamed = |error: &serde_json::Value| {
        let error = error.as_str().unwrap();
        assert!(error.contains("plant `unbuildable` panicked"), "{error}");
    };
    blamed(&checked[0]["error"]);
    for words in [&["plan"][..], &["study", "precision"]] {
        let done = twin_of(&panicking(), &[words, &[&scenario, "--json"]].concat());
        assert_eq!(done.code, 2, "{done:?}");
        blamed(&json(&done.out)[0]["error"]);
    }
    let text = twin_of(&panicking(), &["plan", &scenario]);
    assert!(text.err.contains("no blueprint"), "{text:?}");
}

#[test]
fn panic_while_building_controller_is_reported_and_affects_no_other_run() {
    let folder = Folder::new("panic-variables");
    let registry = registry().with_controller(
        twinrig::ControllerKind::new(
            "hopeless",
            "is never there",
            |_| -> Result<crate::common::Clumsy, _> { panic!("no idea") },
        )
        .with_variables(|_| {
            Ok(vec![ProcessVariable::new(
                "speed",
                Unit::MeterPerSecond,
                ..,
                0.0,
            )])
        }),
    );
    let text = format!(
        "controller = {{ kind = \"hopeless\", period = \"10 ms\", speed = \"1 m/s\" }}\n{SOUND}"
    );
    let scenario = folder.file("hopeless.toml", &text);
    let sound = folder.file("sound.toml", SOUND);
    let words = ["run", &scenario, &sound, "--json", "--no-record"];
    let done = twin_of(&registry, &words);
    let reports = json(&done.out);
    reports_panic(&reports[0], "controller `hopeless`", "no idea", "panics.rs");
    assert_eq!(reports[1]["verdict"], "pass");
}

fn study(folder: &Folder, words: &[&str]) -> Done {
    let scenario = folder.file("spring.toml", STILL);
    let out = folder.join("out");
    let registry = registry()
        .with_plant(spring("spring"))
        .with_plant(spring("cracking"))
        .with_plant(spring("unbuildable"));
    let all = [&["study", words[0], &scenario, "--out", &out], &words[1..]];
    twin_of(&registry, &all.concat())
}

#[test]
fn panic_in_study_is_a_failed_row() {
    let folder = Folder::new("panic-study");
    let plants = [
        "--plant",
        "spring",
        "--plant",
        "cracking",
        "--plant",
        "unbuildable",
    ];
    let done = study(&folder, &[&["precision", "--json"], &plants[..]].concat());
    assert_eq!((done.code, done.err.as_str()), (2, ""));
    let study = &json(&done.out)[0];
    let error = study["error"].as_str().unwrap();
    assert!(error.contains("plant `unbuildable` panicked: "), "{error}");
    let rows = study["rows"].as_array().unwrap();
    let of = |plant: &str, method: &str, short: bool| {
        let rows = rows.iter().filter(|row| {
            let step = row["step_s"].as_f64().unwrap();
            row["kind"] == "integration"
                && row["plant"] == plant
                && row["method"] == method
                && (step < 1.5e-3) == short
        });
        let states: Vec<_> = rows
            .map(|row| (row["status"].clone(), row["why"].clone()))
            .collect();
        assert!(!states.is_empty(), "{plant} {method}");
        states
    };
    for short in [false, true] {
        for plant in ["spring", "cracking"] {
            let states = of(plant, "semi-implicit", short);
            assert!(
                states.iter().all(|(status, _)| status == "ok"),
                "{states:?}"
            );
        }
        for (status, why) in of("unbuildable", "semi-implicit", short) {
            assert_eq!(status, "failed");
            assert!(why.as_str().unwrap().contains("no blueprint"), "{why}");
        }
    }
    for (status, why) in of("cracking", "explicit-euler", true) {
        assert_eq!(status, "failed");
        let why = why.as_str().unwrap();
        assert!(
            why.contains("plant `cracking` panicked: it cracked (") && why.contains("studies.rs"),
            "{why}"
        );
    }
    let long = of("cracking", "explicit-euler", false);
    assert!(
        long.iter().all(|(status, _)| status != "failed"),
        "{long:?}"
    );
    for ending in ["html", "csv", "json"] {
        let file = folder.join(&format!("out/precision-spring.{ending}"));
        let text = std::fs::read_to_string(file).unwrap();
        assert!(text.contains("it cracked"), "{ending}");
    }
}

#[test]
fn stability_study_reports_panic_and_other_rows() {
    let folder = Folder::new("panic-stability");
    let words = ["stability", "--plant", "cracking", "--duration", "500 ms"];
    let done = study(
        &folder,
        &[&words[..], &["--set", "plant.legs=[\"LF\"]"]].concat(),
    );
    assert_eq!(done.code, 2, "{done:?}");
    assert!(done.err.contains("plant `cracking` panicked"), "{done:?}");
    let text = std::fs::read_to_string(folder.join("out/stability-spring.json")).unwrap();
    let study: serde_json::Value = serde_json::from_str(&text).unwrap();
    let rows = study["rows"].as_array().unwrap();
    let failed = rows.iter().filter(|row| row["status"] == "failed");
    let failed: Vec<_> = failed.collect();
    assert!(!failed.is_empty(), "{text}");
    for row in &failed {
        assert_eq!(row["method"], "explicit-euler");
        let why = row["why"].as_str().unwrap();
        assert!(why.contains("it cracked"), "{why}");
    }
    assert!(failed.len() < rows.len());
}

#[test]
fn panic_in_coupling_study_is_a_failed_row() {
    let folder = Folder::new("panic-coupling");
    let plants = ["--plant", "unbuildable", "--plant", "spring"];
    let words = [&["coupling", "--json", "--duration", "20 ms"], &plants[..]];
    let done = study(&folder, &words.concat());
    assert_eq!(done.code, 2, "{done:?}");
    let study = &json(&done.out)[0];
    assert!(study["error"].as_str().unwrap().contains("no blueprint"));
    for row in study["rows"].as_array().unwrap() {
        let status = if row["plant"] == "spring" {
            "ok"
        } else {
            "failed"
        };
        assert_eq!(row["status"], status, "{row}");
    }
}
