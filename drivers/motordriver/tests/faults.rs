//! What goes wrong is counted, held and got over.

mod common;

use common::{Bench, LEGS, millis};
use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_motordriver::{BusConfig, BusTopology};
use twinrig_runtime::IoTask;
use twinrig_wire::{Fault, FaultKind, FaultSchedule};

fn tolerant(faults: Vec<Fault>) -> BusConfig {
    let mut config = BusConfig {
        faults: FaultSchedule { faults, seed: 3 },
        ..BusConfig::default()
    };
    config.session.error_threshold = -1;
    config
}

fn unplugged(on: &str, at: SimTime, lasts: SimDuration) -> Fault {
    Fault {
        at,
        on: on.into(),
        kind: FaultKind::Unplug { fails: false },
        lasts,
    }
}

const AT: SimTime = SimTime::from_nanos(1_000_000_000);

/// A second of cycles with a fault amid it.
fn run(config: &BusConfig) -> Result<Bench, String> {
    let mut bench = Bench::new(config);
    bench.open()?;
    let end = AT + millis(500);
    bench.run_cycles(millis(2), end, |_| [0.2; 8])?;
    bench.run_until_idle(end + millis(4))?;
    Ok(bench)
}

#[test]
fn one_board_that_is_off_for_a_while_costs_its_own_data_alone() {
    let fault = unplugged("wire/sbcp/RF", AT, millis(50));
    let mut bench = Bench::new(&tolerant(vec![fault]));
    bench.open().unwrap();
    bench.run_cycles(millis(2), AT, |_| [0.2; 8]).unwrap();
    let before = bench.task.to_process()[8..16].to_vec();
    let to = AT + millis(40);
    bench.run_cycles(millis(2), to, |_| [0.1; 8]).unwrap();
    // Held for the one, gone on for the others.
    assert_eq!(bench.task.to_process()[8..16], before[..]);
    assert!((bench.task.to_process()[0] - 0.1).abs() < 0.02);
    let to = AT + millis(500);
    bench.run_cycles(millis(2), to, |_| [0.1; 8]).unwrap();
    assert!((bench.task.to_process()[8] - 0.1).abs() < 0.02);
    let errors = bench.diagnostic("sbcp/errors");
    assert!((24.0..=26.0).contains(&errors), "{errors}");
    assert_eq!(bench.diagnostic("sbcp/held"), errors);
    // 25 commands are more than ten periods.
    assert_eq!(bench.diagnostic("sbcp/RF/watchdog_drops"), 1.0);
    assert_eq!(bench.diagnostic("sbcp/LF/watchdog_drops"), 0.0);
}

#[test]
fn nine_commands_lost_in_a_row_are_got_over_and_ten_are_not() {
    for (lost, drops) in [(9, 0.0), (10, 1.0)] {
        // From between two cycles to between two others.
        let from = AT + millis(1) + SimDuration::from_micros(500);
        let fault = unplugged("wire/sbcp/LF", from, millis(2 * lost));
        let bench = run(&tolerant(vec![fault])).unwrap();
        assert_eq!(bench.diagnostic("sbcp/errors"), lost as f64);
        assert_eq!(
            bench.diagnostic("sbcp/LF/watchdog_drops"),
            drops,
            "{lost} lost"
        );
        assert!(bench.diagnostic("sbcp/LF/missed_points") > 0.0);
    }
}

#[test]
fn an_error_ends_the_run_where_none_is_tolerated_and_says_which() {
    let fault = unplugged("wire/sbcp/LH", AT, millis(3));
    let mut config = tolerant(vec![fault]);
    config.session.error_threshold = 1;
    let Err(error) = run(&config) else {
        panic!("an error was tolerated")
    };
    assert!(error.contains("board LH (id 3): silent"), "{error}");
}

/// A board that talks without a pause for a second, directly on the bus: bytes never end to come.
fn babble() -> BusConfig {
    let fault = Fault {
        at: AT,
        on: "wire/sbcp/RF".into(),
        kind: FaultKind::Babble {
            pause: SimDuration::ZERO,
        },
        lasts: millis(1_000),
    };
    BusConfig {
        topology: BusTopology::Direct,
        ..tolerant(vec![fault])
    }
}

