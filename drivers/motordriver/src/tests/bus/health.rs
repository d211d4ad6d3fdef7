//! Faults are seen in the health of the bus; a healthy bus has none.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_motordriver::{BusConfig, BusTopology};
use twinrig_runtime::{BusHealth, IoTask};
use twinrig_wire::{Fault, FaultKind, FaultSchedule, FaultSelection};

use super::harness::{Harness, millis};

const AT: SimTime = SimTime::from_nanos(1_000_000_000);

fn config(topology: BusTopology, threshold: i64, faults: Vec<Fault>) -> BusConfig {
    let mut config = BusConfig {
        topology,
        faults: FaultSchedule { faults, seed: 3 },
        ..BusConfig::default()
    };
    config.session.error_threshold = threshold;
    config
}

fn controller() -> BusTopology {
    BusConfig::default().topology
}

fn fault(on: &str, kind: FaultKind, lasts: SimDuration) -> Fault {
    let (at, on) = (AT, on.into());
    Fault {
        at,
        on,
        kind,
        lasts,
        select: FaultSelection::default(),
    }
}

/// Cycles until half a second after [`AT`], with a period that both topologies keep.
fn run(config: &BusConfig) -> (Harness, Result<u64, String>) {
    let mut harness = Harness::new(config);
    harness.open().unwrap();
    let result = harness.run_cycles(millis(4), AT + millis(500), |at| {
        let phase = at.since_start().as_secs_f64() * 6.0;
        [0.2 * libm::sin(phase); 8]
    });
    (harness, result)
}

fn health(harness: &Harness) -> BusHealth {
    harness.task.bus_health(harness.now()).unwrap()
}

fn of_4_ms(mut config: BusConfig) -> BusConfig {
    config.session.period = std::time::Duration::from_millis(4);
    config
}

#[test]
fn healthy_buses_are_clean() {
    for topology in [controller(), BusTopology::Direct] {
        let (harness, result) = run(&of_4_ms(config(topology, 1, vec![])));
        result.unwrap();
        let health = health(&harness);
        assert!(health.is_clean(), "{health:?}");
        assert!(health.answers > 500 && health.packets >= health.answers);
        let silence = health.silence.unwrap();
        assert!(silence.length < silence.period, "{silence:?}");
    }
}

#[test]
fn dead_board_is_silent_and_named() {
    for topology in [controller(), BusTopology::Direct] {
        let kind = FaultKind::Unplug { fails: false };
        let faults = vec![fault("wire/sbcp/RF", kind, millis(10_000))];
        let (harness, result) = run(&of_4_ms(config(topology, -1, faults)));
        result.unwrap();
        let health = health(&harness);
        let silence = health.silence.as_ref().unwrap();
        assert_eq!(silence.device, "board RF (id 2)");
        assert!(
            silence.is_dead() && silence.length > millis(480),
            "{silence:?}"
        );
        let [error] = &health.errors[..] else {
            panic!("{health:?}")
        };
        assert_eq!(
            (error.kind, &*error.device),
            ("no answer", "board RF (id 2)")
        );
        assert_eq!(error.count as f64, harness.diagnostic("sbcp/errors"));
        assert!(
            error.first.as_nanos() - AT.as_nanos() < 6_000_000,
            "{error:?}"
        );
        assert!(health.late.is_empty(), "{health:?}");
    }
}

/// Answers of all boards that are late on the way to the host; the fault delays both directions.
fn late(by: SimDuration) -> Vec<Fault> {
    let by = SimDuration::from_nanos(by.as_nanos() / 2);
    let place = "wire/sbcp/link";
    vec![fault(place, FaultKind::Delay { by }, millis(10_000))]
}

#[test]
fn late_answers_are_counted_with_their_lateness_and_not_taken_for_new_ones() {
    for topology in [controller(), BusTopology::Direct] {
        for by in [1, 3] {
            let config = config(topology, -1, late(millis(by)));
            let (harness, result) = run(&of_4_ms(config));
            result.unwrap();
            let health = health(&harness);
            // The time-out of a whole frame admits 1 ms for all boards but the last one.
            let by_one = topology != BusTopology::Direct && by == 1;
            let late = if by_one { 1 } else { 4 };
            assert_eq!(health.late.len(), late, "{by} ms: {health:?}");
            for device in &health.late {
                assert!(
                    device.worst <= millis(by) + millis(1),
                    "{by} ms: {device:?}"
                );
            }
            // Stale answers are used until a surplus one has shown the delay: two cycles at most.
            let held = harness.diagnostic("sbcp/held");
            let used = (health.error_count() + health.stale) as f64 - held;
            assert!(used <= 8.0, "{by} ms, {used} of them used: {health:?}");
            assert!(!health.is_clean());
        }
    }
}

