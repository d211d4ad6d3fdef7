//! MuJoCo in the place of a robot, whose parameters are hidden: `lcp` is fitted to one of its gaits
//! and predicts two others.

use std::fs;
use std::path::{Path, PathBuf};

use twinrig::scenario::Setting;
use twinrig::{Assembly, Execution, execute};
use twinrig_experiment::{FitOutcome, FitRequest, RecordingResidual, fit};
use twinrig_tests::scenarios;

/// Values of robots/cheetah-cub.toml, of which the robot differs by up to 20 %.
const PARAMETERS: [(&str, f64, &str); 8] = [
    ("trunk.mass", 0.9, "kg"),
    ("leg.aslp.diagonal.stiffness", 4400.0, "N/m"),
    ("leg.aslp.diagonal.preload", 3e-3, "m"),
    ("leg.aslp.parallel.stiffness", 1800.0, "N/m"),
    ("leg.aslp.parallel.preload", 3e-3, "m"),
    ("leg.aslp.joint_friction.ankle", 1e-3, "N·m·s/rad"),
    ("leg.aslp.mass.foot", 20e-3, "kg"),
    ("leg.aslp.mass.l3", 10e-3, "kg"),
];

/// Gaits by their frequency and step length: the first one is fitted.
const GAITS: [[&str; 2]; 3] = [
    ["3.64 Hz", "135.5 mm"],
    ["2.8 Hz", "90 mm"],
    ["4.2 Hz", "135.5 mm"],
];

/// Some 1.5 to 2 strides. Over longer times the engines differ by as much as the parameters make.
const HORIZON: &str = "0.5 s";

/// A folder that is deleted at the end.
struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Returns the settings of a draw: each parameter within 20 % of the file's value.
fn draw(number: u64) -> Vec<(String, String)> {
    // SplitMix64.
    let mut state = number.wrapping_mul(0x2545_f491_4f6c_dd1d);
    let mut share = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (mixed >> 11) as f64 / (1_u64 << 53) as f64
    };
    let drawn = PARAMETERS.iter().map(|(key, value, unit)| {
        let value = value * (0.8 + 0.4 * share());
        (format!("override.{key}"), format!("\"{value} {unit}\""))
    });
    drawn.collect()
}

/// Records a gait of MuJoCo's robot, at a step a fifth of which changes it by 3 %.
fn record(folder: &Path, gait: usize, truth: &[(String, String)]) -> PathBuf {
    let [frequency, step_length] = GAITS[gait].map(|value| format!("\"{value}\""));
    let horizon = format!("\"{HORIZON}\"");
    let of_gait = [
        ("plant.model", "\"mujoco\""),
        ("plant.step", "\"0.1 ms\""),
        ("duration", &horizon),
        ("controller.frequency", &frequency),
        ("controller.step_length", &step_length),
    ];
    let drawn = truth
        .iter()
        .map(|(key, value)| (key.as_str(), value.as_str()));
    let settings: Vec<_> = of_gait.into_iter().chain(drawn).collect();
    let text = fs::read_to_string(scenarios().join("trot.toml")).unwrap();
    let (text, _) = text.split_once("[[expect]]").unwrap();
    let registry = twinrig::registry();
    let settings = twinrig_tests::settings(&settings);
    let assembly = Assembly::builder(&registry).settings(&settings);
    let assembly = assembly.text("trot.toml", text, &scenarios()).unwrap();
    let recording = folder.join(format!("gait-{gait}.mcap"));
    let execution = Execution {
        recording: Some(recording.clone()),
        ..Execution::default()
    };
    execute(&assembly, &execution).unwrap();
    recording
}

fn fitted(recordings: &[PathBuf], space: PathBuf, settings: Vec<Setting>) -> FitOutcome {
    let request = FitRequest {
        recordings: recordings[..1].to_vec(),
        validate: recordings[1..].to_vec(),
        space,
        settings,
        cross_validate: false,
        profile: false,
        store: None,
        threads: std::thread::available_parallelism().map_or(1, usize::from),
    };
    fit(&twinrig::registry(), &request, &mut |_| true).unwrap()
}

