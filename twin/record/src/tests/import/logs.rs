//! Logs of real servos, in the folder that `SERVO_LOGS` names: every number of a recording is that
//! of the log, read here by `serde_json`, after the conversion that the mapping states.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use flate2::read::GzDecoder;
use serde_json::Value;
use twinrig_record::{LogLimits, LogMapping, import_log};

use super::{mapping, recorded, series};

/// Returns the logs in a folder of the logs; none without the variable.
fn logs(folder: &str) -> Vec<PathBuf> {
    let Some(root) = std::env::var_os("SERVO_LOGS") else {
        println!("skipped: no logs");
        return Vec::new();
    };
    let entries = fs::read_dir(Path::new(&root).join(folder)).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    let is_log = |path: &PathBuf| {
        let name = path.to_string_lossy();
        name.ends_with(".json") || name.ends_with(".json.gz")
    };
    let mut paths: Vec<PathBuf> = paths.filter(is_log).collect();
    paths.sort();
    assert!(!paths.is_empty());
    paths
}

fn json(path: &Path) -> Value {
    let bytes = fs::read(path).unwrap();
    if path.extension().is_some_and(|extension| extension == "gz") {
        let mut text = String::new();
        GzDecoder::new(&bytes[..])
            .read_to_string(&mut text)
            .unwrap();
        return serde_json::from_str(&text).unwrap();
    }
    serde_json::from_slice(&bytes).unwrap()
}

fn number(value: &Value) -> f64 {
    match value {
        Value::Bool(value) => f64::from(u8::from(*value)),
        value => value.as_f64().unwrap(),
    }
}

/// Conversion of a column, written independently of the mapping.
type Convert = fn(f64) -> f64;

const SAME: Convert = |number| number;
const COMMON: [(&str, &str, Convert); 6] = [
    ("servo/position", "position", SAME),
    ("servo/rate", "speed", SAME),
    ("servo/supply", "input_volts", SAME),
    ("servo/temperature", "temp", |celsius| celsius + 273.15),
    ("servo/command", "goal_position", SAME),
    ("servo/enable", "torque_enable", SAME),
];

fn check(path: &Path, mapping: &LogMapping, more: &[(&str, &str, Convert)]) {
    let name = path.display();
    let log = import_log(path, mapping, LogLimits::default());
    let log = log.unwrap_or_else(|error| panic!("{error}"));
    let (recording, source) = (recorded(&log), json(path));
    let rows = source["entries"].as_array().unwrap();
    assert_eq!(log.rows, rows.len() as u64, "{name}");
    let nanos = |row: &Value| {
        let seconds = row["timestamp"].as_f64().unwrap();
        (seconds * 1e9).round()
    };
    let expected_times: Vec<f64> = rows.iter().map(nanos).collect();
    for (signal, column, convert) in COMMON.iter().chain(more) {
        let (times, values) = series(&recording, signal);
        let times: Vec<f64> = times.into_iter().map(|time| time as f64).collect();
        assert_eq!(times, expected_times, "{name} {signal}");
        let expected = rows
            .iter()
            .map(|row| convert(number(&row[*column])).to_bits());
        let expected: Vec<u64> = expected.collect();
        let found: Vec<u64> = values.iter().map(|value| value.to_bits()).collect();
        assert_eq!(found, expected, "{name} {signal}");
    }
    for (key, constant, unit) in [
        ("setting.load.mass", "mass", "kg"),
        ("setting.load.length", "length", "m"),
        ("setting.supply.voltage", "vin", "V"),
    ] {
        let expected = format!("\"{} {unit}\"", number(&source[constant]));
        assert_eq!(recording.note(key), Some(expected.as_str()), "{name}");
    }
    let gain = number(&source["kp"]).to_string();
    assert_eq!(
        recording.note("setting.controller.gain"),
        Some(gain.as_str())
    );
    assert_eq!(recording.note("note.motor"), source["motor"].as_str());
    assert_eq!(
        recording.note("note.trajectory"),
        source["trajectory"].as_str()
    );
    assert_eq!(recording.note("log.origin"), Some("0 s"));
    let hash = blake3::hash(&fs::read(path).unwrap()).to_hex();
    assert_eq!(recording.note("log.blake3"), Some(hash.as_str()));
    let attached = recording.attachment("mapping.toml").unwrap();
    assert_eq!(attached, mapping.text.as_bytes());
}

