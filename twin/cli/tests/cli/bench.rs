//! The tactile bench and sensors under feet: runs, replays, mistakes.

use std::path::Path;

use crate::common::{Folder, json, twin};

fn scenario(name: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
    std::fs::read_to_string(root.join(name)).unwrap()
}

/// Writes a scenario with some texts replaced, and returns its path.
fn changed(folder: &Folder, name: &str, changes: &[(&str, &str)]) -> String {
    let mut text = scenario(name);
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    folder.file("changed.toml", &text)
}

/// The error of a scenario with one text in place of another.
fn refused(name: &str, from: &str, to: &str) -> String {
    let folder = Folder::new("refused");
    let path = changed(&folder, name, &[(from, to)]);
    let done = twin(&["check", &path]);
    assert_eq!(done.code, 2, "{}", done.out);
    (done.out + &done.err).replace(&path, "changed.toml")
}

const SHORT: (&str, &str) = ("duration = \"8 s\"", "duration = \"700 ms\"");
const SHORT_FOOT: (&str, &str) = ("duration = \"10 s\"", "duration = \"400 ms\"");

/// Runs the start of a scenario twice and replays it without the files of bench and sensor; the
/// fingerprints are equal.
fn repeats(test: &str, name: &str, changes: &[(&str, &str)]) {
    let folder = Folder::new(test);
    let mut text = scenario(name);
    // Expectations begin later.
    text.truncate(text.find("[[expect]]").unwrap());
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    let path = folder.file("start.toml", &text);
    let run = |out: &str| {
        let done = twin(&["run", &path, "--json", "--out", &folder.join(out)]);
        assert_eq!(done.code, 0, "{done:?}");
        json(&done.out)[0]["fingerprint"]
            .as_str()
            .unwrap()
            .to_owned()
    };
    let fingerprint = run("first");
    assert_eq!(fingerprint, run("second"));
    let recording = std::fs::read_dir(folder.join("first")).unwrap().next();
    let recording = recording.unwrap().unwrap().path().display().to_string();
    let done = twin(&["replay", &recording, "--json"]);
    assert_eq!(done.code, 0, "{done:?}");
    assert_eq!(json(&done.out)[0]["fingerprint"], fingerprint.as_str());
}

#[test]
fn bench_is_deterministic_and_replayed_without_its_file() {
    let without_change = (
        "[[change]]\nat = \"4 s\"\nset = \"frequency\"\nto = \"4.2 Hz\"\n",
        "",
    );
    repeats("bench", "bench.toml", &[SHORT, without_change]);
}

#[test]
fn sensor_under_a_foot_is_replayed_without_its_file() {
    repeats("foot", "trot-foot-load.toml", &[SHORT_FOOT]);
}

#[test]
fn bench_without_a_requested_voltage_computes_no_sensor() {
    let folder = Folder::new("left-out");
    let path = folder.file(
        "stall.toml",
        &scenario("bench-stall.toml").replace("[observe]", "[record]\nsignals = []\n[observe]"),
    );
    let done = twin(&["plan", &path]);
    assert_eq!(done.code, 0, "{done:?}");
    assert!(
        done.out.contains("bench/force/piezoelectric"),
        "{}",
        done.out
    );
}

#[test]
fn unknown_bench_is_reported_with_the_known_ones() {
    let error = refused("bench.toml", "file = \"tactile\"", "file = \"tactle\"");
    assert!(error.contains("there is no bench `tactle`"), "{error}");
    assert!(error.contains("did you mean `tactile`?"), "{error}");
}

#[test]
fn unknown_sensor_is_reported_at_its_place() {
    let error = refused(
        "trot-foot-load.toml",
        "sensor = \"tactile\"",
        "sensor = \"skin\"",
    );
    assert!(error.contains("there is no sensor `skin`"), "{error}");
    assert!(error.contains("changed.toml:33:10"), "{error}");
}

#[test]
fn load_beyond_the_reference_cell_is_reported() {
    let error = refused(
        "bench.toml",
        "file = \"tactile\"",
        "file = \"tactile\"\ncam = \"30 mm\"",
    );
    let expected = "a load of 70.67 N saturates the reference cell of 50 N";
    assert!(error.contains(expected), "{error}");
}

#[test]
fn negative_deviation_of_a_filter_is_reported_at_its_place() {
    let error = refused("bench.toml", "noise = \"20 mV\"", "noise = \"-20 mV\"");
    assert!(error.contains("`noise` is -0.02 V"), "{error}");
    assert!(error.contains("changed.toml:51:24"), "{error}");
}

#[test]
fn filter_that_requires_a_frequency_is_refused_without_one() {
    let error = refused(
        "trot-foot-load.toml",
        "frequency.signal = \"leg/LF/frequency\"\n",
        "",
    );
    let expected = "`filter.thesis`: model F2 requires a measured frequency";
    assert!(error.contains(expected), "{error}");
}

#[test]
fn frequency_that_the_controller_does_not_write_is_an_error() {
    let folder = Folder::new("unwritten");
    let path = changed(
        &folder,
        "trot-foot-load.toml",
        &[("frequency_of = \"LF\"\n", "")],
    );
    let done = twin(&["run", &path, "--no-record"]);
    assert_eq!(done.code, 2);
    assert!(done.err.contains("leg/LF/frequency"), "{}", done.err);
}

