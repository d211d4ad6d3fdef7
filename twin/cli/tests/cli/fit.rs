//! Fits of twins to recordings of runs whose parameters are known.

use std::fmt::Write;
use std::fs;

use serde_json::Value;

use crate::common::{Folder, json, twin};

const SCENARIO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/servo.toml");

/// Delay of readings, in whole periods of the controller: a reading and a position of one instant
/// then differ by the counts alone.
const DELAY: &str = "override.controller.reading_delay=\"5 ms\"";
/// Friction that shows beside the counts.
const COULOMB: &str = "override.friction.coulomb=\"5 mN·m\"";

/// Returns the recording of the servo's scenario.
fn recording(folder: &Folder) -> String {
    let out = folder.join("recorded");
    let done = twin(&[
        "run", SCENARIO, "--set", DELAY, "--set", COULOMB, "--out", &out,
    ]);
    assert_eq!(done.code, 0, "{}", done.err);
    let mut files = fs::read_dir(out).unwrap();
    files.next().unwrap().unwrap().path().display().to_string()
}

/// Writes a search space without a search of the start; a dimension is a key and its range.
fn space(folder: &Folder, dimensions: &[(&str, &str, &str)]) -> String {
    let mut text = format!(
        "scenario = {SCENARIO:?}\ngenerations = 0\n\n[[residual]]\nsignal = \"servo/position\"\n\
         twin = \"servo/reading\"\ndeviation = \"1 mrad\"\n"
    );
    for (key, from, to) in dimensions {
        let keys = format!("key = \"override.{key}\"\nfrom = \"{from}\"\nto = \"{to}\"");
        let _ = write!(text, "\n[[dimension]]\n{keys}\nscale = \"logarithmic\"\n");
    }
    let path = folder.join("space.toml");
    fs::write(&path, text).unwrap();
    path
}

const FOUR: [(&str, &str, &str); 4] = [
    ("motor.resistance", "2.6 ohm", "4 ohm"),
    ("motor.inertia", "9 kg·cm²", "18 kg·cm²"),
    ("friction.coulomb", "2 mN·m", "10 mN·m"),
    ("controller.reading_delay", "1 ms", "12 ms"),
];

