//! Cycle rates (thesis, section 5.3.2), measured from the bytes on the bus.

use twinrig_kernel::{SimDuration, stream};
use twinrig_motordriver::{BusConfig, BusTopology, Generation};
use twinrig_wire::{Fault, FaultKind, FaultSchedule, FaultSelection};

use super::harness::{Harness, LEGS, millis, with_clocks};

fn free_running(topology: BusTopology) -> BusConfig {
    let mut config = BusConfig {
        topology,
        ..BusConfig::default()
    };
    config.session.free_running = true;
    config
}

/// Returns mean, minimum and maximum of the interval between cycles \[s\] over `length`, from the
/// bytes that the host wrote, independent of its diagnostics.
fn cycles(config: &BusConfig, length: SimDuration) -> (f64, f64, f64) {
    let mut harness = Harness::new(config);
    harness.plant.turning = false;
    harness.open().unwrap();
    harness.passed = Some(Vec::new());
    harness.begin(&[0.0; 8]).unwrap();
    harness.run_until(harness.now() + length).unwrap();
    assert_eq!(harness.diagnostic("sbcp/errors"), 0.0);
    let begins = harness.cycle_begins();
    let intervals = begins.windows(2).map(|pair| pair[1] - pair[0]);
    let (count, span) = (begins.len() - 1, begins[begins.len() - 1] - begins[0]);
    (
        span.as_secs_f64() / count as f64,
        intervals.clone().min().unwrap().as_secs_f64(),
        intervals.max().unwrap().as_secs_f64(),
    )
}

fn is_near(found: f64, expected: f64) -> bool {
    (found - expected).abs() < 1e-9
}

#[test]
fn direct_bus_takes_625_us_per_board_and_cycles_at_400_hz() {
    let (mean, shortest, longest) = cycles(&free_running(BusTopology::Direct), millis(500));
    assert!(is_near(mean, 2.5e-3) && is_near(shortest, 2.5e-3) && is_near(longest, 2.5e-3));
}

#[test]
fn controller_cycle_takes_exactly_one_millisecond() {
    let config = BusConfig::default();
    let (mean, shortest, longest) = cycles(&free_running(config.topology), millis(500));
    assert!(
        is_near(mean, 1e-3) && is_near(shortest, 1e-3) && is_near(longest, 1e-3),
        "{mean} {shortest} {longest}"
    );
}

/// Returns the cycle rate \[Hz\] of a direct bus with a fault, from the requests to the first board
/// over 10 s.
fn rate_with(on: &str, kind: FaultKind, seed: u64) -> f64 {
    let mut config = free_running(BusTopology::Direct);
    config.session.error_threshold = -1;
    let mut harness = Harness::new(&config);
    harness.open().unwrap();
    // From the end of the initialisation on.
    let fault = Fault {
        at: harness.now(),
        on: on.to_owned(),
        kind,
        lasts: SimDuration::from_secs(1_000),
        select: FaultSelection::default(),
    };
    config.faults = FaultSchedule {
        faults: vec![fault],
        seed,
    };
    let mut harness = Harness::new(&config);
    harness.plant.turning = false;
    harness.open().unwrap();
    harness.passed = Some(Vec::new());
    harness.begin(&[0.0; 8]).unwrap();
    let begin = harness.now();
    harness
        .run_until(begin + SimDuration::from_secs(10))
        .unwrap();
    assert!(harness.diagnostic("sbcp/errors") > 100.0);
    harness.cycle_begins().len() as f64 / 10.0
}

/// It costs its time-out of 7 microframes instead of 5.
#[test]
fn direct_bus_with_any_silent_board_cycles_at_364_hz() {
    for leg in LEGS {
        let rate = rate_with(
            &format!("wire/sbcp/{leg}"),
            FaultKind::Unplug { fails: false },
            1,
        );
        assert!((rate - 8_000.0 / 22.0).abs() < 0.2, "{leg}: {rate} Hz");
    }
}

