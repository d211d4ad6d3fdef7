//! Scenario, seed and build determine a run bit for bit, independently of its environment; the
//! first deviation of a faulty part is detected. Tests that need several builds or processes are in
//! `ci/determinism`.

use twinrig::Registry;
use twinrig::kernel::SimTime;
use twinrig_record::{Recording, first_divergence};
use twinrig_tests::{TrotFixture, record, run, with_faulty_plant};

#[test]
fn repeated_run_has_the_same_fingerprint() {
    let registry = Registry::standard();
    let fixture = TrotFixture::default();
    for fixture in [fixture.clone(), fixture.with_leg_inertia()] {
        assert_eq!(
            run(&fixture.assembly(&registry)),
            run(&fixture.assembly(&registry))
        );
    }
}

#[test]
fn linear_set_points_are_repeatable_and_differ_from_held_ones() {
    let registry = Registry::standard();
    let fixture = |actuator| TrotFixture {
        actuator,
        ..TrotFixture::default()
    };
    for with_legs in [false, true] {
        let fingerprint_of = |actuator| {
            let fixture = fixture(actuator);
            let fixture = if with_legs {
                fixture.with_leg_inertia()
            } else {
                fixture
            };
            run(&fixture.assembly(&registry))
        };
        let linear = fingerprint_of("set_point = \"linear\"");
        assert_eq!(linear, fingerprint_of("set_point = \"linear\""));
        assert_eq!(linear, fingerprint_of(""));
        let held = fingerprint_of("set_point = \"held\"");
        assert_eq!(held, fingerprint_of("set_point = \"held\""));
        assert_ne!(linear, held);
    }
}

#[test]
fn recording_and_expectations_do_not_change_the_fingerprint() {
    let registry = Registry::standard();
    let assembly = TrotFixture::default().assembly(&registry);
    let (report, _) = record(&assembly, "recorded-or-not");
    assert_eq!(report.fingerprint, Some(run(&assembly).to_string()));
}

#[test]
fn repeated_recording_is_identical() {
    let registry = Registry::standard();
    let assembly = TrotFixture::default().assembly(&registry);
    let (_, a) = record(&assembly, "same-file-a");
    let (_, b) = record(&assembly, "same-file-b");
    assert!(a == b);
}

#[test]
fn concurrent_runs_are_independent() {
    let standalone = run(&TrotFixture::default().assembly(&Registry::standard()));
    let run = || run(&TrotFixture::default().assembly(&Registry::standard()));
    #[expect(
        clippy::disallowed_methods,
        reason = "the test is about concurrent runs"
    )]
    let together = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4).map(|_| scope.spawn(run)).collect();
        let digests = threads.into_iter().map(|thread| thread.join().unwrap());
        digests.collect::<Vec<_>>()
    });
    assert_eq!(together, [standalone; 4]);
}

#[test]
fn random_transfer_times_depend_on_the_seed_only() {
    let registry = Registry::standard();
    let fixture = |seed| TrotFixture {
        seed,
        io: "transfer_time = { min = \"200 us\", max = \"900 us\" }",
        ..TrotFixture::default()
    };
    let fingerprint_of = |seed| run(&fixture(seed).assembly(&registry));
    assert_eq!(fingerprint_of(1), fingerprint_of(1));
    assert_ne!(fingerprint_of(1), fingerprint_of(2));
}

/// A single flipped bit of one number is detected.
#[test]
fn first_wrong_tick_of_a_faulty_part_is_located() {
    let valid = Registry::standard();
    let (report, a) = record(&TrotFixture::default().assembly(&valid), "broken-a");
    // Between two observations: the next one is the first wrong one.
    let faulty = with_faulty_plant(SimTime::from_nanos(301_000_000));
    let (faulty_report, b) = record(&TrotFixture::default().assembly(&faulty), "broken-b");
    assert_ne!(report.fingerprint, faulty_report.fingerprint);
    let [a, b] = [a, b].map(|bytes| Recording::from_bytes(bytes).unwrap());
    let first = first_divergence(&a, &b).first.unwrap();
    assert_eq!(first.time, SimTime::from_nanos(302_000_000));
    assert_eq!(
        (first.signal.as_str(), first.component),
        ("body/position", 0)
    );
    let [a, b] = [first.a, first.b].map(|value| value.unwrap().to_bits());
    assert_eq!(a ^ b, 1);
}

#[test]
fn replay_on_a_faulty_build_reports_the_first_difference() {
    let (_, bytes) = record(
        &TrotFixture::default().assembly(&Registry::standard()),
        "replayed",
    );
    let name = format!("twinrig-{}-to-replay.mcap", std::process::id());
    let path = std::env::temp_dir().join(name);
    std::fs::write(&path, bytes).unwrap();
    let replay = |registry: &Registry| {
        let (mut out, mut err) = (Vec::new(), Vec::new());
        let words = ["replay".as_ref(), path.as_os_str(), "--json".as_ref()];
        let code = twinrig::run_with(registry, words, &mut out, &mut err);
        let value: serde_json::Value = serde_json::from_slice(&out).unwrap();
        (code, value)
    };
    let (code, replayed) = replay(&Registry::standard());
    assert_eq!(
        (code, &replayed["identical"]),
        (0, &serde_json::Value::Bool(true))
    );
    let (code, replayed) = replay(&with_faulty_plant(SimTime::from_nanos(1)));
    assert_eq!(code, 1);
    assert_eq!(replayed["difference"]["first"]["time_ns"], 2_000_000);
    std::fs::remove_file(path).unwrap();
}

/// Comparing fingerprints detects the order, kind and time of events as well.
#[test]
fn fault_in_the_last_tick_is_detected() {
    let end = SimTime::from_nanos(600_000_000);
    let valid = run(&TrotFixture::default().assembly(&Registry::standard()));
    let faulty = with_faulty_plant(end);
    assert_ne!(run(&TrotFixture::default().assembly(&faulty)), valid);
    let later = with_faulty_plant(SimTime::from_nanos(600_000_001));
    assert_eq!(run(&TrotFixture::default().assembly(&later)), valid);
}