/// Without noise the estimates are the truth: a command or a reading that were a step of the
/// controller off would show in the delay. With the counts of the encoder they are near it: an arm
/// at rest has a constant error of up to half a count.
#[test]
fn parameters_of_a_recorded_twin_are_found() {
    let folder = Folder::new("fit");
    let (recording, out) = (recording(&folder), folder.join("out"));
    let space = space(&folder, &FOUR);
    let words = [
        "fit", &recording, "--space", &space, "--out", &out, "--json",
    ];
    let number = |value: &Value| value.as_f64().unwrap();
    let fitted = |most: f64| {
        let done = twin(&words);
        assert_eq!((done.code, done.err.as_str()), (0, ""), "{}", done.out);
        let found = object(&done.out);
        // benches/xl330.toml, `COULOMB` and `DELAY`.
        let truths = [3.4, 14.47e-4, 5e-3, 5e-3];
        for (parameter, truth) in found["parameters"].as_array().unwrap().iter().zip(truths) {
            let error = number(&parameter["estimate"]) / truth - 1.0;
            assert!(error.abs() < most, "{error} {parameter}");
            let [low, high] = [0, 1].map(|end| number(&parameter["interval"][end]));
            assert!(high - low < 0.1 * truth, "{parameter}");
        }
        assert_eq!(found["unknown"], Value::Array(Vec::new()));
        found
    };
    let found = fitted(0.02);
    // Counts are 1.534 mrad apart: an even distribution within half of that has a deviation of
    // 0.443 mrad, one at rest up to 0.767 mrad.
    let residual = number(&found["recordings"][0]["rms"]);
    assert!((3e-4..7e-4).contains(&residual), "{residual}");
    let counts = fs::read_to_string(&space).unwrap();
    let exact = counts.replace("signal = \"servo/position\"", "signal = \"servo/reading\"");
    fs::write(&space, exact).unwrap();
    // The controller's counts make the twin a function in steps: 2e-4.
    let found = fitted(1e-3);
    let parameters = found["parameters"].as_array().unwrap();

    // The overlay makes the bench that was fitted.
    let overlay = fs::read_to_string(folder.join("out/space.fit.toml")).unwrap();
    assert!(overlay.contains("\nmotor.resistance = \"3."), "{overlay}");
    assert!(overlay.contains("\ndate = 20"), "{overlay}");
    let bench = concat!(env!("CARGO_MANIFEST_DIR"), "/../../benches/xl330.toml");
    let bench = fs::read_to_string(bench).unwrap();
    let including = format!("include = \"space.fit.toml\"\n{bench}");
    fs::write(folder.join("out/own.toml"), including).unwrap();
    let own = format!("plant.file={:?}", folder.join("out/own.toml"));
    let fingerprint = |settings: &[&str]| {
        let words = [&["run", SCENARIO, "--no-record", "--json"], settings].concat();
        object(&twin(&words).out)["fingerprint"].clone()
    };
    let values = parameters.iter().map(|it| {
        let key = it["key"].as_str().unwrap();
        format!("{key}={}", it["toml"].as_str().unwrap())
    });
    let values: Vec<String> = values.collect();
    let set: Vec<&str> = values
        .iter()
        .flat_map(|it| ["--set", it.as_str()])
        .collect();
    assert_eq!(fingerprint(&["--set", &own]), fingerprint(&set));
    assert_ne!(fingerprint(&set), fingerprint(&[]));

    // The mass of the bench is not among those of the data.
    let plan = || twin(&["plan", SCENARIO, "--set", &own]);
    assert!(!plan().err.contains("beyond-fit"));
    let data = "\n[fit.data]\nload.mass = [\"500 g\", \"0.6 kg\"]\n";
    fs::write(folder.join("out/space.fit.toml"), overlay + data).unwrap();
    let planned = plan();
    assert_eq!(planned.code, 0);
    let shown = planned.out + &planned.err;
    assert!(
        shown.contains("beyond-fit") && shown.contains("from 500 g to 0.6 kg"),
        "{shown}"
    );
}

