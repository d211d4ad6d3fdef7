//! The same scenario, seed and build give the same run, bit for bit, whatever goes on around it; and if a part breaks that,
//! it is caught at its first wrong tick. What needs several builds or processes is in `ci/determinism`.

use twinrig::Registry;
use twinrig::kernel::SimTime;
use twinrig_record::{Recording, first_divergence};
use twinrig_tests::{Scene, record, run, with_broken_plant};

#[test]
fn a_run_done_twice_is_the_same_run() {
    let registry = Registry::standard();
    let scene = Scene::default();
    for scene in [scene.clone(), scene.of_full_legs()] {
        assert_eq!(
            run(&scene.assembly(&registry)),
            run(&scene.assembly(&registry))
        );
    }
}

#[test]
fn a_run_is_the_same_recorded_or_not_and_judged_or_not() {
    let registry = Registry::standard();
    let assembly = Scene::default().assembly(&registry);
    let (report, _) = record(&assembly, "recorded-or-not");
    assert_eq!(report.fingerprint, Some(run(&assembly).to_string()));
}

#[test]
fn the_same_run_makes_the_same_file_byte_for_byte() {
    let registry = Registry::standard();
    let assembly = Scene::default().assembly(&registry);
    let (_, a) = record(&assembly, "same-file-a");
    let (_, b) = record(&assembly, "same-file-b");
    assert!(a == b);
}

#[test]
fn runs_side_by_side_do_not_disturb_one_another() {
    let standalone = run(&Scene::default().assembly(&Registry::standard()));
    let run = || run(&Scene::default().assembly(&Registry::standard()));
    #[expect(
        clippy::disallowed_methods,
        reason = "what threads could do is what is tested"
    )]
    let together = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4).map(|_| scope.spawn(run)).collect();
        let digests = threads.into_iter().map(|thread| thread.join().unwrap());
        digests.collect::<Vec<_>>()
    });
    assert_eq!(together, [standalone; 4]);
}

#[test]
fn random_times_of_transfers_are_drawn_from_the_seed_and_nothing_else() {
    let registry = Registry::standard();
    let scene = |seed| Scene {
        seed,
        io: "transfer_time = { min = \"200 us\", max = \"900 us\" }",
        ..Scene::default()
    };
    let of = |seed| run(&scene(seed).assembly(&registry));
    assert_eq!(of(1), of(1));
    assert_ne!(of(1), of(2));
}

/// The last bit of one number, once: nothing less can be wrong, and it is not overlooked.
#[test]
fn a_broken_part_is_caught_at_its_first_wrong_tick() {
    let sound = Registry::standard();
    let (report, a) = record(&Scene::default().assembly(&sound), "broken-a");
    // Between two observations: the first wrong one is the next.
    let broken = with_broken_plant(SimTime::from_nanos(301_000_000));
    let (broken_report, b) = record(&Scene::default().assembly(&broken), "broken-b");
    assert_ne!(report.fingerprint, broken_report.fingerprint);
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
fn a_replay_on_a_broken_build_says_where_it_parts() {
    let (_, bytes) = record(
        &Scene::default().assembly(&Registry::standard()),
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
    let (code, replayed) = replay(&with_broken_plant(SimTime::from_nanos(1)));
    assert_eq!(code, 1);
    assert_eq!(replayed["difference"]["first"]["time_ns"], 2_000_000);
    std::fs::remove_file(path).unwrap();
}

/// The comparison of whole runs is not blind to order, kind or time of events either.
#[test]
fn a_part_that_breaks_in_the_last_tick_is_caught() {
    let end = SimTime::from_nanos(600_000_000);
    let sound = run(&Scene::default().assembly(&Registry::standard()));
    let broken = with_broken_plant(end);
    assert_ne!(run(&Scene::default().assembly(&broken)), sound);
    let later = with_broken_plant(SimTime::from_nanos(600_000_001));
    assert_eq!(run(&Scene::default().assembly(&later)), sound);
}
