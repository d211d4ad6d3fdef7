//! How fast cycles can be (thesis, section 5.3.2), from the bytes up.

mod common;

use common::{Bench, millis, with_clocks};
use twinrig_kernel::{SimDuration, stream};
use twinrig_motordriver::{BusConfig, BusTopology, Generation};
use twinrig_wire::{Fault, FaultKind, FaultSchedule};

fn free_running(topology: BusTopology) -> BusConfig {
    let mut config = BusConfig {
        topology,
        ..BusConfig::default()
    };
    config.session.free_running = true;
    config
}

/// Mean, shortest and longest time from one cycle to the next \[s\], over `length`: from the bytes that the host wrote, not
/// from what it says of them.
fn cycles(config: &BusConfig, length: SimDuration) -> (f64, f64, f64) {
    let mut bench = Bench::new(config);
    bench.plant.turning = false;
    bench.open().unwrap();
    bench.passed = Some(Vec::new());
    bench.begin(&[0.0; 8]).unwrap();
    bench.run_until(bench.now() + length).unwrap();
    assert_eq!(bench.diagnostic("sbcp/errors"), 0.0);
    let begins = bench.cycle_begins();
    let intervals = begins.windows(2).map(|pair| pair[1] - pair[0]);
    let (count, span) = (begins.len() - 1, begins[begins.len() - 1] - begins[0]);
    (
        span.as_secs_f64() / count as f64,
        intervals.clone().min().unwrap().as_secs_f64(),
        intervals.max().unwrap().as_secs_f64(),
    )
}

fn is(found: f64, expected: f64) -> bool {
    (found - expected).abs() < 1e-9
}

#[test]
fn without_a_bus_controller_a_board_takes_625_us_and_a_cycle_400_hz() {
    let (mean, shortest, longest) = cycles(&free_running(BusTopology::Direct), millis(500));
    assert!(is(mean, 2.5e-3) && is(shortest, 2.5e-3) && is(longest, 2.5e-3));
}

#[test]
fn through_the_bus_controller_a_cycle_takes_exactly_a_millisecond() {
    let config = BusConfig::default();
    let (mean, shortest, longest) = cycles(&free_running(config.topology), millis(500));
    assert!(
        is(mean, 1e-3) && is(shortest, 1e-3) && is(longest, 1e-3),
        "{mean} {shortest} {longest}"
    );
}

/// Cycles a second of a direct bus with a fault, counted by the requests to the first board over 10 s.
fn rate_with(on: &str, kind: FaultKind, seed: u64) -> f64 {
    let mut config = free_running(BusTopology::Direct);
    config.session.error_threshold = -1;
    let mut bench = Bench::new(&config);
    bench.open().unwrap();
    // Once the boards are ready.
    let fault = Fault {
        at: bench.now(),
        on: on.to_owned(),
        kind,
        lasts: SimDuration::from_secs(1_000),
    };
    config.faults = FaultSchedule {
        faults: vec![fault],
        seed,
    };
    let mut bench = Bench::new(&config);
    bench.plant.turning = false;
    bench.open().unwrap();
    bench.passed = Some(Vec::new());
    bench.begin(&[0.0; 8]).unwrap();
    let begin = bench.now();
    bench.run_until(begin + SimDuration::from_secs(10)).unwrap();
    assert!(bench.diagnostic("sbcp/errors") > 100.0);
    bench.cycle_begins().len() as f64 / 10.0
}

/// It costs its time-out, 7 microframes, instead of 5.
#[test]
fn a_silent_board_leaves_a_direct_bus_364_hz_whichever_it_is() {
    for leg in common::LEGS {
        let rate = rate_with(
            &format!("wire/sbcp/{leg}"),
            FaultKind::Unplug { fails: false },
            1,
        );
        assert!((rate - 8_000.0 / 22.0).abs() < 0.2, "{leg}: {rate} Hz");
    }
}

#[test]
fn bit_errors_of_a_thousandth_leave_a_direct_bus_370_hz() {
    for seed in 0..3 {
        let rate = rate_with("wire/sbcp", FaultKind::Flip { rate: 1e-3 }, seed);
        println!("{rate} Hz");
        assert!((370.0..400.0).contains(&rate), "{rate} Hz");
    }
}

/// Boards with the first firmware, whose clocks differ by crystals and whose ticks come at random.
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
fn the_first_firmware_does_some_220_hz_and_guarantees_some_160() {
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

/// The wait for the main loop is between nothing and its whole length, seen through microframes of 0.125 ms.
#[test]
fn a_board_with_the_first_firmware_answers_within_half_a_millisecond_of_its_mean() {
    // One board, whose clock drifts past all phases within the run.
    let mut config = first_firmware(1);
    config.boards.truncate(1);
    config.boards[0] = config.boards[0]
        .clone()
        .with_clock(1_000_000, SimDuration::ZERO)
        .unwrap();
    config.session.free_running = false;
    let mut bench = Bench::new(&config);
    bench.plant.turning = false;
    bench.open().unwrap();
    let (mut shortest, mut longest) = (f64::MAX, 0.0_f64);
    for _ in 0..1_000 {
        let period = millis(2).as_nanos();
        let at =
            twinrig_kernel::SimTime::from_nanos((bench.now().as_nanos() / period + 1) * period);
        bench.run_until(at).unwrap();
        bench.begin(&[0.0; 2]).unwrap();
        bench.run_until_idle(at + millis(3)).unwrap();
        let lasted = (bench.now() - at).as_secs_f64();
        shortest = shortest.min(lasted);
        longest = longest.max(lasted);
    }
    let half_range = 0.5 * (longest - shortest);
    assert!((0.43e-3..=0.57e-3).contains(&half_range), "{half_range} s");
}

#[test]
fn a_500_hz_cycle_is_kept_to_the_nanosecond() {
    let mut bench = Bench::new(&BusConfig::default());
    bench.open().unwrap();
    bench.passed = Some(Vec::new());
    let end = bench.now() + millis(1_000);
    bench.run_cycles(millis(2), end, |_| [0.1; 8]).unwrap();
    let begins = bench.cycle_begins();
    assert!(begins.windows(2).all(|pair| pair[1] - pair[0] == millis(2)));
    assert_eq!(bench.diagnostic("sbcp/cycle/shortest"), 2e-3);
    assert_eq!(bench.diagnostic("sbcp/cycle/longest"), 2e-3);
    // Requests come to the boards as evenly: the timer of the host runs with the frames.
    for leg in common::LEGS {
        assert!(bench.diagnostic(&format!("sbcp/{leg}/request/deviation")) < 1e-9);
    }
}
