//! Faults are counted, data are held, and the bus recovers.

use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_motordriver::{BusConfig, BusTopology};
use twinrig_runtime::IoTask;
use twinrig_wire::{Fault, FaultKind, FaultSchedule, FaultSelection};

use super::harness::{Harness, LEGS, millis};

fn tolerant(faults: Vec<Fault>) -> BusConfig {
    let mut config = BusConfig {
        faults: FaultSchedule { faults, seed: 3 },
        ..BusConfig::default()
    };
    config.session.error_threshold = -1;
    config
}

fn unplugged(on: &str, at: SimTime, lasts: SimDuration) -> Fault {
    fault(on, at, FaultKind::Unplug { fails: false }, lasts)
}

fn fault(on: &str, at: SimTime, kind: FaultKind, lasts: SimDuration) -> Fault {
    Fault {
        at,
        on: on.into(),
        kind,
        lasts,
        select: FaultSelection::default(),
    }
}

const AT: SimTime = SimTime::from_nanos(1_000_000_000);

/// A second of cycles with a fault in the middle.
fn run(config: &BusConfig) -> Result<Harness, String> {
    let mut harness = Harness::new(config);
    harness.open()?;
    let end = AT + millis(500);
    harness.run_cycles(millis(2), end, |_| [0.2; 8])?;
    harness.run_until_idle(end + millis(4))?;
    Ok(harness)
}

#[test]
fn unplugged_board_affects_its_own_data_only() {
    let fault = unplugged("wire/sbcp/RF", AT, millis(50));
    let mut harness = Harness::new(&tolerant(vec![fault]));
    harness.open().unwrap();
    harness.run_cycles(millis(2), AT, |_| [0.2; 8]).unwrap();
    let before = harness.task.to_process()[8..16].to_vec();
    let to = AT + millis(40);
    harness.run_cycles(millis(2), to, |_| [0.1; 8]).unwrap();
    // Held for the faulty board, updated for the others.
    assert_eq!(harness.task.to_process()[8..16], before[..]);
    assert!((harness.task.to_process()[0] - 0.1).abs() < 0.02);
    let to = AT + millis(500);
    harness.run_cycles(millis(2), to, |_| [0.1; 8]).unwrap();
    assert!((harness.task.to_process()[8] - 0.1).abs() < 0.02);
    let errors = harness.diagnostic("sbcp/errors");
    assert!((24.0..=26.0).contains(&errors), "{errors}");
    assert_eq!(harness.diagnostic("sbcp/held"), errors);
    // 25 commands are more than ten periods.
    assert_eq!(harness.diagnostic("sbcp/RF/watchdog_drops"), 1.0);
    assert_eq!(harness.diagnostic("sbcp/LF/watchdog_drops"), 0.0);
}

#[test]
fn nine_consecutive_lost_commands_are_tolerated_and_ten_drop_the_motors() {
    for (lost, drops) in [(9, 0.0), (10, 1.0)] {
        // Start and end lie between two cycles each.
        let from = AT + millis(1) + SimDuration::from_micros(500);
        let fault = unplugged("wire/sbcp/LF", from, millis(2 * lost));
        let harness = run(&tolerant(vec![fault])).unwrap();
        assert_eq!(harness.diagnostic("sbcp/errors"), lost as f64);
        assert_eq!(
            harness.diagnostic("sbcp/LF/watchdog_drops"),
            drops,
            "{lost} lost"
        );
        assert!(harness.diagnostic("sbcp/LF/missed_points") > 0.0);
    }
}

#[test]
fn error_ends_an_intolerant_run_and_is_named() {
    let fault = unplugged("wire/sbcp/LH", AT, millis(3));
    let mut config = tolerant(vec![fault]);
    config.session.error_threshold = 1;
    let Err(error) = run(&config) else {
        panic!("an error was tolerated")
    };
    assert!(error.contains("board LH (id 3): silent"), "{error}");
}

