//! The benches of servos beside logs of real ones, in the folder that `SERVO_LOGS` names.

use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use twinrig_document::Document;
use twinrig_experiment::{FitOutcome, FitRequest, fit, fit_page};
use twinrig_record::{LogLimits, LogMapping, import_log};
use twinrig_rig::registry::Registry;
use twinrig_scenario::Setting;

use crate::identification::Folder;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Imports the logs of a folder whose names contain some texts; none without the variable.
fn recordings(folder: &Folder, of: &str, mapping: &str, selected: &[&str]) -> Vec<PathBuf> {
    let Some(root) = std::env::var_os("SERVO_LOGS") else {
        println!("skipped: no logs");
        return Vec::new();
    };
    let mapping = Document::read(&Path::new(ROOT).join("mappings").join(mapping)).unwrap();
    let mapping = LogMapping::read(&mapping).unwrap();
    let entries = fs::read_dir(Path::new(&root).join(of)).unwrap();
    let logs = entries.map(|entry| entry.unwrap().path());
    let mut logs: Vec<PathBuf> = logs
        .filter(|log| {
            let name = log.to_string_lossy();
            selected.iter().all(|text| name.contains(text))
        })
        .collect();
    logs.sort();
    let recordings = logs.iter().map(|log| {
        let name = log.file_name().unwrap().to_string_lossy();
        let stem = name.split(".json").next().unwrap();
        let path = folder.0.join(format!("{stem}.mcap"));
        let imported = import_log(log, &mapping, LogLimits::default()).unwrap();
        let out = BufWriter::new(File::create(&path).unwrap());
        imported.write(out, "test").unwrap();
        path
    });
    recordings.collect()
}

/// A fit without a step, of a search space whose middle is the value of the bench's file.
const NO_STEP: &str = "generations = 0\nsteps = 0";

fn outcome(
    folder: &Folder,
    recordings: &[PathBuf],
    space: &str,
    set: &[(&str, &str)],
    cross_validate: bool,
) -> FitOutcome {
    let path = folder.0.join("space.toml");
    let text = format!("scenario = \"{ROOT}/scenarios/servo.toml\"\n{space}");
    fs::write(&path, text).unwrap();
    let request = FitRequest {
        recordings: recordings.to_vec(),
        space: path,
        settings: set
            .iter()
            .map(|(key, value)| Setting {
                origin: "test".to_owned(),
                key: (*key).to_owned(),
                value: (*value).to_owned(),
            })
            .collect(),
        validate: Vec::new(),
        profile: false,
        store: None,
        cross_validate,
        threads: 1,
    };
    fit(&Registry::standard(), &request, &mut |_| true).unwrap()
}

/// Returns the mean of the mean absolute errors of the position and the greatest \[mrad\].
fn errors(folder: &Folder, recordings: &[PathBuf], space: &str, set: &[(&str, &str)]) -> [f64; 2] {
    let space = format!("{NO_STEP}\n{space}");
    let outcome = outcome(folder, recordings, &space, set, false);
    outcome
        .fitted_error("servo/position")
        .unwrap()
        .map(|error| 1e3 * error)
}

const XL330: &str = r#"
set = { plant.file = "xl330" }
residual = [{ signal = "servo/position", twin = "servo/reading", deviation = "10 mrad" }]
start = [{ state = "servo/angle", signal = "servo/position" }, { state = "servo/winding/temperature_rise", signal = "servo/temperature", minus = "302.15 K", times = 4 }]
dimension = [{ key = "override.controller.reading_delay", from = "4.265 ms", to = "6.265 ms" }]
"#;

/// 10.8 mrad and 18.1 mrad when the parameters were fitted.
#[test]
fn bench_of_the_xl330_follows_the_logs() {
    let folder = Folder::new("xl330");
    let recordings = recordings(&folder, "", "servo-bench-xl330.toml", &["xl330-"]);
    if recordings.is_empty() {
        return;
    }
    assert_eq!(recordings.len(), 10);
    let of = |set: &[(&str, &str)]| errors(&folder, &recordings, XL330, set);
    let [mean, worst] = of(&[]);
    assert!(
        (10.0..11.8).contains(&mean) && worst < 20.0,
        "{mean} {worst}"
    );
    // Each part is needed.
    for (key, value) in [
        ("override.gear.driving_square", "0"),
        ("override.gear.static_driving", "0"),
        ("override.gear.static_driven", "0"),
        ("override.motor.heating.capacity", "\"1e6 J/K\""),
        ("override.motor.saturation_current", "\"1e9 A\""),
    ] {
        let [without, _] = of(&[(key, value)]);
        assert!(without > 1.2 * mean, "{key} {without}");
    }
}

