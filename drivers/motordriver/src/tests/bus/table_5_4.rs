//! Thesis, table 5.4: at 500 Hz the counters of the boards measure the mismatch of their clocks.

use twinrig_kernel::{SimDuration, SimTime, stream};
use twinrig_motordriver::{BusConfig, Interpolation};

use super::harness::{Harness, LEGS, at_ms, millis, with_clocks};

/// Relative excess of each board's tick length \[ppm\].
const MISMATCH_PPM: [i64; 4] = [764, 749, 767, 762];

/// Returns the configuration with these clocks: a clock whose tick is too long runs slow by the
/// same factor.
fn slow(config: BusConfig) -> BusConfig {
    let rates = MISMATCH_PPM.map(|ppm| -(ppm * 1_000_000_000 / (1_000_000 + ppm)));
    let phases = [100, 400, 650, 900].map(SimDuration::from_micros);
    with_clocks(config, rates, phases)
}

/// Runs cycles for some seconds and returns the harness and the number of cycles.
fn run(config: &BusConfig, seconds: u64) -> (Harness, u64) {
    let mut harness = Harness::new(config);
    harness.plant.turning = false;
    harness.open().unwrap();
    // Start: the next whole period.
    let begin = harness.now().as_nanos() / 2_000_000 * 2;
    let end = at_ms(begin + 1_000 * seconds);
    let cycles = harness.run_cycles(millis(2), end, |_| [0.1; 8]).unwrap();
    harness.run_until_idle(end + millis(2)).unwrap();
    (harness, cycles)
}

#[test]
fn filled_steps_equal_the_clock_mismatch_over_100_s() {
    let (harness, cycles) = run(&slow(BusConfig::default()), 100);
    assert_eq!(cycles, 50_000);
    assert_eq!(harness.diagnostic("sbcp/cycles"), 50_000.0);
    assert_eq!(harness.diagnostic("sbcp/success"), 1.0);
    for (leg, ppm) in LEGS.into_iter().zip(MISMATCH_PPM) {
        let diagnostic = |what: &str| harness.diagnostic(&format!("sbcp/{leg}/{what}"));
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
fn without_heuristics_the_clock_mismatch_loses_points() {
    let mut config = slow(BusConfig::default());
    for board in &mut config.boards {
        board.firmware.interpolation = Interpolation::WithoutHeuristics;
    }
    let (harness, _) = run(&config, 100);
    for (leg, ppm) in LEGS.into_iter().zip(MISMATCH_PPM) {
        let diagnostic = |what: &str| harness.diagnostic(&format!("sbcp/{leg}/{what}"));
        // A point has two ticks: half as many, one every 2.6 s.
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
fn counters_are_independent_of_host_jitter() {
    let mut harness = Harness::new(&slow(BusConfig::default()));
    harness.plant.turning = false;
    harness.open().unwrap();
    let mut random = stream(5, "jitter");
    let first = harness.now().as_nanos() / 2_000_000 + 1;
    for n in 0..10_000 {
        let at = (first + n) * 2_000_000 + random.between(0, 900_000);
        harness.run_until(SimTime::from_nanos(at)).unwrap();
        assert!(!harness.busy);
        harness.begin(&[0.1; 8]).unwrap();
    }
    for (leg, ppm) in LEGS.into_iter().zip(MISMATCH_PPM) {
        let diagnostic = |what: &str| harness.diagnostic(&format!("sbcp/{leg}/{what}"));
        let expected = ppm as f64 * 1e-6 * 10_000.0 * 2.0;
        let found = diagnostic("filled_steps") - diagnostic("missed_points");
        assert!(
            (found - expected).abs() <= 3.0,
            "{leg}: {found}, expected {expected}"
        );
        // Uniform within 0.9 ms, quantised to microframes: about 0.26 ms.
        let deviation = diagnostic("request/deviation");
        assert!((0.24e-3..0.29e-3).contains(&deviation), "{deviation}");
    }
}
