//! Diagnostics of the timing of cycles and requests, compared with the recorded instants.

use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime, stream};
use twinrig_motordriver::{BusConfig, BusTopology};
use twinrig_runtime::Timing;
use twinrig_wire::{Fault, FaultKind, FaultSchedule, FaultSelection, UsbPreset, UsbTiming};

use super::harness::{Harness, LEGS, millis};

/// Checks the diagnostics of cycles against the first request of each.
fn check(harness: &Harness, begins: &[SimTime]) {
    let intervals = begins.windows(2).map(|pair| (pair[1] - pair[0]).as_nanos());
    let mut sorted: Vec<u64> = intervals.collect();
    sorted.sort_unstable();
    let n = sorted.len();
    let diagnostic = |what: &str| 1e9 * harness.diagnostic(&format!("sbcp/cycle/{what}"));
    let span = (begins[n] - begins[0]).as_nanos() as f64;
    // The last cycle is incomplete, and one that waits before writing has begun before its request.
    assert!((harness.diagnostic("sbcp/cycles") + 1.0 - begins.len() as f64).abs() <= 1.0);
    let (shortest, longest) = (sorted[0] as f64, sorted[n - 1] as f64);
    assert!((diagnostic("mean") - span / n as f64).abs() < longest / n as f64);
    assert!((diagnostic("shortest") - shortest).abs() < 1e-3);
    assert!((diagnostic("longest") - longest).abs() < 1e-3);
    for (name, per_mille) in [("p50", 500), ("p99", 990), ("p999", 999)] {
        let exact = sorted[(n * per_mille).div_ceil(1_000) - 1] as f64;
        let found = diagnostic(name);
        assert!(
            (found - exact).abs() < exact / 128.0,
            "{name}: {found}, not {exact}"
        );
    }
}

fn free_running(topology: BusTopology) -> BusConfig {
    let mut config = BusConfig {
        topology,
        ..BusConfig::default()
    };
    config.session.free_running = true;
    config.session.error_threshold = -1;
    config
}

/// Runs freely for `length` and returns the starts of the cycles.
fn run(config: &BusConfig, length: SimDuration) -> (Harness, Vec<SimTime>) {
    let mut harness = Harness::new(config);
    harness.plant.turning = false;
    harness.open().unwrap();
    harness.passed = Some(Vec::new());
    harness.begin(&[0.0; 8]).unwrap();
    harness.run_until(harness.now() + length).unwrap();
    let begins = harness.cycle_begins();
    (harness, begins)
}

#[test]
fn failing_board_appears_in_mean_and_percentiles() {
    let fault = Fault {
        at: SimTime::ZERO + millis(1_000),
        on: "wire/sbcp/RF".into(),
        kind: FaultKind::Unplug { fails: false },
        lasts: SimDuration::from_secs(1_000),
        select: FaultSelection::default(),
    };
    let mut config = free_running(BusTopology::Direct);
    config.faults = FaultSchedule {
        faults: vec![fault],
        seed: 1,
    };
    let (harness, begins) = run(&config, SimDuration::from_secs(10));
    check(&harness, &begins);
    assert!(harness.diagnostic("sbcp/cycle/mean") > 2.6e-3);
    assert_eq!(harness.diagnostic("sbcp/cycle/shortest"), 2.5e-3);
}

#[test]
fn mean_with_long_latency_timers_equals_the_counted_rate() {
    for (timer, rate) in [(4, 250.0), (16, 62.5)] {
        let mut config = free_running(BusConfig::default().topology);
        config.usb.latency_timer = millis(timer);
        let (harness, begins) = run(&config, SimDuration::from_secs(8));
        check(&harness, &begins);
        let counted =
            (begins.len() - 1) as f64 / (begins[begins.len() - 1] - begins[0]).as_secs_f64();
        let reported = 1.0 / harness.diagnostic("sbcp/cycle/mean");
        assert!(
            (counted / rate - 1.0).abs() < 0.01,
            "{timer} ms: {counted} Hz"
        );
        assert!(
            (reported / counted - 1.0).abs() < 1e-9,
            "{timer} ms: {reported} Hz, not {counted} Hz"
        );
    }
}

#[test]
fn measured_adapters_lose_no_answer() {
    for preset in [UsbPreset::Ft232r, UsbPreset::Ch340, UsbPreset::Atmega16u2] {
        let mut config = free_running(BusTopology::Direct);
        config.usb = UsbTiming::preset(preset);
        let (harness, _) = run(&config, SimDuration::from_secs(2));
        assert_eq!(harness.diagnostic("sbcp/errors"), 0.0, "{preset:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]
    /// Cycles that begin late by up to 1.1 of 2 ms: `request/deviation` is their standard
    /// deviation, apart from the quantisation to USB microframes (125 µs, standard deviation 36
    /// µs).
    #[test]
    fn phase_deviation_equals_the_host_jitter(width_us in 400..1_100_u64, seed in any::<u64>()) {
        let mut harness = Harness::new(&BusConfig::default());
        harness.plant.turning = false;
        harness.open().unwrap();
        let mut random = stream(seed, "jitter");
        let first = harness.now().as_nanos() / 2_000_000 + 1;
        for n in 0..2_000 {
            // A cycle is skipped occasionally.
            if random.unit() < 0.01 {
                continue;
            }
            let at = (first + n) * 2_000_000 + random.between(0, width_us * 1_000);
            harness.run_until(SimTime::from_nanos(at)).unwrap();
            harness.begin(&[0.1; 8]).unwrap();
            harness.run_until_idle(SimTime::from_nanos(at) + millis(2)).unwrap();
        }
        let exact = 1e-6 * width_us as f64 / 12.0_f64.sqrt();
        let cycles = harness.diagnostic("sbcp/cycle/phase/deviation");
        prop_assert!((cycles / exact - 1.0).abs() < 0.06, "{cycles}, not {exact}");
        for leg in LEGS {
            let diagnostic = |what: &str| harness.diagnostic(&format!("sbcp/{leg}/request/{what}"));
            let found = diagnostic("phase/deviation");
            let through_grid = (exact * exact + 36e-6 * 36e-6).sqrt();
            prop_assert!((found / through_grid - 1.0).abs() < 0.08, "{leg}: {found}, not {exact}");
            prop_assert_eq!(diagnostic("deviation"), found);
        }
    }
}

#[test]
fn completion_jitter_does_not_move_requests() {
    let mut config = BusConfig::default();
    config.usb.jitter = Timing::Uniform {
        min: SimDuration::ZERO,
        max: SimDuration::from_micros(300),
    };
    let mut harness = Harness::new(&config);
    harness.open().unwrap();
    let end = harness.now() + millis(1_000);
    harness.run_cycles(millis(2), end, |_| [0.1; 8]).unwrap();
    for leg in LEGS {
        assert_eq!(
            harness.diagnostic(&format!("sbcp/{leg}/request/deviation")),
            0.0
        );
    }
}