/// A board that transmits continuously for a second, directly on the bus.
fn babble() -> BusConfig {
    let fault = Fault {
        at: AT,
        on: "wire/sbcp/RF".into(),
        kind: FaultKind::Babble {
            pause: SimDuration::ZERO,
        },
        lasts: millis(1_000),
        select: FaultSelection::default(),
    };
    BusConfig {
        topology: BusTopology::Direct,
        ..tolerant(vec![fault])
    }
}

#[test]
fn continuous_transmission_costs_errors_but_not_the_bus() {
    for free_running in [false, true] {
        let mut config = babble();
        config.session.free_running = free_running;
        let mut harness = Harness::new(&config);
        harness.open().unwrap();
        harness.run_cycles(millis(10), AT, |_| [0.2; 8]).unwrap();
        let before = harness.diagnostic("sbcp/cycles");
        let end = AT + millis(1_000);
        harness.run_cycles(millis(10), end, |_| [0.2; 8]).unwrap();
        // Draining takes 2 ms, followed by four time-outs of 0.9 ms.
        let cycles = harness.diagnostic("sbcp/cycles") - before;
        assert!(cycles >= 99.0, "{cycles} cycles in a second");
        let errors = harness.diagnostic("sbcp/errors");
        assert!(errors > 3.0 * cycles, "{errors} errors in {cycles} cycles");
        if !free_running {
            assert!(harness.diagnostic("sbcp/drain_timeouts") > 90.0);
        }
        harness.run_until_idle(end + millis(10)).unwrap_or(());
        let errors = harness.diagnostic("sbcp/errors");
        harness
            .run_cycles(millis(10), end + millis(500), |_| [0.2; 8])
            .unwrap();
        assert!(harness.diagnostic("sbcp/errors") - errors <= 4.0);
    }
}

#[test]
fn continuous_transmission_ends_a_run_that_tolerates_ten_errors() {
    let mut config = babble();
    config.session.error_threshold = 10;
    let mut harness = Harness::new(&config);
    harness.open().unwrap();
    let run = harness.run_cycles(millis(10), AT + millis(1_000), |_| [0.2; 8]);
    assert!(run.unwrap_err().contains("given up at 10"));
    assert!(harness.now() < AT + millis(40), "at {}", harness.now());
}

#[test]
fn catching_up_is_limited_to_the_maximum_speed() {
    let fastest = |max_speed| {
        let fault = unplugged("wire/sbcp", AT, millis(15));
        let mut config = tolerant(vec![fault]);
        config.session.gains.max_speed = max_speed;
        let mut harness = Harness::new(&config);
        harness.open().unwrap();
        let begin = harness.now();
        let ramp = |now: SimTime| [(now - begin).as_secs_f64() - 0.9; 8];
        harness.run_cycles(millis(2), AT, ramp).unwrap();
        harness.plant.fastest.fill(0.0);
        harness
            .run_cycles(millis(2), AT + millis(200), ramp)
            .unwrap();
        harness.plant.fastest[0]
    };
    // The ramp is of 1 rad/s; 1000 counts/s are 1.53 rad/s.
    let (clipped, free) = (fastest(1_000), fastest(32_000));
    assert!(clipped < 3.2 && free > clipped + 1.0, "{clipped} {free}");
}

