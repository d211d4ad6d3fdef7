//! `twin cell`: design of piezoresistive cells.

use crate::common::{Done, Folder, json, twin};

const FOOT: &[&str] = &["--type", "B", "--layers", "2", "--glue", "yes"];

fn predict(rest: &[&str]) -> Done {
    twin(&[&["cell", "predict"], FOOT, rest].concat())
}

#[test]
fn tables_are_recomputed_beside_the_printed_ones() {
    let done = twin(&["cell", "fit"]);
    assert_eq!((done.code, done.err.as_str()), (0, ""));
    insta::assert_snapshot!(done.out);
}

#[test]
fn foot_cell_is_predicted_with_intervals() {
    let done = predict(&["--length", "20mm", "--width", "25mm"]);
    assert_eq!((done.code, done.err.as_str()), (0, ""));
    insta::assert_snapshot!(done.out);
}

#[test]
fn dimensions_of_the_text_leave_the_tested_range() {
    let done = predict(&["--length", "2 cm", "--width", "3 cm"]);
    assert_eq!((done.code, done.err.as_str()), (0, ""));
    let warning = "the width, 30 mm, is outside the tested range of 5 to 29 mm: extrapolated";
    assert!(done.out.contains(warning), "{}", done.out);
    let done = predict(&["--length", "3 cm", "--width", "2 cm", "--json"]);
    let report = &json(&done.out)[0];
    let warning = "the length, 30 mm, is outside the tested range of 8 to 29 mm: extrapolated";
    assert_eq!(report["warnings"][0], warning);
    assert_eq!(report["warnings"].as_array().unwrap().len(), 1);
}

#[test]
fn layers_between_the_levels_are_reported() {
    let words = [
        "--layers", "4", "--glue", "no", "--length", "8 mm", "--width", "29 mm",
    ];
    let done = twin(&[&["cell", "predict", "--type", "a", "--json"], &words[..]].concat());
    let report = &json(&done.out)[0];
    let warning = "the number of layers, 4, is between the tested levels 2 and 6: interpolated";
    assert_eq!(report["warnings"], serde_json::json!([warning]));
}

#[test]
fn amplifier_options_scale_the_output() {
    let size = ["--length", "20 mm", "--width", "25 mm", "--json"];
    let volts = |rest: &[&str]| {
        let report = &json(&predict(&[&size[..], rest].concat()).out)[0];
        report["amplifier"]["at_20_n_v"]["value"].as_f64().unwrap()
    };
    let (once, twice) = (volts(&[]), volts(&["--reference", "0.5 V"]));
    // Eq. 4.2 is proportional to the reference, and V/V_ref − 1 to the feedback.
    assert!((twice - 2.0 * once).abs() < 1e-12);
    let double = volts(&["--feedback", "150 kohm"]);
    assert!((double / 0.25 - 1.0 - 2.0 * (once / 0.25 - 1.0)).abs() < 1e-12);
}

#[test]
fn models_are_printed_for_programs() {
    let done = twin(&["cell", "fit", "--json"]);
    let report = &json(&done.out)[0];
    assert_eq!(report["cells"].as_array().unwrap().len(), 16);
    assert_eq!(
        report["aliased"][0],
        serde_json::json!(["Length·Width", "Glue·Shape"])
    );
    let models = report["models"].as_array().unwrap();
    let same = models
        .iter()
        .map(|of| of["elimination"]["same"].as_bool().unwrap());
    assert_eq!(same.collect::<Vec<_>>(), [false, true, false]);
    // Tables have four digits, p-values of whole models three.
    assert!(
        models
            .iter()
            .all(|of| of["difference"].as_f64().unwrap() < 1e-3)
    );
}

#[test]
fn impossible_cells_are_errors() {
    let size = ["--length", "20 mm", "--width", "25 mm"];
    let reject = |words: &[&str]| {
        let done = twin(&[&["cell", "predict"], words].concat());
        assert_eq!(done.code, 2, "{}", done.out);
        done.err
    };
    for wrong in [
        ["--type", "C", "--layers", "2", "--glue", "yes"],
        ["--type", "A", "--layers", "0", "--glue", "yes"],
        ["--type", "A", "--layers", "2", "--glue", "maybe"],
    ] {
        reject(&[&wrong[..], &size].concat());
    }
    let message = reject(&[FOOT, &["--length", "0 mm", "--width", "25 mm"]].concat());
    assert!(message.contains("it must be positive"), "{message}");
    let message = reject(&[FOOT, &["--length", "20 N", "--width", "25 mm"]].concat());
    assert!(message.contains("a length"), "{message}");
}

fn root(name: &str) -> String {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    root.join(name).display().to_string()
}

/// The calibrations of the scenarios are what the command writes, with another seed than theirs.
#[test]
fn calibration_of_the_bench_is_that_of_its_run() {
    let folder = Folder::new("calibrate");
    let file = folder.join("cell.toml");
    let scenario = root("scenarios/thesis/fig-4-11.toml");
    let words = ["cell", "calibrate", &scenario, "--output", &file];
    let set = ["--set", "plant.cell=1", "--set", "seed=1001"];
    let done = twin(&[&words[..], &set].concat());
    assert_eq!(done.code, 0, "{}", done.err);
    let written = std::fs::read_to_string(&file).unwrap();
    let kept = std::fs::read_to_string(root("calibrations/tactile-1.toml")).unwrap();
    assert_eq!(written, kept);
}

#[test]
fn scenario_without_a_tactile_bus_cannot_be_calibrated() {
    let done = twin(&["cell", "calibrate", &root("scenarios/stand.toml")]);
    assert_eq!((done.code, done.out.as_str()), (2, ""));
    assert!(done.err.contains("no tactile bus"), "{}", done.err);
}

#[test]
fn filters_are_compared_with_the_calibration_of_the_cell_and_with_that_of_the_design() {
    let (scenario, identify) = (
        root("scenarios/bench.toml"),
        root("scenarios/thesis/fig-4-11.toml"),
    );
    let words = ["cell", "compare", &scenario, "--identify", &identify];
    let done = twin(&[&words[..], &["--cells", "1", "--json"]].concat());
    assert_eq!(done.code, 0, "{}", done.err);
    let report = &json(&done.out)[0];
    let met = |calibration: &str, filter: &str| {
        let mut shares = report["shares"].as_array().unwrap().iter();
        let of =
            |it: &&serde_json::Value| it["calibration"] == calibration && it["filter"] == filter;
        shares.find(of).unwrap()["met"].as_u64().unwrap()
    };
    assert_eq!([met("own", "estimate"), met("common", "estimate")], [1, 0]);
    for filter in ["F1", "F2", "F3"] {
        assert_eq!(
            [met("own", filter), met("common", filter)],
            [0, 0],
            "{filter}"
        );
    }
}