/// Folders, mappings, parts of names and search spaces of the logs of each bench.
const BENCHES: [(&str, &str, &str, &str); 3] = [
    ("", "servo-bench-xl330.toml", "xl330-", XL330),
    ("sts3215", "servo-bench-sts.toml", "-kp16-", STS3215),
    ("", "servo-bench-sts.toml", "sts3250-", STS3250),
];

/// Passages through the zero of the encoder \[s\] and turning points \[rad\] after the torque is
/// off, of the recorded (1) or the computed (2) angle. Swings of less than 50 mrad are left out.
fn swings(curve: &[[f64; 3]], column: usize) -> (Vec<f64>, Vec<f64>) {
    let free: Vec<[f64; 2]> = curve
        .iter()
        .map(|point| [point[0], point[column]])
        .filter(|point| point[0] > 2.05)
        .collect();
    let (mut passages, mut turns) = (Vec::new(), Vec::new());
    for pair in free.windows(2) {
        let [[t, one], [later, other]] = [pair[0], pair[1]];
        if (one < 0.0) != (other < 0.0) {
            passages.push(t + (later - t) * one / (one - other));
        }
    }
    for pair in passages.windows(2) {
        let within = free.iter().filter(|it| pair[0] < it[0] && it[0] < pair[1]);
        let furthest = within.fold(0.0_f64, |most, it| most.max(it[1].abs()));
        if furthest > 0.05 {
            turns.push(furthest);
        }
    }
    passages.truncate(turns.len() + 1);
    (passages, turns)
}

/// The goal of 10 ms and 10 % is met by the STS3250 alone: slow last swings are predicted worst.
/// The bounds are those of the parameters when they were fitted.
#[test]
fn free_swings_of_the_benches_pass_the_lowest_point_as_the_logs_do() {
    let folder = Folder::new("swings");
    let [xl330, sts3215, sts3250] = BENCHES;
    for ((of, mapping, bench, space), logs, passage_s, turn) in [
        (xl330, 3, 10e-3, 0.25),
        (sts3215, 8, 31e-3, 0.08),
        (sts3250, 1, 3e-3, 0.01),
    ] {
        let recordings = recordings(&folder, of, mapping, &[bench, "lift_and_drop"]);
        if recordings.is_empty() {
            return;
        }
        assert_eq!(recordings.len(), logs);
        let found = outcome(
            &folder,
            &recordings,
            &format!("{NO_STEP}\n{space}"),
            &[],
            false,
        );
        for it in &found.recordings {
            let [recorded, twin] = [1, 2].map(|column| swings(&it.curve, column));
            println!("{}\n  {recorded:.3?}\n  {twin:.3?}", it.recording);
            let passages = recorded.0.iter().zip(&twin.0);
            let turns = recorded.1.iter().zip(&twin.1);
            let late = passages.map(|(one, other)| (one - other).abs());
            let far = turns.map(|(one, other)| (other / one - 1.0).abs());
            let (late, far): (Vec<f64>, Vec<f64>) = (late.collect(), far.collect());
            assert!(late[0] < passage_s, "{} {late:?}", it.recording);
            assert!(
                far.first().is_none_or(|far| *far < turn),
                "{} {far:?}",
                it.recording
            );
            if bench.starts_with("sts3250") {
                assert!(
                    late.len() == 4 && late.iter().all(|late| *late < 0.01),
                    "{late:?}"
                );
                assert!(
                    far.len() == 3 && far.iter().all(|far| *far < 0.1),
                    "{far:?}"
                );
            }
        }
    }
}

/// Returns the instant at which an angle, recorded (1) or computed (2), has left its start by three
/// counts of the encoder \[s\].
fn start(curve: &[[f64; 3]], column: usize) -> f64 {
    const COUNTS: f64 = 4.6e-3;
    let from = curve[0][column];
    let away = |point: &[f64; 3]| (point[column] - from).abs() - COUNTS;
    let mut pairs = curve.windows(2);
    let pair = pairs.find(|pair| away(&pair[1]) > 0.0).unwrap();
    let [before, after] = [away(&pair[0]), away(&pair[1])];
    pair[0][0] - (pair[1][0] - pair[0][0]) * before / (after - before)
}

/// The goal of one period of the loop (5 ms) is missed: the XL330 starts later than its logs. The
/// bounds are those of the parameters when they were fitted.
#[test]
fn benches_start_from_standstill_as_the_logs_do() {
    let folder = Folder::new("starts");
    let [xl330, sts3215, sts3250] = BENCHES;
    for ((of, mapping, bench, space), least, greatest) in [
        (xl330, 0.0, 0.05),
        (sts3215, -0.03, 0.01),
        (sts3250, -0.02, 0.02),
    ] {
        let recordings = recordings(&folder, of, mapping, &[bench]);
        if recordings.is_empty() {
            return;
        }
        let found = outcome(
            &folder,
            &recordings,
            &format!("{NO_STEP}\n{space}"),
            &[],
            false,
        );
        let late = found.recordings.iter().map(|it| {
            let [recorded, twin] = [1, 2].map(|column| start(&it.curve, column));
            println!("{} {:+.1} ms", it.recording, 1e3 * (twin - recorded));
            twin - recorded
        });
        let mut late: Vec<f64> = late.collect();
        late.sort_by(f64::total_cmp);
        let median = late[late.len() / 2];
        assert!((least..greatest).contains(&median), "{bench} {late:?}");
    }
}

