//! Fits to logs of an independent script, whose parameters are hidden.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use twinrig_document::Document;
use twinrig_experiment::{FitOutcome, FitRequest, fit};
use twinrig_record::{LogLimits, LogMapping, import_log};
use twinrig_rig::registry::Registry;
use twinrig_testing::python;

const MAPPING: &str = r#"
rows = "entries"
time = { column = "t", unit = "s" }

[[signal]]
name = "servo/position"
column = "position"
unit = "rad"

[[signal]]
name = "servo/command"
column = "goal"
unit = "rad"
group = "commanded"

[[signal]]
name = "servo/enable"
column = "enable"
unit = "1"
group = "commanded"
"#;

/// The bench of the script. The deviation is that of its noise and of a count.
const SPACE: &str = r#"
generations = 0
set = { plant.file = "xl330", override.load.mass = "0.49 kg", override.load.length = "10 cm", override.supply.voltage = "7.4 V", override.supply.resistance = "0 ohm", override.motor.heating.capacity = "1e6 J/K", override.motor.saturation_current = "1e9 A", override.gear.driving_square = 0, override.gear.static_driving = 0, override.gear.static_driven = 0, override.controller.gain = 800 }

[[residual]]
signal = "servo/position"
twin = "servo/reading"
deviation = "2.0487 mrad"
"#;

/// What the script prints.
#[derive(Deserialize)]
struct Trials {
    parameters: serde_json::Map<String, serde_json::Value>,
    trials: Vec<Trial>,
}

#[derive(Deserialize)]
struct Trial {
    /// Hidden parameters [SI].
    truth: Vec<f64>,
    /// Cramér–Rao bounds of their standard deviations [SI].
    bound: Vec<f64>,
}

/// A folder that is deleted at the end.
pub(crate) struct Folder(pub(crate) PathBuf);

impl Folder {
    pub(crate) fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("twinrig-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Writes the search space around the middle of the hidden parameters, which are within a quarter
/// of it.
fn space(folder: &Path, trials: &Trials) -> PathBuf {
    let scenario = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/servo.toml");
    let mut text = format!("scenario = {scenario:?}\n{SPACE}");
    for (key, middle) in &trials.parameters {
        let middle = middle.as_f64().unwrap();
        let (from, to) = (0.5 * middle, 2.0 * middle);
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "\n[[dimension]]\nkey = \"override.{key}\"\nfrom = \"{from:e} {unit}\"\n\
             to = \"{to:e} {unit}\"\nscale = \"logarithmic\"\n",
            unit = unit(key)
        );
    }
    let path = folder.join("space.toml");
    fs::write(&path, text).unwrap();
    path
}

fn unit(key: &str) -> &'static str {
    match key {
        "load.offset" => "rad",
        "motor.resistance" => "ohm",
        "motor.torque_constant" => "N·m/A",
        "motor.inertia" => "kg·m²",
        "friction.viscous" => "N·m·s/rad",
        "friction.coulomb" => "N·m",
        "controller.reading_delay" => "s",
        _ => "",
    }
}

/// Imports the log of a trial, and fits the twin to it.
fn fitted(folder: &Path, space: &Path, trial: usize) -> FitOutcome {
    let mapping = Document::parse("mapping.toml", MAPPING).unwrap();
    let mapping = LogMapping::read(&mapping).unwrap();
    let log = folder.join(format!("trial-{trial:03}.json"));
    let log = import_log(&log, &mapping, LogLimits::default()).unwrap();
    let recording = folder.join(format!("trial-{trial:03}.mcap"));
    log.write(BufWriter::new(File::create(&recording).unwrap()), "test")
        .unwrap();
    let request = FitRequest {
        recordings: vec![recording],
        space: space.to_owned(),
        settings: Vec::new(),
        validate: Vec::new(),
        profile: false,
        store: None,
        cross_validate: false,
        threads: std::thread::available_parallelism().map_or(1, usize::from),
    };
    fit(&Registry::standard(), &request, &mut |_| true).unwrap()
}

fn fits(count: usize, seed: u64) -> Option<(Trials, Vec<FitOutcome>)> {
    let python = python::python_of_peers("numpy")?;
    let folder = Folder::new("identification");
    let script =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/study/reference/servo_trials.py");
    let input = serde_json::json!({ "trials": count, "seed": seed });
    let printed = python::run(&python, &script, &[&folder.0], &input);
    let trials: Trials = serde_json::from_value(printed).unwrap();
    let space = space(&folder.0, &trials);
    let outcomes = (0..count).map(|trial| fitted(&folder.0, &space, trial));
    let outcomes = outcomes.collect();
    Some((trials, outcomes))
}

/// Number of intervals that hold the truth, for each parameter, and the ratios of the deviations to
/// their bounds, in order.
fn coverage(trials: &Trials, outcomes: &[FitOutcome]) -> (Vec<usize>, Vec<f64>) {
    let mut held = vec![0; trials.parameters.len()];
    let mut ratios = Vec::new();
    for (trial, outcome) in trials.trials.iter().zip(outcomes) {
        assert_eq!(outcome.unknown, Vec::new());
        for (index, found) in outcome.parameters.iter().enumerate() {
            let [low, high] = found.interval.unwrap();
            held[index] += usize::from((low..=high).contains(&trial.truth[index]));
            ratios.push((high - low) / (2.0 * 1.96 * trial.bound[index]));
        }
    }
    ratios.sort_by(f64::total_cmp);
    (held, ratios)
}

/// Returns the number of trials: 40, or that in `FIT_TRIALS`.
fn trial_count() -> usize {
    let set = std::env::var("FIT_TRIALS");
    set.map_or(40, |count| count.parse().unwrap())
}

/// Four standard deviations of a share of 95 %, if trials are independent of each other.
fn within(held: usize, of: usize) -> bool {
    let expected = 0.95 * of as f64;
    (held as f64 - expected).abs() < 4.0 * (0.05 * expected).sqrt()
}

/// Of 40 trials with 8 parameters 320 intervals, of 200 trials 1600: then 92.8 to 97.2 % hold the
/// truth.
#[test]
fn intervals_hold_the_hidden_parameters_as_often_as_they_say() {
    let Some((trials, outcomes)) = fits(trial_count(), 1) else {
        return;
    };
    let (held, ratios) = coverage(&trials, &outcomes);
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    let greatest = ratios[ratios.len() - 1];
    let names: Vec<_> = trials.parameters.keys().zip(&held).collect();
    println!("{names:?}, deviation over its bound: {mean:.3}, at most {greatest:.3}");
    let all: usize = held.iter().sum();
    assert!(within(all, ratios.len()), "{all} {names:?}");
    let each = held.iter();
    assert!(
        each.clone().all(|held| within(*held, outcomes.len())),
        "{names:?}"
    );
    // The bound is that of the truth, where a stop of the arm may be near to another place; the
    // deviation is that of the estimate.
    let beyond = ratios.iter().filter(|ratio| **ratio > 2.0).count();
    assert!(beyond <= ratios.len() / 500, "{beyond} {greatest}");
    // Autocorrelation of some 380 residuals, whose estimate is never below that of white ones.
    assert!((0.95..1.2).contains(&mean), "{mean}");
    for (trial, outcome) in trials.trials.iter().zip(&outcomes) {
        for (index, found) in outcome.parameters.iter().enumerate() {
            let error = (found.estimate - trial.truth[index]) / trial.bound[index];
            assert!(error.abs() < 6.0, "{error} {found:?}");
        }
        // White noise of the assumed deviation: 380 samples know it to 3.6 %.
        assert!((0.85..1.15).contains(&outcome.deviation), "{outcome:?}");
    }
}