#[test]
fn direct_bus_with_bit_error_rate_1e_3_cycles_above_370_hz() {
    for seed in 0..3 {
        let rate = rate_with("wire/sbcp", FaultKind::Flip { rate: 1e-3 }, seed);
        println!("{rate} Hz");
        assert!((370.0..400.0).contains(&rate), "{rate} Hz");
    }
}

/// Boards with the first firmware, clocks within crystal tolerance and random tick phases.
fn first_firmware(seed: u64) -> BusConfig {
    let mut random = stream(seed, "phases");
    let phases = [(); 4].map(|()| SimDuration::from_nanos(random.between(0, 999_999)));
    let rates = [(); 4].map(|()| i64::try_from(random.between(0, 80_000)).unwrap() - 40_000);
    let mut config = with_clocks(free_running(BusTopology::Direct), rates, phases);
    for board in &mut config.boards {
        board.firmware.generation = Generation::First;
    }
    config
}

#[test]
fn first_firmware_averages_220_hz_and_guarantees_160_hz() {
    let (mut sum, mut worst, mut best, mut count) = (0.0, 0.0_f64, f64::MAX, 0.0);
    for seed in 0..40 {
        let (mean, shortest, longest) = cycles(&first_firmware(seed), millis(500));
        sum += mean;
        worst = worst.max(longest);
        best = best.min(shortest);
        count += 1.0;
    }
    let (mean_rate, half_range) = (count / sum, 0.5 * (worst - best));
    println!("mean {mean_rate} Hz, longest {worst} s, half-range {half_range} s");
    assert!((195.0..245.0).contains(&mean_rate), "{mean_rate} Hz");
    assert!((5.9e-3..=6.6e-3).contains(&worst), "{worst} s");
}

/// The wait for the main loop is uniform over its length, quantised to microframes of 125 µs.
#[test]
fn first_firmware_response_varies_by_half_a_millisecond() {
    // One board, whose clock drifts through all phases during the run.
    let mut config = first_firmware(1);
    config.boards.truncate(1);
    config.boards[0] = config.boards[0]
        .clone()
        .with_clock(1_000_000, SimDuration::ZERO)
        .unwrap();
    config.session.free_running = false;
    let mut harness = Harness::new(&config);
    harness.plant.turning = false;
    harness.open().unwrap();
    let (mut shortest, mut longest) = (f64::MAX, 0.0_f64);
    for _ in 0..1_000 {
        let period = millis(2).as_nanos();
        let at =
            twinrig_kernel::SimTime::from_nanos((harness.now().as_nanos() / period + 1) * period);
        harness.run_until(at).unwrap();
        harness.begin(&[0.0; 2]).unwrap();
        harness.run_until_idle(at + millis(3)).unwrap();
        let lasted = (harness.now() - at).as_secs_f64();
        shortest = shortest.min(lasted);
        longest = longest.max(lasted);
    }
    let half_range = 0.5 * (longest - shortest);
    assert!((0.43e-3..=0.57e-3).contains(&half_range), "{half_range} s");
}

#[test]
fn cycle_of_500_hz_is_exact_to_the_nanosecond() {
    let mut harness = Harness::new(&BusConfig::default());
    harness.open().unwrap();
    harness.passed = Some(Vec::new());
    let end = harness.now() + millis(1_000);
    harness.run_cycles(millis(2), end, |_| [0.1; 8]).unwrap();
    let begins = harness.cycle_begins();
    assert!(begins.windows(2).all(|pair| pair[1] - pair[0] == millis(2)));
    assert_eq!(harness.diagnostic("sbcp/cycle/shortest"), 2e-3);
    assert_eq!(harness.diagnostic("sbcp/cycle/longest"), 2e-3);
    // Requests arrive equally evenly: the timer of the host is synchronous with the frames.
    for leg in LEGS {
        assert!(harness.diagnostic(&format!("sbcp/{leg}/request/deviation")) < 1e-9);
    }
}
