//! Warnings about likely mistakes in valid scenarios.

use crate::common::{Folder, SOUND, json, twin};

/// Writes a scenario that passes, with a lag longer than the run.
fn slow(folder: &Folder) -> String {
    let lagging = SOUND.replace("seed = 7", "seed = 7\nactuator = { lag = \"1.5 s\" }");
    folder.file("slow.toml", &lagging)
}

#[test]
fn warning_is_shown_with_place_and_does_not_change_verdict() {
    let folder = Folder::new("warned");
    let slow = slow(&folder);
    let done = twin(&["run", &slow, "--no-record"]);
    assert_eq!(done.code, 0);
    assert!(done.out.contains("PASS"), "{}", done.out);
    let place = format!("--> {slow}:6:20");
    for part in [
        "warning[lag-beyond-run]: the lag is longer than the run",
        &place,
        "^^^^^^^",
        "= help: the run lasts 1 s",
    ] {
        assert!(done.err.contains(part), "{part} is not in\n{}", done.err);
    }
    for command in [&["check"][..], &["plan"]] {
        let done = twin(&[command, &[&slow]].concat());
        assert_eq!(done.code, 0);
        assert!(done.err.contains("warning[lag-beyond-run]"), "{}", done.err);
    }
    // The run is equal to the one without the lag.
    let print = |words: &[&str]| json(&twin(words).out)[0]["fingerprint"].clone();
    let plain = folder.file("plain.toml", SOUND);
    let words = ["run", &slow, "--no-record", "--json"];
    assert_eq!(
        print(&words),
        print(&["run", &plain, "--no-record", "--json"])
    );
}

#[test]
fn warnings_are_in_json_output() {
    let folder = Folder::new("warned-json");
    let slow = slow(&folder);
    let expected = serde_json::json!([{
        "code": "lag-beyond-run", "message": "the lag is longer than the run", "file": slow, "line": 6,
    }]);
    for words in [
        &["run", &slow, "--no-record", "--json"][..],
        &["check", &slow, "--json"],
        &["plan", &slow, "--json"],
    ] {
        let done = twin(words);
        assert_eq!((done.code, done.err.as_str()), (0, ""), "{words:?}");
        assert_eq!(json(&done.out)[0]["warnings"], expected, "{words:?}");
    }
    let plain = folder.file("plain.toml", SOUND);
    let done = twin(&["run", &plain, "--no-record", "--json"]);
    assert_eq!(json(&done.out)[0]["warnings"], serde_json::json!([]));
}

#[test]
fn strict_check_treats_warnings_as_errors() {
    let folder = Folder::new("strict");
    let slow = slow(&folder);
    let done = twin(&["check", &slow, "--strict"]);
    assert_eq!((done.code, done.out.as_str()), (2, ""));
    let message = "error: the lag is longer than the run [lag-beyond-run]";
    assert!(done.err.starts_with(message), "{}", done.err);
    let done = twin(&["check", &slow, "--strict", "--json"]);
    let checked = &json(&done.out)[0];
    assert_eq!((done.code, &checked["valid"]), (2, &false.into()));
    assert!(checked["error"].as_str().unwrap().starts_with(message));
    assert_eq!(checked["warnings"][0]["code"], "lag-beyond-run");
    let plain = folder.file("plain.toml", SOUND);
    assert_eq!(twin(&["check", &plain, "--strict"]).code, 0);
}

#[test]
fn key_set_twice_on_command_line_is_a_warning() {
    let folder = Folder::new("set-twice");
    let sound = folder.file("sound.toml", SOUND);
    let done = twin(&[
        "run",
        &sound,
        "--no-record",
        "--set",
        "seed=1",
        "--set",
        "seed=2",
    ]);
    assert_eq!(done.code, 0);
    assert!(done.out.contains("seed 2"), "{}", done.out);
    assert!(
        done.err.contains("warning[set-twice]: `seed` is set twice"),
        "{}",
        done.err
    );
    // `--plant` also sets a key.
    let done = twin(&[
        "check",
        &sound,
        "--plant",
        "toy",
        "--set",
        "plant.model=toy",
        "--json",
    ]);
    let warning = &json(&done.out)[0]["warnings"][0];
    assert_eq!(
        (&warning["code"], &warning["file"]),
        (&"set-twice".into(), &"--plant".into())
    );
}

#[test]
fn warning_is_shown_once_for_several_plants() {
    let folder = Folder::new("warned-once");
    let slow = slow(&folder);
    let out = folder.join("out");
    let words = [
        "run", &slow, "--plant", "toy", "--plant", "snapping", "--out", &out,
    ];
    let done = twin(&words);
    assert_eq!(done.err.matches("warning[").count(), 1, "{}", done.err);
}

/// The shipped scenarios are examples and have no warnings.
#[test]
fn shipped_scenarios_pass_the_strict_check() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios");
    for folder in [root.to_owned(), format!("{root}/thesis")] {
        let files = std::fs::read_dir(folder).unwrap();
        let paths = files.map(|file| file.unwrap().path());
        let paths = paths.filter(|path| path.extension().is_some_and(|kind| kind == "toml"));
        let scenarios: Vec<String> = paths.map(|path| path.display().to_string()).collect();
        let words: Vec<&str> = scenarios.iter().map(String::as_str).collect();
        let done = twin(&[&["check", "--strict"], &words[..]].concat());
        assert_eq!((done.code, done.err.as_str()), (0, ""));
    }
}

#[test]
fn long_run_and_large_recording_are_warnings() {
    let folder = Folder::new("warned-long");
    let scenario = folder.file("bob.toml", &SOUND.replace("1 s", "1e7 s"));
    let codes = |words: &[&str]| {
        let done = twin(&[&["check", &scenario, "--json"], words].concat());
        assert_eq!(done.code, 0, "{done:?}");
        let warnings = json(&done.out)[0]["warnings"].as_array().unwrap().clone();
        let codes = warnings.iter().map(|one| one["code"].as_str().unwrap());
        codes.map(str::to_owned).collect::<Vec<_>>()
    };
    // 5e9 observations of 83 bytes each; plant steps and control steps.
    assert_eq!(codes(&[]), ["long-run", "large-recording"]);
    assert_eq!(codes(&["--set", "record.signals=[]"]), ["long-run"]);
    assert_eq!(codes(&["--set", "duration=1e6 s"]), [""; 0]);
    let done = twin(&["check", &scenario]);
    assert!(done.err.contains("GB"), "{done:?}");
    assert!(done.err.contains("5.6 hours"), "{done:?}");
}

#[test]
fn gait_without_a_cycle_is_a_warning_unless_something_changes_it() {
    let trot = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/trot.toml");
    let codes = |settings: &[&str]| {
        let done = twin(&[&["check", trot, "--json"], settings].concat());
        let warnings = json(&done.out)[0]["warnings"].clone();
        warnings
            .as_array()
            .unwrap()
            .iter()
            .any(|it| it["code"] == "no-frequency")
    };
    let zero = ["--set", "controller.frequency=0 Hz"];
    assert!(codes(&zero));
    assert!(!codes(&["--set", "controller.frequency=0.1 Hz"]));
    let change = "change=[{ at = \"1 s\", set = \"frequency\", to = \"3 Hz\" }]";
    assert!(!codes(&[&zero[..], &["--set", change]].concat()));
}