#[test]
fn name_of_another_signal_is_refused_for_a_filter() {
    let error = refused("bench.toml", "[bus.filter.estimate]", "[bus.filter.rate]");
    let expected = "`bench/force/rate` is another signal";
    assert!(error.contains(expected), "{error}");
}

#[test]
fn cable_of_a_sensor_can_only_be_unplugged() {
    let fault = "on = \"wire/tactile/piezoelectric\"\nkind = \"unplug\"";
    let flip = "on = \"wire/tactile/piezoelectric\"\nkind = \"stuck\"";
    let error = refused("bench-faults.toml", fault, flip);
    assert!(error.contains("can be unplugged only"), "{error}");
}

#[test]
fn reference_cell_is_also_read_by_a_phidget_bridge() {
    let folder = Folder::new("phidget");
    let path = folder.file(
        "phidget.toml",
        r#"
duration = "500 ms"
plant = { model = "bench", file = "tactile" }
[[bus]]
kind = "phidget"
inputs.0 = { signal = "bench/force", scale = 4e-5 }
[[expect]]
signal = { name = "phidget/reports", eventually = { min = 50 } }
[[expect]]
signal = { name = "phidget/overloaded", always = { max = 0 } }
"#,
    );
    let done = twin(&["run", &path, "--no-record"]);
    assert_eq!(done.code, 0, "{done:?}");
}

/// Runs bench.toml with another calibration of the estimate, and returns which expectations on its
/// error hold.
fn errors_with(calibration: &str) -> [bool; 2] {
    let folder = Folder::new(&format!("calibrated-{calibration}"));
    let path = changed(
        &folder,
        "bench.toml",
        &[(
            "calibration = \"tactile-1\"",
            &format!("calibration = \"{calibration}\""),
        )],
    );
    let done = twin(&["run", &path, "--no-record", "--json"]);
    let report = &json(&done.out)[0];
    let expectations = report["expectations"].as_array().unwrap();
    [
        "error of the estimate at 2 Hz",
        "error of the estimate at 4.2 Hz",
    ]
    .map(|name| {
        let found = expectations.iter().find(|it| it["name"] == name).unwrap();
        found["verdict"] == "pass"
    })
}

/// The estimate meets the demand by what was measured of this cell, not by constants that plant and
/// filter share: with those of another cell it does not.
#[test]
fn error_is_below_the_demand_with_the_calibration_of_this_cell_only() {
    assert_eq!(errors_with("tactile-1"), [true, true]);
    for other in ["tactile-2", "tactile-3", "tactile-4"] {
        assert_eq!(errors_with(other), [false, false], "{other}");
    }
}

#[test]
fn unknown_calibration_is_reported_with_the_known_ones() {
    let error = refused(
        "bench.toml",
        "calibration = \"tactile-1\"",
        "calibration = \"tactile-9\"",
    );
    assert!(
        error.contains("there is no calibration `tactile-9`"),
        "{error}"
    );
    assert!(error.contains("twin cell calibrate"), "{error}");
}

#[test]
fn constant_beside_a_calibration_is_refused() {
    let error = refused(
        "bench.toml",
        "piezoelectric.noise = \"5 mV\"\nprocess",
        "piezoelectric = { noise = \"5 mV\", gain = \"0.05 V·s/N\" }\nprocess",
    );
    let expected = "`piezoelectric.gain` is that of the calibration";
    assert!(error.contains(expected), "{error}");
}

#[test]
fn invalid_calibration_is_reported_at_its_place() {
    let folder = Folder::new("bad-calibration");
    let good = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../calibrations/tactile-1.toml");
    let good = std::fs::read_to_string(good).unwrap();
    for (from, to, expected) in [
        ("floor = ", "flor = ", "unknown key `flor`"),
        ("switch = \"10", "switch = \"-10", "`switch` is -10"),
        (
            "amplifier_time = \"102",
            "amplifier_time = \"-102",
            "`amplifier_time` is -0.102",
        ),
        ("seed = 1001\n", "", "`seed` is missing"),
    ] {
        assert!(good.contains(from), "{from}");
        let file = folder.file("mine.toml", &good.replacen(from, to, 1));
        let calibration = format!("calibration = \"{file}\"");
        let path = changed(
            &folder,
            "bench.toml",
            &[("calibration = \"tactile-1\"", &calibration)],
        );
        let done = twin(&["check", &path]);
        assert_eq!(done.code, 2, "{}", done.out);
        assert!(
            (done.out.clone() + &done.err).contains(expected),
            "{} {}",
            done.out,
            done.err
        );
    }
}

#[test]
fn numbered_cell_of_a_sensor_without_spread_is_refused() {
    let folder = Folder::new("no-spread");
    let bench = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../benches/tactile.toml");
    let bench = std::fs::read_to_string(bench).unwrap();
    let spread = bench
        .lines()
        .find(|line| line.starts_with("spread"))
        .unwrap();
    let file = folder.file("mine.toml", &bench.replacen(spread, "", 1));
    let path = changed(
        &folder,
        "bench.toml",
        &[("file = \"tactile\"", &format!("file = \"{file}\""))],
    );
    let done = twin(&["check", &path]);
    assert_eq!(done.code, 2, "{}", done.out);
    assert!(
        (done.out + &done.err).contains("has no `spread`"),
        "{}",
        done.err
    );
}
