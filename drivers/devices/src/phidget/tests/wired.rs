//! Driver and board connected by a wire, in a rig.

use crate::FramedDevice;
use crate::phidget::{AnalogInput, Board, Gain, Phidget};
use crate::tests::{self, check_missing, force_plant};
use twinrig_kernel::SimDuration;
use twinrig_runtime::{Rig, RunEvent};
use twinrig_testing::rig_harness;
use twinrig_testing::rig_harness::{check_restored, check_zero, diagnostic, run};
use twinrig_wire::{AnalogSource, FaultKind, FaultSchedule};

fn input(channel: usize, component: usize, scale: f64) -> AnalogInput {
    AnalogInput {
        channel,
        analog_source: Some(AnalogSource {
            signal: "leg/LF/foot/force".into(),
            component,
            scale,
            offset: 0.0,
        }),
    }
}

pub(super) fn bridge(interval_ms: u64) -> Phidget {
    let interval = SimDuration::from_millis(interval_ms);
    let gain = Gain::X64;
    let mut board = Phidget::new("phidget", Board::Bridge { interval, gain });
    board.inputs = vec![input(0, 0, 1e-4), input(3, 1, 1e-4)];
    board
}

pub(super) fn kit() -> Phidget {
    let mut board = Phidget::new("phidget", Board::INTERFACE_KIT);
    board.inputs = vec![input(2, 0, 0.1), input(7, 1, 0.1)];
    board
}

/// 40 N/s along x, and 300 N along y.
fn force(seconds: f64, axis: usize) -> f64 {
    [40.0 * seconds, 300.0, 0.0][axis]
}

fn wired(board: &Phidget, faults: &FaultSchedule) -> Rig {
    tests::wired(board, faults, (2, |_| 0.0), force_plant(force))
}

fn fault(kind: FaultKind, from_ms: u64, for_ms: u64) -> FaultSchedule {
    rig_harness::fault("wire/phidget", kind, from_ms, for_ms)
}

#[test]
fn bridge_reports_once_per_interval_and_transfers_never_wait() {
    for (interval_ms, expected) in [(8, 123.0), (16, 61.0), (80, 12.0), (1000, 1.0)] {
        let mut rig = wired(&bridge(interval_ms), &FaultSchedule::default());
        let (log, result) = run(&mut rig, 1000);
        result.unwrap();
        let health = rig.bus_health().remove(0).1;
        assert!(health.is_clean() && health.silence.is_some(), "{health:?}");
        let reports = diagnostic(&rig, &log, "phidget/reports");
        assert!(
            (expected..=expected + 2.0).contains(&reports),
            "{interval_ms} ms: {reports}"
        );
        assert_eq!(
            log.count(|event| matches!(event, RunEvent::TaskSkipped { .. })),
            0
        );
        check_zero(
            &rig,
            &log,
            "phidget",
            &["lost", "stale", "foreign", "garbage", "unheard"],
        );
    }
}

#[test]
fn ratios_have_24_bits_and_saturate_at_the_inverse_gain() {
    let mut rig = wired(&bridge(8), &FaultSchedule::default());
    let (log, result) = run(&mut rig, 500);
    result.unwrap();
    let (at, last) = log.inputs.last().unwrap();
    let expected = 1e-4 * 40.0 * at.as_secs_f64();
    // The plant was paused until the board was set up.
    assert!(
        (expected - last[0]).abs() < 1e-4 * 40.0 * 0.045,
        "{at} {last:?}"
    );
    let count = last[0] * 64.0 * f64::from(1 << 23);
    assert!((count - count.round()).abs() < 1e-6);
    assert_eq!(last[1..3], [0.0, 0.0]);
    assert!(
        (last[3] - 1.0 / 64.0).abs() < 1e-8,
        "0.03 is out of range: {last:?}"
    );
    assert!(diagnostic(&rig, &log, "phidget/overloaded") > 50.0);
}