/// Returns the root mean square of the errors of the signals of a gait, in their deviations of
/// scenarios/fits/trot.toml.
fn error(residuals: &[RecordingResidual], gait: usize, of: fn(&RecordingResidual) -> f64) -> f64 {
    let name = format!("gait-{gait}");
    let errors = residuals
        .iter()
        .filter(|it| it.recording == name)
        .map(|it| {
            let deviation = match it.signal.as_str() {
                "body/position.0" => 2e-3,
                "body/position.2" => 0.5e-3,
                signal if signal.starts_with("body/rpy") => 5e-3,
                _ => 10e-3,
            };
            of(it) / deviation
        });
    let errors: Vec<f64> = errors.collect();
    assert_eq!(errors.len(), 8);
    libm::sqrt(errors.iter().map(|error| error * error).sum::<f64>() / 8.0)
}

/// Writes a copy of scenarios/fits/trot.toml with other keys.
fn space(folder: &Path, name: &str, replaced: &[(&str, &str)]) -> PathBuf {
    let path = folder.join(name);
    let mut text = fs::read_to_string(scenarios().join("fits/trot.toml")).unwrap();
    let scenario = scenarios().join("trot.toml").display().to_string();
    text = text.replace("\"../trot.toml\"", &format!("{scenario:?}"));
    for (key, other) in replaced {
        assert!(text.contains(key), "{key}");
        text = text.replace(key, other);
    }
    fs::write(&path, text).unwrap();
    path
}

/// Errors of the gaits that were not fitted: with the values of the robot's file, with the fitted
/// ones, with the hidden ones.
fn predicted(number: u64, keys: &[(&str, &str)]) -> [[f64; 3]; 2] {
    let name = format!("twinrig-engines-fit-{}-{number}", std::process::id());
    let folder = Folder(std::env::temp_dir().join(name));
    fs::create_dir_all(&folder.0).unwrap();
    let truth = draw(number);
    let recordings = [0, 1, 2].map(|gait| record(&folder.0, gait, &truth));
    let found = fitted(&recordings, space(&folder.0, "fit.toml", keys), Vec::new());
    // All but one are held at the hidden values; nothing is fitted.
    let none = [
        ("generations = 15", "generations = 0"),
        ("steps = 25", "steps = 0"),
    ];
    let settings: Vec<_> = truth
        .iter()
        .map(|(key, value)| (key.as_str(), value.as_str()))
        .collect();
    let other = (
        "override.trunk.mass",
        "override.leg.aslp.joint_friction.hip",
    );
    let range = [
        ("\"0.63 kg\"", "\"0.9e-3 N·m·s/rad\""),
        ("\"1.17 kg\"", "\"1.1e-3 N·m·s/rad\""),
    ];
    let keys = [&none[..], &[other], &range].concat();
    let hidden = fitted(
        &recordings,
        space(&folder.0, "true.toml", &keys),
        twinrig_tests::settings(&settings),
    );
    [1, 2].map(|gait| {
        [
            error(&found.validation, gait, |it| it.unfitted.unwrap()),
            error(&found.validation, gait, |it| it.mean_absolute),
            error(&hidden.validation, gait, |it| it.unfitted.unwrap()),
        ]
    })
}

/// A fit from the robot's file, without a search of the start.
#[test]
fn fit_to_one_gait_of_another_engine_predicts_others() {
    let keys = [
        ("generations = 15", "generations = 0"),
        ("searches = 2", "searches = 1"),
    ];
    let gaits = predicted(1, &keys);
    for [before, after, hidden] in gaits {
        // The engines differ by `hidden`.
        assert!(before > 5.0 * after && after < 1.5 * hidden, "{gaits:.2?}");
    }
}

/// The draws of docs/how-well.md. Both errors are reduced by five in 13 of 20, as with the hidden
/// values themselves: in the others the robot's file is near to the truth already, beside what the
/// engines differ by.
#[test]
#[ignore = "40 minutes"]
fn fits_to_one_gait_of_another_engine_predict_others() {
    let mut reduced = 0;
    for number in 1..=20 {
        let gaits = predicted(number, &[]);
        println!("{number}: {gaits:.2?}");
        reduced += usize::from(gaits.iter().all(|[before, after, _]| *before > 5.0 * after));
    }
    assert!(reduced >= 13, "{reduced} of 20");
}
