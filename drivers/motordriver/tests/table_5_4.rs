//! Thesis, table 5.4: at 500 Hz, what the counters of the boards say is how much slower their clocks are.

mod common;

use common::{Bench, LEGS, at_ms, millis, with_clocks};
use twinrig_kernel::{SimDuration, SimTime, stream};
use twinrig_motordriver::{BusConfig, Interpolation};

/// Parts in a million by which a tick of each board is too long.
const MISMATCH_PPM: [i64; 4] = [764, 749, 767, 762];

/// A clock whose tick is too long by that much shows less by that much.
fn slow(config: BusConfig) -> BusConfig {
    let rates = MISMATCH_PPM.map(|ppm| -(ppm * 1_000_000_000 / (1_000_000 + ppm)));
    let phases = [100, 400, 650, 900].map(SimDuration::from_micros);
    with_clocks(config, rates, phases)
}

/// So many seconds of cycles; the bench, and how many there were.
fn run(config: &BusConfig, seconds: u64) -> (Bench, u64) {
    let mut bench = Bench::new(config);
    bench.plant.turning = false;
    bench.open().unwrap();
    // From the next whole period on.
    let begin = bench.now().as_nanos() / 2_000_000 * 2;
    let end = at_ms(begin + 1_000 * seconds);
    let cycles = bench.run_cycles(millis(2), end, |_| [0.1; 8]).unwrap();
    bench.run_until_idle(end + millis(2)).unwrap();
    (bench, cycles)
}

#[test]
fn a_hundred_seconds_obey_the_law_of_conservation() {
    let (bench, cycles) = run(&slow(BusConfig::default()), 100);
    assert_eq!(cycles, 50_000);
    assert_eq!(bench.diagnostic("sbcp/cycles"), 50_000.0);
    assert_eq!(bench.diagnostic("sbcp/success"), 1.0);
    for (leg, ppm) in LEGS.into_iter().zip(MISMATCH_PPM) {
        let diagnostic = |what: &str| bench.diagnostic(&format!("sbcp/{leg}/{what}"));
        assert_eq!(
            (diagnostic("missed_points"), diagnostic("lost_points")),
            (0.0, 0.0)
        );
        assert_eq!(diagnostic("watchdog_drops"), 0.0);
        let expected = ppm as f64 * 1e-6 * 50_000.0 * 2.0;
        let found = diagnostic("filled_steps");
        assert!(
            (found - expected).abs() <= 2.0,
            "{leg}: {found}, expected {expected}"
        );
    }
}

#[test]
fn without_the_heuristics_points_are_lost_instead() {
    let mut config = slow(BusConfig::default());
    for board in &mut config.boards {
        board.firmware.interpolation = Interpolation::WithoutHeuristics;
    }
    let (bench, _) = run(&config, 100);
    for (leg, ppm) in LEGS.into_iter().zip(MISMATCH_PPM) {
        let diagnostic = |what: &str| bench.diagnostic(&format!("sbcp/{leg}/{what}"));
        // A point of two ticks each: half as many, one every 2.6 s.
        let expected = ppm as f64 * 1e-6 * 50_000.0;
        let found = diagnostic("lost_points");
        assert!(
            (found - expected).abs() <= 2.0,
            "{leg}: {found}, expected {expected}"
        );
        assert_eq!(
            (diagnostic("filled_steps"), diagnostic("missed_points")),
            (0.0, 0.0)
        );
    }
}

#[test]
fn what_the_counters_say_does_not_depend_on_the_jitter_of_the_host() {
    let mut bench = Bench::new(&slow(BusConfig::default()));
    bench.plant.turning = false;
    bench.open().unwrap();
    let mut random = stream(5, "jitter");
    let first = bench.now().as_nanos() / 2_000_000 + 1;
    for n in 0..10_000 {
        let at = (first + n) * 2_000_000 + random.between(0, 900_000);
        bench.run_until(SimTime::from_nanos(at)).unwrap();
        assert!(!bench.busy);
        bench.begin(&[0.1; 8]).unwrap();
    }
    for (leg, ppm) in LEGS.into_iter().zip(MISMATCH_PPM) {
        let diagnostic = |what: &str| bench.diagnostic(&format!("sbcp/{leg}/{what}"));
        let expected = ppm as f64 * 1e-6 * 10_000.0 * 2.0;
        let found = diagnostic("filled_steps") - diagnostic("missed_points");
        assert!(
            (found - expected).abs() <= 3.0,
            "{leg}: {found}, expected {expected}"
        );
        // Uniform within 0.9 ms, seen through whole microframes: about 0.26 ms.
        let deviation = diagnostic("request/deviation");
        assert!((0.24e-3..0.29e-3).contains(&deviation), "{deviation}");
    }
}