#[test]
fn interface_kit_reports_changes() {
    let mut rig = wired(&kit(), &FaultSchedule::default());
    let (log, result) = run(&mut rig, 1000);
    result.unwrap();
    // 4 V/s are 6.4 thousandths of 5 V in 8 ms: 10 accumulate at every second poll.
    let reports = diagnostic(&rig, &log, "phidget/reports");
    assert!((60.0..=63.0).contains(&reports), "{reports}");
    let (at, last) = log.inputs.last().unwrap();
    assert!(
        (4.0 * at.as_secs_f64() - last[2]).abs() < 4.0 * 0.06,
        "{at} {last:?}"
    );
    assert_eq!(last[7], 5.0, "30 V are out of range");
    assert_eq!(last[0], 0.0);
}

#[test]
fn damaged_frames_are_counted_and_tolerated() {
    for kind in [
        FaultKind::Flip { rate: 0.002 },
        FaultKind::Drop { probability: 0.3 },
    ] {
        let mut rig = wired(&bridge(8), &fault(kind, 100, 500));
        let (log, result) = run(&mut rig, 1000);
        result.unwrap();
        let [reports, lost, sent] = ["reports", "lost", "sent"]
            .map(|name| diagnostic(&rig, &log, &format!("phidget/{name}")));
        assert!(lost > 5.0, "{kind:?}");
        assert!(
            (0.0..=1.0).contains(&(sent - reports - lost)),
            "{kind:?}: {sent} {reports} {lost}"
        );
    }
}

#[test]
fn repeated_reports_are_discarded() {
    let mut rig = wired(
        &bridge(8),
        &fault(FaultKind::Duplicate { probability: 0.5 }, 100, 500),
    );
    let (log, result) = run(&mut rig, 1000);
    result.unwrap();
    assert!(diagnostic(&rig, &log, "phidget/stale") > 10.0);
    assert_eq!(diagnostic(&rig, &log, "phidget/lost"), 0.0);
}

#[test]
fn missing_or_wrong_board_is_an_error() {
    let unplugged = fault(FaultKind::Unplug { fails: false }, 0, 10_000);
    check_missing(wired(&bridge(8), &unplugged), "phidget");

    let wire = kit().wire(&FaultSchedule::default()).unwrap();
    let driver = bridge(8).driver().unwrap();
    let mut rig = rig_harness::rig(driver, wire, (2, |_| 0.0), force_plant(force));
    let message = run(&mut rig, 1000).1.unwrap_err().to_string();
    assert!(message.contains("a board of another type"), "{message}");
}

#[test]
fn missing_signal_is_reported_with_the_available_ones() {
    let mut board = bridge(8);
    board.inputs = vec![input(0, 3, 1.0)];
    let wire = board.wire(&FaultSchedule::default()).unwrap();
    let script = rig_harness::ScriptedProcess {
        ports: Vec::new(),
        command: |_| 0.0,
        steps: 0,
    };
    let task = twinrig_runtime::WiredTask::new(Box::new(board.driver().unwrap()), Box::new(wire));
    let schedule = twinrig_runtime::Schedule::with_period(SimDuration::from_millis(2));
    let plant = Box::new(force_plant(force));
    let rig = Rig::new(&schedule, Box::new(script), vec![Box::new(task)], plant);
    let message = rig.err().unwrap().to_string();
    assert!(message.contains("leg/LF/foot/force [N] × 3"), "{message}");
}

#[test]
fn restored_rig_continues_bit_for_bit() {
    let faults = fault(FaultKind::Flip { rate: 0.001 }, 0, 10_000);
    for board in [bridge(16), kit()] {
        check_restored(|| wired(&board, &faults), &[0, 9, 33, 140], 600);
    }
}

#[test]
fn invalid_configurations_are_rejected() {
    let error = |board: &Phidget| board.driver().unwrap_err().to_string();
    assert!(error(&bridge(9)).contains("multiple of 8"));
    assert!(error(&bridge(1008)).contains("up to 1 s"));
    assert!(
        error(&Phidget::new(
            "phidget",
            Board::InterfaceKit { trigger: 1001 }
        ))
        .contains("1001")
    );
    let mut twice = bridge(8);
    twice.inputs = vec![input(1, 0, 1.0), input(1, 1, 1.0)];
    assert!(error(&twice).contains("used twice"));
    twice.inputs = vec![input(4, 0, 1.0)];
    assert!(error(&twice).contains("input 4 of 4"));
}