#[test]
fn fault_after_the_end_has_no_effect() {
    let run = |faults| {
        let mut harness = Harness::new(&BusConfig {
            trace: true,
            ..tolerant(faults)
        });
        harness.passed = Some(Vec::new());
        harness.open().unwrap();
        let end = harness.now() + millis(100);
        harness.run_cycles(millis(2), end, |_| [0.2; 8]).unwrap();
        let mut traces = [(); 4].map(|()| Vec::new());
        for (_, trace, bytes) in harness.passed.take().unwrap() {
            traces[trace].extend(bytes);
        }
        let diagnostics = harness.diagnostics().into_iter();
        let of_boards = |(name, _): &(String, f64)| LEGS.iter().any(|leg| name.contains(leg));
        (diagnostics.filter(of_boards).collect::<Vec<_>>(), traces)
    };
    let later = AT + SimDuration::from_secs(1_000);
    let far = unplugged("wire/sbcp", later, millis(1));
    let (without, with) = (run(vec![]), run(vec![far]));
    assert_eq!(without.0, with.0);
    for (trace, (without, with)) in without.1.iter().zip(&with.1).enumerate() {
        assert!(without == with, "trace {trace}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    /// With random bit errors, no reply is accepted that no board sent, nothing hangs, and cycles
    /// succeed again as soon as the fault ends.
    #[test]
    fn bit_errors_are_counted_and_recovered_from(rate in 1e-5_f64..3e-2, on_link in any::<bool>(), seed in any::<u64>()) {
        let on = if on_link { "wire/sbcp/link" } else { "wire/sbcp" };
        let fault = Fault {
            at: AT,
            on: on.into(),
            kind: FaultKind::Flip { rate },
            lasts: millis(200),
            select: FaultSelection::default(),
        };
        let mut config = tolerant(vec![fault]);
        config.faults.seed = seed;
        let mut harness = Harness::new(&config);
        harness.open().unwrap();
        harness.run_cycles(millis(2), AT + millis(205), |_| [0.2; 8]).unwrap();
        harness.run_until_idle(AT + millis(212)).unwrap();
        let errors = harness.diagnostic("sbcp/errors");
        let cycles = harness.run_cycles(millis(2), AT + millis(400), |_| [0.2; 8]).unwrap();
        prop_assert!(cycles >= 90, "{} cycles", cycles);
        let after = harness.diagnostic("sbcp/errors") - errors;
        prop_assert!(after <= 8.0, "{after} errors after the fault");
        for (n, leg) in LEGS.iter().enumerate() {
            let position = harness.task.to_process()[8 * n];
            prop_assert!((position - 0.2).abs() < 0.02, "{leg}: {position}");
        }
    }
}

/// A board whose supply fails is silent until it has booted; then it answers and coasts, since its
/// gains and modes are at their values at power-on.
#[test]
fn board_coasts_after_a_brown_out_until_it_is_opened_again() {
    for (on, boards) in [("wire/sbcp/RF", 1.0), ("wire/sbcp", 4.0)] {
        let from = AT + millis(1);
        let kind = FaultKind::BrownOut { boot: None };
        let config = tolerant(vec![fault(on, from, kind, millis(20))]);
        let mut harness = run(&config).unwrap();
        // 20 ms and 50 ms to boot are 35 cycles.
        assert_eq!(harness.diagnostic("sbcp/errors"), 35.0 * boards, "{on}");
        // Voltage and bridge of hip and knee of each leg.
        let driven = |harness: &Harness| [1, 3, 5, 7].map(|n| harness.plant.inputs[2 * n + 1]);
        let [lf, rf, ..] = driven(&harness);
        assert_eq!((lf, rf), (f64::from(boards < 2.0), 0.0), "{on}");
        harness.open().unwrap();
        let to = harness.now() + millis(200);
        harness.run_cycles(millis(2), to, |_| [0.2; 8]).unwrap();
        assert_eq!(driven(&harness), [1.0; 4], "{on}");
    }
}

/// The interpolator fills or misses a step for each tick that the clock of its board loses or gains
/// on that of the host: 2 % of 500 ms, ten.
#[test]
fn drift_of_a_clock_is_filled_or_missed_steps_of_its_board() {
    for (percent, steps) in [(2, -10.0), (-2, 10.0)] {
        let rate_ppb = percent * 10_000_000;
        let drift = fault(
            "wire/sbcp/RF",
            AT,
            FaultKind::Drift { rate_ppb },
            millis(500),
        );
        let harness = run(&tolerant(vec![drift])).unwrap();
        let gained = |board: &str| {
            let count = |name: &str| harness.diagnostic(&format!("sbcp/{board}/{name}"));
            count("filled_steps") - count("missed_points")
        };
        // A step of the phase of the tick and the period at each end.
        assert!((gained("RF") - steps).abs() <= 2.0, "{}", gained("RF"));
        assert!(gained("LF").abs() <= 2.0, "{}", gained("LF"));
    }
}