#[test]
fn who_talks_without_end_costs_errors_and_not_the_bus() {
    for free_running in [false, true] {
        let mut config = babble();
        config.session.free_running = free_running;
        let mut bench = Bench::new(&config);
        bench.open().unwrap();
        bench.run_cycles(millis(10), AT, |_| [0.2; 8]).unwrap();
        let before = bench.diagnostic("sbcp/cycles");
        let end = AT + millis(1_000);
        bench.run_cycles(millis(10), end, |_| [0.2; 8]).unwrap();
        // Draining takes 2 ms, and four time-outs of 0.9 ms follow.
        let cycles = bench.diagnostic("sbcp/cycles") - before;
        assert!(cycles >= 99.0, "{cycles} cycles in a second");
        let errors = bench.diagnostic("sbcp/errors");
        assert!(errors > 3.0 * cycles, "{errors} errors in {cycles} cycles");
        if !free_running {
            assert!(bench.diagnostic("sbcp/drain_timeouts") > 90.0);
        }
        bench.run_until_idle(end + millis(10)).unwrap_or(());
        let errors = bench.diagnostic("sbcp/errors");
        bench
            .run_cycles(millis(10), end + millis(500), |_| [0.2; 8])
            .unwrap();
        assert!(bench.diagnostic("sbcp/errors") - errors <= 4.0);
    }
}

#[test]
fn who_talks_without_end_ends_a_run_that_tolerates_ten_errors() {
    let mut config = babble();
    config.session.error_threshold = 10;
    let mut bench = Bench::new(&config);
    bench.open().unwrap();
    let run = bench.run_cycles(millis(10), AT + millis(1_000), |_| [0.2; 8]);
    assert!(run.unwrap_err().contains("given up at 10"));
    assert!(bench.now() < AT + millis(40), "at {}", bench.now());
}

#[test]
fn catching_up_is_clipped_to_the_greatest_speed() {
    let fastest = |max_speed| {
        let fault = unplugged("wire/sbcp", AT, millis(15));
        let mut config = tolerant(vec![fault]);
        config.session.gains.max_speed = max_speed;
        let mut bench = Bench::new(&config);
        bench.open().unwrap();
        let begin = bench.now();
        let ramp = |now: SimTime| [(now - begin).as_secs_f64() - 0.9; 8];
        bench.run_cycles(millis(2), AT, ramp).unwrap();
        bench.plant.fastest.fill(0.0);
        bench.run_cycles(millis(2), AT + millis(200), ramp).unwrap();
        bench.plant.fastest[0]
    };
    // The ramp is of 1 rad/s; 1000 counts/s are 1.53 rad/s.
    let (clipped, free) = (fastest(1_000), fastest(32_000));
    assert!(clipped < 3.2 && free > clipped + 1.0, "{clipped} {free}");
}

#[test]
fn a_fault_that_never_comes_changes_nothing() {
    let run = |faults| {
        let mut bench = Bench::new(&BusConfig {
            trace: true,
            ..tolerant(faults)
        });
        bench.passed = Some(Vec::new());
        bench.open().unwrap();
        let end = bench.now() + millis(100);
        bench.run_cycles(millis(2), end, |_| [0.2; 8]).unwrap();
        let mut traces = [(); 4].map(|()| Vec::new());
        for (_, trace, bytes) in bench.passed.take().unwrap() {
            traces[trace].extend(bytes);
        }
        let diagnostics = bench.diagnostics().into_iter();
        let of_boards = |(name, _): &(String, f64)| LEGS.iter().any(|leg| name.contains(leg));
        (diagnostics.filter(of_boards).collect::<Vec<_>>(), traces)
    };
    let later = AT + SimDuration::from_secs(1_000);
    let far = unplugged("wire/sbcp", later, millis(1));
    let (without, with) = (run(vec![]), run(vec![far]));
    assert_eq!(without.0, with.0);
    for (trace, (without, with)) in without.1.iter().zip(&with.1).enumerate() {
        assert!(without == with, "lane {trace}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    /// Whatever bits turn round: no reply is believed that no board gave, nothing hangs, and cycles are good again
    /// as soon as the fault is over.
    #[test]
    fn noise_is_counted_and_got_over(rate in 1e-5_f64..3e-2, on_link in any::<bool>(), seed in any::<u64>()) {
        let on = if on_link { "wire/sbcp/link" } else { "wire/sbcp" };
        let fault = Fault {
            at: AT,
            on: on.into(),
            kind: FaultKind::Flip { rate },
            lasts: millis(200),
        };
        let mut config = tolerant(vec![fault]);
        config.faults.seed = seed;
        let mut bench = Bench::new(&config);
        bench.open().unwrap();
        bench.run_cycles(millis(2), AT + millis(205), |_| [0.2; 8]).unwrap();
        bench.run_until_idle(AT + millis(212)).unwrap();
        let errors = bench.diagnostic("sbcp/errors");
        let cycles = bench.run_cycles(millis(2), AT + millis(400), |_| [0.2; 8]).unwrap();
        prop_assert!(cycles >= 90, "{} cycles", cycles);
        let after = bench.diagnostic("sbcp/errors") - errors;
        prop_assert!(after <= 8.0, "{after} errors after the fault");
        for (n, leg) in LEGS.iter().enumerate() {
            let position = bench.task.to_process()[8 * n];
            prop_assert!((position - 0.2).abs() < 0.02, "{leg}: {position}");
        }
    }
}