/// One parameter is held at its true value; another motion shows the same bench. What was searched
/// is not searched again.
#[test]
fn fit_predicts_other_recordings_and_continues_with_the_searches_that_are_done() {
    let folder = Folder::new("fit-validate");
    let (recording, out) = (recording(&folder), folder.join("out"));
    let other = folder.join("other");
    let done = twin(&[
        "run",
        SCENARIO,
        "--set",
        DELAY,
        "--set",
        COULOMB,
        "--out",
        &other,
        "--set",
        "controller.amplitude=\"0.6 rad\"",
    ]);
    // It does not lift the arm as far as the scenario expects.
    assert_eq!(done.code, 1, "{}", done.err);
    let mut files = fs::read_dir(&other).unwrap();
    let other = files.next().unwrap().unwrap().path().display().to_string();
    let space = space(&folder, &FOUR);
    let words = [
        "fit",
        &recording,
        "--space",
        &space,
        "--out",
        &out,
        "--json",
        "--profile",
        "--validate",
        &other,
        "--set",
        "override.motor.resistance=\"3.4 ohm\"",
    ];
    let first = twin(&words);
    assert_eq!((first.code, first.err.as_str()), (0, ""), "{}", first.out);
    let found = object(&first.out);
    let number = |value: &Value| value.as_f64().unwrap();
    let parameters = found["parameters"].as_array().unwrap();
    assert_eq!(parameters.len(), 3, "{found}");
    for it in parameters {
        let [low, high] = [0, 1].map(|end| number(&it["interval"][end]));
        let profile = [0, 1].map(|end| number(&it["profile"][end]));
        // Counts make the cost rough.
        let ratio = (profile[1] - profile[0]) / (high - low);
        assert!((0.5..2.0).contains(&ratio), "{it}");
        assert!(profile[0] < number(&it["estimate"]) && number(&it["estimate"]) < profile[1]);
    }
    let predicted = &found["validation"][0];
    let [fitted, unfitted] = ["mean_absolute", "unfitted"].map(|key| number(&predicted[key]));
    assert!(fitted < 1e-3 && unfitted > 5.0 * fitted, "{predicted}");

    let again = twin(&words);
    assert_eq!(again.out, first.out);
    assert!(
        again.err.contains("searches that were done before: 1"),
        "{}",
        again.err
    );
    // Of two searches one is there, as after an interrupt; the second is cut off.
    let text = fs::read_to_string(&space).unwrap();
    fs::write(&space, format!("searches = 2\n{text}")).unwrap();
    let two = twin(&words);
    assert_eq!(two.err, again.err);
    let store = folder.join("out/searches/all.jsonl");
    let rows = fs::read_to_string(&store).unwrap();
    assert_eq!(rows.lines().count(), 2);
    fs::write(&store, &rows[..rows.len() - 20]).unwrap();
    assert_eq!(twin(&words).out, two.out);
    assert_eq!(fs::read_to_string(&store).unwrap(), rows);
    fs::write(&space, text).unwrap();
    // A comment changes nothing; another value that is held, and another deviation, do.
    let text = fs::read_to_string(&space).unwrap();
    fs::write(&space, format!("# Again.\n{text}")).unwrap();
    assert_eq!(twin(&words).err, again.err);
    let mut other = words;
    other[words.len() - 1] = "override.motor.resistance=\"3.5 ohm\"";
    assert_eq!(twin(&other).err, "");
    fs::write(&space, text.replace("1 mrad", "1.1 mrad")).unwrap();
    assert_eq!(twin(&words).err, "");
    let all = FOUR.map(|(key, from, _)| format!("override.{key}={from:?}"));
    let held: Vec<&str> = all.iter().flat_map(|it| ["--set", it.as_str()]).collect();
    let error = twin(&[&words[..6], &held].concat()).err;
    assert!(error.contains("no dimension is left to fit"), "{error}");
}

/// The height of a robot shows its mass.
#[test]
fn element_of_a_vector_is_compared() {
    let folder = Folder::new("fit-element");
    let trot = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/trot.toml");
    let text = fs::read_to_string(trot).unwrap();
    let (head, _) = text.split_once("[[expect]]").unwrap();
    let scenario = folder.join("trot.toml");
    fs::write(&scenario, head.replace("\"20 s\"", "\"0.4 s\"")).unwrap();
    let recorded = folder.join("recorded");
    let done = twin(&["run", &scenario, "--out", &recorded]);
    assert_eq!(done.code, 0, "{}", done.err);
    let mut files = fs::read_dir(&recorded).unwrap();
    let recording = files.next().unwrap().unwrap().path().display().to_string();
    let fitted = |component: &str| {
        let space = folder.join("mass.toml");
        let text = format!(
            "scenario = \"trot.toml\"\ngenerations = 0\n[[residual]]\n\
             signal = \"body/position\"\n{component}\ndeviation = \"1 mm\"\n[[dimension]]\n\
             key = \"override.trunk.mass\"\nfrom = \"0.6 kg\"\nto = \"1.1 kg\"\n"
        );
        fs::write(&space, text).unwrap();
        let out = folder.join("out");
        twin(&[
            "fit", &recording, "--space", &space, "--out", &out, "--json",
        ])
    };
    let found = object(&fitted("component = \"z\"").out);
    let mass = found["parameters"][0]["estimate"].as_f64().unwrap();
    // robots/cheetah-cub.toml; the error is that of the tolerance of the plant.
    assert!((mass - 0.9).abs() < 1e-3, "{found}");
    assert_eq!(found["recordings"][0]["signal"], "body/position.2");
    for component in ["", "component = 3"] {
        let error = fitted(component).out;
        assert!(error.contains("has 3 component(s)"), "{error}");
    }
}