#[test]
fn bus_is_given_up_with_all_late_boards_named() {
    for (topology, by) in [
        (BusTopology::Direct, 1),
        (BusTopology::Direct, 3),
        (controller(), 3),
    ] {
        let config = of_4_ms(config(topology, 1, late(millis(by))));
        let (mut harness, result) = run(&config);
        let error = result.and_then(|_| harness.run_until_idle(AT + millis(600)));
        let error = error.unwrap_err();
        for board in ["LF (id 1)", "RF (id 2)", "LH (id 3)", "RH (id 4)"] {
            assert!(error.contains(board), "{error}");
        }
        assert!(
            error.contains("late") && !error.contains("silent"),
            "{error}"
        );
    }
}

/// Behind the bus controller a late answer cannot be told from none: it is dropped there.
#[test]
fn boards_that_are_all_silent_to_the_bus_controller_are_said_to_be_late_or_cut_off() {
    let by = SimDuration::from_micros(500);
    let late = fault("wire/sbcp", FaultKind::Delay { by }, millis(10_000));
    let config = of_4_ms(config(controller(), 1, vec![late]));
    let (mut harness, result) = run(&config);
    let error = result.and_then(|_| harness.run_until_idle(AT + millis(600)));
    let error = error.unwrap_err();
    for board in ["LF (id 1)", "RF (id 2)", "LH (id 3)", "RH (id 4)"] {
        assert!(error.contains(board), "{error}");
    }
    assert!(error.contains("late, or cut off"), "{error}");
}

#[test]
fn wrong_clock_of_a_board_is_seen_on_either_side() {
    for rate_ppb in [20_000_000, -20_000_000] {
        let mut config = config(controller(), 1, vec![]);
        config.session.period = std::time::Duration::from_millis(2);
        let board = config.boards[1].clone();
        config.boards[1] = board.with_clock(rate_ppb, SimDuration::ZERO).unwrap();
        let mut harness = Harness::new(&config);
        harness.open().unwrap();
        let end = harness.now() + millis(2_000);
        harness.run_cycles(millis(2), end, |_| [0.1; 8]).unwrap();
        let health = health(&harness);
        assert!(!health.is_clean(), "{rate_ppb}: {health:?}");
        let slow = health
            .errors
            .iter()
            .any(|error| error.kind.contains("clock"));
        assert!(health.missed_points > 0 || slow, "{rate_ppb}: {health:?}");
    }
}

#[test]
fn lost_packet_in_the_opening_is_repeated_and_counted() {
    for at_ms in [10, 30, 60] {
        let mut lost = fault("wire/sbcp", FaultKind::Drop { probability: 1.0 }, millis(2));
        lost.at = SimTime::ZERO + millis(at_ms);
        let mut harness = Harness::new(&config(BusTopology::Direct, 1, vec![lost]));
        harness.open().unwrap();
        let end = harness.now() + millis(100);
        harness.run_cycles(millis(4), end, |_| [0.1; 8]).unwrap();
        assert_eq!(health(&harness).error_count(), 1, "{at_ms} ms");
    }
}

#[test]
fn restored_bus_reports_the_same_health() {
    let kind = FaultKind::Drop { probability: 0.2 };
    let config = of_4_ms(config(
        BusTopology::Direct,
        -1,
        vec![fault("wire/sbcp", kind, millis(200))],
    ));
    let mut harness = Harness::new(&config);
    harness.open().unwrap();
    harness
        .run_cycles(millis(4), AT + millis(100), |_| [0.2; 8])
        .unwrap();
    let saved = harness.save();
    let end = AT + millis(300);
    harness.run_cycles(millis(4), end, |_| [0.1; 8]).unwrap();
    let unbroken = health(&harness);
    harness.restore(&saved);
    harness.run_cycles(millis(4), end, |_| [0.1; 8]).unwrap();
    assert_eq!(health(&harness), unbroken);
    assert!(unbroken.error_count() > 0);
}

/// Between bus controller and boards: the controller takes an answer for that to its own request
/// when it comes at the right moment, so lateness shows as errors only.
#[test]
fn lateness_behind_the_bus_controller_is_not_clean() {
    let by = SimDuration::from_micros(1_500);
    let late = fault("wire/sbcp", FaultKind::Delay { by }, millis(10_000));
    let (harness, result) = run(&of_4_ms(config(controller(), -1, vec![late])));
    result.unwrap();
    let health = health(&harness);
    assert!(health.error_count() >= 4, "{health:?}");
}
