//! Computation time of the scenario `trot.toml`. Items are simulated seconds, so that items per
//! second are the real-time factor.

use std::path::{Path, PathBuf};

use divan::Bencher;
use divan::counter::ItemsCount;
use twinrig::kernel::{SimDuration, SimTime};
use twinrig::scenario::Setting;
use twinrig::{Assembly, Execution, execute};

fn main() {
    divan::main();
}

/// Calls `body` with the scenario and the given settings.
fn with_trot(settings: &[(&str, &str)], body: impl FnOnce(&Assembly<'_>)) {
    let registry = twinrig::registry();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/trot.toml");
    let setting = |&(key, value): &(&str, &str)| Setting {
        origin: "bench".to_owned(),
        key: key.to_owned(),
        value: value.to_owned(),
    };
    let settings: Vec<Setting> = settings.iter().map(setting).collect();
    match Assembly::builder(&registry).settings(&settings).file(&path) {
        Ok(assembly) => body(&assembly),
        Err(error) => panic!("{error}"),
    }
}

/// Measures the run of the complete scenario including its evaluation, without reading the files.
fn complete_run(bencher: Bencher<'_, '_>, settings: &[(&str, &str)], recording: Option<PathBuf>) {
    with_trot(settings, |assembly| {
        let execution = Execution {
            recording,
            ..Execution::default()
        };
        bencher
            .counter(ItemsCount::new(simulated_s(assembly.scenario().duration)))
            .bench(|| execute(assembly, &execution).map(|report| report.verdict));
    });
}

fn simulated_s(duration: SimDuration) -> u64 {
    duration.as_nanos() / 1_000_000_000
}

#[divan::bench(sample_count = 20)]
fn judged(bencher: Bencher<'_, '_>) {
    complete_run(bencher, &[], None);
}

#[divan::bench(sample_count = 20)]
fn judged_and_recorded(bencher: Bencher<'_, '_>) {
    let path = std::env::temp_dir().join("twinrig-bench.mcap");
    complete_run(bencher, &[], Some(path.clone()));
    let _ = std::fs::remove_file(path);
}

/// Measures the saving by omission: signals that no part needs are neither computed nor hashed.
#[divan::bench(sample_count = 20)]
fn judged_and_only_the_body_recorded(bencher: Bencher<'_, '_>) {
    let lean = [
        ("record.signals", "[\"body/*\"]"),
        ("record.frames", "0 Hz"),
    ];
    complete_run(bencher, &lean, None);
}

/// Measures the rig without observers, for one simulated second in the middle of the run.
#[divan::bench(sample_count = 20)]
fn rig_without_observers(bencher: Bencher<'_, '_>) {
    with_trot(&[], |assembly| {
        let from = SimTime::ZERO + SimDuration::from_secs(5);
        let mut rig = match assembly.rig() {
            Ok(rig) => rig,
            Err(error) => panic!("{error}"),
        };
        rig.run_until(from, &mut ()).expect("the trot runs");
        let saved = rig.save();
        bencher.counter(ItemsCount::new(1_u64)).bench_local(|| {
            rig.restore(&saved).expect("it was saved from this rig");
            rig.run_until(from + SimDuration::from_secs(1), &mut ())
        });
    });
}

/// Measures the saving by removing parts: a robot with a fixed trunk and the given legs.
fn hanging(bencher: Bencher<'_, '_>, legs: &str) {
    let settings = [
        ("plant", "{ model = \"massless\", base = \"fixed\" }"),
        ("plant.legs", legs),
        ("expect", "[]"),
    ];
    complete_run(bencher, &settings, None);
}

#[divan::bench(sample_count = 20)]
fn hanging_with_four_legs(bencher: Bencher<'_, '_>) {
    hanging(bencher, "[\"LF\", \"RF\", \"LH\", \"RH\"]");
}

#[divan::bench(sample_count = 20)]
fn hanging_with_two_legs(bencher: Bencher<'_, '_>) {
    hanging(bencher, "[\"LF\", \"RH\"]");
}