#[test]
fn product_of_two_parameters_is_named_as_what_the_recording_cannot_tell() {
    let folder = Folder::new("fit-unknown");
    let recording = recording(&folder);
    let pair = [
        ("controller.gain", "400", "1600"),
        ("controller.duty_per_count", "2e-6", "8e-6"),
        ("motor.inertia", "12 kg·cm²", "22 kg·cm²"),
    ];
    let space = space(&folder, &pair);
    let out = folder.join("out");
    let words = [
        "fit", &recording, "--space", &space, "--out", &out, "--json",
    ];
    let found = object(&twin(&words).out);
    let unknown = found["unknown"].as_array().unwrap();
    assert_eq!(unknown.len(), 1, "{found}");
    let parts = unknown[0]["parts"].as_array().unwrap();
    let keys: Vec<&str> = parts.iter().map(|part| part[0].as_str().unwrap()).collect();
    assert!(
        keys.len() == 2 && keys.iter().all(|key| key.contains("controller.")),
        "{keys:?}"
    );
    let parameters = found["parameters"].as_array().unwrap();
    let is_known = |index: usize| !parameters[index]["interval"].is_null();
    assert_eq!([0, 1, 2].map(is_known), [false, false, true], "{found}");
}

#[test]
fn mistakes_are_reported_before_the_search() {
    let folder = Folder::new("fit-mistakes");
    let recording = recording(&folder);
    let out = folder.join("out");
    let refused = |recordings: &[&str], space: &str| {
        let words = [&["fit", "--space", space, "--out", &out], recordings].concat();
        let done = twin(&words);
        assert_eq!(done.code, 2, "{}", done.out);
        done.err
    };
    let sound = space(&folder, &FOUR);
    let copy = folder.join("copy.mcap");
    fs::copy(&recording, &copy).unwrap();
    assert!(refused(&[&recording, &copy], &sound).contains("copy.mcap is given twice"));
    let text = fs::read_to_string(&sound).unwrap();
    let changed = |from: &str, to: &str| {
        let path = folder.join("changed.toml");
        fs::write(&path, text.replace(from, to)).unwrap();
        refused(&[&recording], &path)
    };
    let error = changed("signal = \"servo/position\"", "signal = \"servo/positon\"");
    assert!(error.contains("did you mean `servo/position`?"), "{error}");
    let error = changed("twin = \"servo/reading\"", "twin = \"servo/readin\"");
    assert!(error.contains("`servo/reading`"), "{error}");
    // An end of a range that the bench does not accept.
    let error = changed("to = \"10 mN·m\"", "to = \"200 N·m\"");
    assert!(
        error.contains("coulomb") && error.contains("200"),
        "{error}"
    );
    let alone = [
        "fit",
        &recording,
        "--space",
        &sound,
        "--out",
        &out,
        "--cross-validate",
    ];
    assert!(twin(&alone).err.contains("there are none to fit"));
    let by_mass = folder.join("by_mass.toml");
    fs::write(&by_mass, format!("leave_out = \"load.mass\"\n{text}")).unwrap();
    let error = twin(&[
        "fit",
        &recording,
        "--space",
        &by_mass,
        "--out",
        &out,
        "--cross-validate",
    ])
    .err;
    assert!(error.contains("does not state `load.mass`"), "{error}");
    let both = "set = { override.friction.coulomb = \"0 N·m\" }\ngenerations = 0";
    let error = changed("generations = 0", both);
    assert!(error.contains("is set for all runs, by `set`"), "{error}");
    let error = changed("deviation = \"1 mrad\"", "deviation = \"1 mm\"");
    assert!(error.contains("`deviation` of `servo/position`"), "{error}");
    let start = "[[start]]\nstate = \"servo/angle\"\nsignal = \"servo/position\"\nminus = \"1 kg\"\n\n\
                 [[residual]]";
    let error = changed("[[residual]]", start);
    assert!(error.contains("`minus` of `servo/position`"), "{error}");
}

/// Returns the one object of an output.
fn object(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|_| json(text)[0].clone())
}