#[test]
fn recordings_of_real_logs_have_every_bit() {
    let xl330 = mapping(include_str!(
        "../../../../../mappings/servo-bench-xl330.toml"
    ));
    let sts = mapping(include_str!("../../../../../mappings/servo-bench-sts.toml"));
    let duty: Convert = |word| (if word > 32767.0 { word - 65536.0 } else { word }) / 885.0;
    for path in logs("") {
        if path
            .file_name()
            .unwrap()
            .to_string_lossy()
            .starts_with("xl330")
        {
            check(&path, &xl330, &[("servo/duty", "load", duty)]);
        } else {
            check(&path, &sts, &[]);
        }
    }
    // Every tenth of the others: they differ in values only.
    for path in logs("sts3215").iter().step_by(10) {
        check(
            path,
            &sts,
            &[("servo/current", "current", |milliamps| milliamps / 1000.0)],
        );
    }
}

#[test]
fn periods_of_real_logs_are_those_of_their_source() {
    let xl330 = mapping(include_str!(
        "../../../../../mappings/servo-bench-xl330.toml"
    ));
    for path in logs("") {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if !name.starts_with("xl330") || name.contains("lift_and_drop") {
            continue;
        }
        let log = import_log(&path, &xl330, LogLimits::default()).unwrap();
        let periods = log.groups[0].periods.unwrap();
        // One write and five reads at 1 Mbit/s, and a pause of 1 ms.
        assert!(
            (5_290_000..=5_330_000).contains(&periods.p50_ns),
            "{name}: {periods:?}"
        );
        assert!(
            periods.max_ns < 7_200_000 && log.groups[0].gaps.0 == 0,
            "{name}: {periods:?}"
        );
    }
}

/// Samples of a rest before one that counts, and those before it with the torque on.
const RESTING: usize = 16;
const ENABLED: usize = 25;
const COUNTS_PER_RADIAN: f64 = 4096.0 / std::f64::consts::TAU;

/// The law of the duty cycle in benches/sts3215.toml: in per mille, 16 and a quarter of the gain
/// for each count beyond the first. The servo reports it with the sign in bit 10.
#[test]
fn duty_cycle_of_the_sts3215_at_rest_is_that_of_its_bench() {
    let (mut samples, mut others) = (0, 0);
    for path in logs("sts3215") {
        let source = json(&path);
        let rows = source["entries"].as_array().unwrap();
        let column =
            |name: &str| -> Vec<f64> { rows.iter().map(|row| number(&row[name])).collect() };
        let [position, goal, duty, enabled] =
            ["position", "goal_position", "torque", "torque_enable"].map(column);
        let gain = number(&source["kp"]);
        for end in ENABLED..rows.len() {
            let range = |values: &[f64]| {
                let last = &values[end + 1 - RESTING..=end];
                let least = last.iter().copied().fold(f64::INFINITY, f64::min);
                last.iter().map(|value| value - least).fold(0.0, f64::max)
            };
            let is_on = enabled[end + 1 - ENABLED..=end].iter().all(|on| *on == 1.0);
            let is_commanded = range(&goal) * COUNTS_PER_RADIAN < 1.5;
            if !(is_on && is_commanded && range(&position) == 0.0) {
                continue;
            }
            let error = ((goal[end] - position[end]) * COUNTS_PER_RADIAN).round();
            let beyond = error.abs() - 1.0;
            let expected = if beyond > 0.0 {
                (16.0 + 0.25 * gain * beyond).copysign(error)
            } else {
                0.0
            };
            let word = (100.0 * duty[end]).round();
            // Bit 10 is set for a duty cycle in the direction of positive angles.
            let reported = if word >= 1024.0 { word - 1024.0 } else { -word };
            samples += 1;
            others += usize::from((reported - expected).abs() > 0.6);
        }
    }
    assert!(samples == 0 || samples > 8000, "{samples}");
    // Five: the command or a reading has just changed.
    assert!(others <= samples / 1000, "{others} of {samples}");
}