const STS3250: &str = r#"
set = { plant.file = "sts3250" }
residual = [{ signal = "servo/position", twin = "servo/reading", deviation = "10 mrad" }]
start = [{ state = "servo/angle", signal = "servo/position" }]
dimension = [{ key = "override.controller.reading_delay", from = "0 ms", to = "1e-6 ms" }]
"#;

/// 3.3 mrad and 6.1 mrad when the parameters were fitted.
#[test]
fn bench_of_the_sts3250_follows_both_logs() {
    let folder = Folder::new("sts3250");
    let recordings = recordings(&folder, "", "servo-bench-sts.toml", &["sts3250-"]);
    if recordings.is_empty() {
        return;
    }
    assert_eq!(recordings.len(), 2);
    let [mean, worst] = errors(&folder, &recordings, STS3250, &[]);
    assert!((4.0..5.5).contains(&mean) && worst < 7.0, "{mean} {worst}");
}

const STS3215: &str = r#"
set = { plant.file = "sts3215", override.supply.voltage = "11.9 V" }
residual = [{ signal = "servo/position", twin = "servo/reading", deviation = "10 mrad", spike = "0.5 rad" }]
start = [{ state = "servo/angle", signal = "servo/position" }]
dimension = [{ key = "override.controller.reading_delay", from = "21.38 ms", to = "23.38 ms" }]
"#;

/// 9.7 mrad, and 41 mrad in a free swing of the greatest load, when the parameters were fitted.
#[test]
fn bench_of_the_sts3215_follows_the_logs_of_four_loads() {
    let folder = Folder::new("sts3215");
    let recordings = recordings(&folder, "sts3215", "servo-bench-sts.toml", &["-kp16-"]);
    if recordings.is_empty() {
        return;
    }
    assert_eq!(recordings.len(), 40);
    let of = |set: &[(&str, &str)]| errors(&folder, &recordings, STS3215, set);
    let [mean, worst] = of(&[]);
    assert!(
        (9.0..10.5).contains(&mean) && worst < 43.0,
        "{mean} {worst}"
    );
    for (key, value) in [
        ("override.gear.static_driven", "0"),
        ("override.controller.dead_zone", "10"),
        ("override.controller.profile_speed", "\"4 rad/s\""),
    ] {
        let [without, _] = of(&[(key, value)]);
        assert!(without > 1.5 * mean, "{key} {without}");
    }
    // Two logs of each load are left out together; two readings are −π.
    let is_selected = |path: &&PathBuf| {
        let name = path.to_string_lossy();
        name.contains("lift_and_drop-1") || name.contains("brutal-2")
    };
    let few: Vec<PathBuf> = recordings.iter().filter(is_selected).cloned().collect();
    let by_load = format!("{NO_STEP}\nleave_out = \"load.mass\"\nsearches = 2\n{STS3215}");
    let found = outcome(&folder, &few, &by_load, &[], true);
    let sizes: Vec<usize> = found.held_out.iter().map(|it| it.residuals.len()).collect();
    assert_eq!(sizes, [2; 4]);
    for held_out in &found.held_out {
        let load = |index: usize| &held_out.residuals[index].recording[..6];
        assert_eq!(load(0), load(1));
    }
    // Nothing was fitted: what is left out is as far off as what is not.
    let [left_out, fitted] = [
        found.held_out_error("servo/position"),
        found.fitted_error("servo/position"),
    ];
    assert_eq!(left_out, fitted);
    assert_eq!(found.minima.len(), 2);
    assert_eq!(
        found.recordings.iter().map(|it| it.spikes).sum::<usize>(),
        2
    );
    // Searches that are cut short end at different costs, of which the least counts.
    let short = format!("generations = 1\nparticles = 4\nsearches = 4\nsteps = 0\n{STS3215}");
    let short = outcome(&folder, &few[..1], &short, &[], false).minima;
    assert!(short.is_sorted_by(|one, other| one < other), "{short:?}");
    let page = fit_page(&found).html();
    assert!(page.contains("2 corrupted readings are not compared"));
    assert!(page.contains("m1.168-kp16-lift_and_drop-1") && page.contains(", left out "));
}
