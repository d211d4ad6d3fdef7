//! Driver and sensor connected by a wire, in a rig.

use std::f64::consts::TAU;

use crate::FramedDevice;
use crate::optoforce::{Cutoff, OptoForce, SampleChoice, Speed};
use crate::tests::{self, check_missing, force_plant};
use twinrig_kernel::{BoardClock, LocalDuration};
use twinrig_runtime::{Rig, RunEvent};
use twinrig_testing::rig_harness;
use twinrig_testing::rig_harness::{check_restored, check_zero, diagnostic, run};
use twinrig_wire::{FaultKind, FaultSchedule};

pub(super) fn sensor() -> OptoForce {
    let mut sensor = OptoForce::new("optoforce", "leg/LF/foot/force");
    sensor.speed = Speed::Hz1000;
    sensor.cutoff = Cutoff::None;
    sensor
}

/// 40 N/s along x, 1 kN along y, 2 kN along z.
fn force(seconds: f64, axis: usize) -> f64 {
    [40.0 * seconds, -1000.0, 2000.0][axis]
}

fn wired_to(sensor: &OptoForce, faults: &FaultSchedule, force: fn(f64, usize) -> f64) -> Rig {
    tests::wired(sensor, faults, (2, |_| 0.0), force_plant(force))
}

fn fault(kind: FaultKind, from_ms: u64, for_ms: u64) -> FaultSchedule {
    rig_harness::fault("wire/optoforce", kind, from_ms, for_ms)
}

#[test]
fn samples_arrive_at_the_rate_of_the_sensor_and_transfers_never_wait() {
    for (speed, sent) in [
        (Speed::Hz1000, 1000.0),
        (Speed::Hz333, 333.0),
        (Speed::Hz100, 100.0),
        (Speed::Hz10, 10.0),
    ] {
        let mut sensor = sensor();
        sensor.speed = speed;
        let mut rig = wired_to(&sensor, &FaultSchedule::default(), force);
        let (log, result) = run(&mut rig, 1000);
        result.unwrap();
        let health = rig.bus_health().remove(0).1;
        assert!(health.is_clean() && health.silence.is_some(), "{health:?}");
        let samples = diagnostic(&rig, &log, "optoforce/samples");
        assert!(
            (sent - 1.0..=sent + 2.0).contains(&samples),
            "{speed:?}: {samples}"
        );
        assert_eq!(
            log.count(|event| matches!(event, RunEvent::TaskSkipped { .. })),
            0
        );
        check_zero(
            &rig,
            &log,
            "optoforce",
            &["lost", "stale", "unwell", "foreign", "garbage", "unheard"],
        );
    }
}

#[test]
fn forces_are_quantised_and_overloads_marked() {
    let mut rig = wired_to(&sensor(), &FaultSchedule::default(), force);
    let (log, result) = run(&mut rig, 500);
    result.unwrap();
    let (at, last) = log.inputs.last().unwrap();
    let count = 1600.0 / 6000.0;
    // The plant was paused during opening; the sample is of this or the previous millisecond.
    assert!(
        (40.0 * at.as_secs_f64() - last[0]).abs() < count + 40.0 * 0.006,
        "{at} {last:?}"
    );
    assert_eq!((last[0] / count).round(), last[0] / count);
    assert!((last[1] + 1000.0).abs() < count);
    assert!(
        (last[2] - 1600.0).abs() < 1e-9,
        "saturated at full scale: {last:?}"
    );
    assert!(diagnostic(&rig, &log, "optoforce/overloaded") > 490.0);
}

#[test]
fn filter_attenuates_by_3_db_at_its_cut_off() {
    // At its cut-off frequency the gain of a first-order filter is 1/√2.
    fn tone(seconds: f64, _: usize) -> f64 {
        500.0 * libm::sin(TAU * 15.0 * seconds)
    }
    let mut sensor = sensor();
    sensor.cutoff = Cutoff::Hz15;
    let mut rig = wired_to(&sensor, &FaultSchedule::default(), tone);
    let (log, result) = run(&mut rig, 2000);
    result.unwrap();
    let late = log.inputs.iter().skip(500);
    let most = late.map(|(_, forces)| forces[0].abs()).fold(0.0, f64::max);
    assert!((most / 500.0 - 0.5_f64.sqrt()).abs() < 0.02, "{most}");
}

#[test]
fn zeroed_sensor_subtracts_its_offset() {
    let mut sensor = sensor();
    sensor.zero = true;
    let mut rig = wired_to(&sensor, &FaultSchedule::default(), |seconds, _| {
        100.0 + 10.0 * seconds
    });
    let (log, result) = run(&mut rig, 1000);
    result.unwrap();
    let (_, last) = log.inputs.last().unwrap();
    assert!((last[0] - 10.0).abs() < 0.4, "{last:?}");
}

#[test]
fn fresh_sample_is_awaited() {
    let mut sensor = sensor();
    sensor.take = SampleChoice::Fresh;
    sensor.speed = Speed::Hz333;
    let mut rig = wired_to(&sensor, &FaultSchedule::default(), force);
    let (log, result) = run(&mut rig, 600);
    result.unwrap();
    // Steps every 2 ms, samples every 3 ms: the task is busy at some steps.
    assert!(log.count(|event| matches!(event, RunEvent::TaskSkipped { .. })) > 50);
    assert_eq!(diagnostic(&rig, &log, "optoforce/stale"), 0.0);
}

#[test]
fn dropped_samples_are_counted_as_lost() {
    for kind in [
        FaultKind::Drop { probability: 0.3 },
        FaultKind::Flip { rate: 0.002 },
    ] {
        let mut rig = wired_to(&sensor(), &fault(kind, 100, 500), force);
        let (log, result) = run(&mut rig, 1000);
        result.unwrap();
        let [samples, lost, sent] = ["samples", "lost", "sent"]
            .map(|name| diagnostic(&rig, &log, &format!("optoforce/{name}")));
        assert!(lost > 50.0, "{kind:?}");
        // One sample may be in transit, and some were sent before the driver opened.
        assert!(
            (0.0..=2.0).contains(&(sent - samples - lost)),
            "{kind:?}: {sent} {samples} {lost}"
        );
    }
}

#[test]
fn repeated_and_late_samples_are_discarded() {
    for kind in [
        FaultKind::Duplicate { probability: 0.3 },
        FaultKind::Reorder { probability: 0.3 },
    ] {
        let mut rig = wired_to(&sensor(), &fault(kind, 100, 500), force);
        let (log, result) = run(&mut rig, 1000);
        result.unwrap();
        assert!(diagnostic(&rig, &log, "optoforce/stale") > 20.0, "{kind:?}");
        let forces = log.inputs.iter().map(|(_, forces)| forces[0]);
        assert!(
            forces.is_sorted_by(|a, b| a <= b),
            "the force is monotonic: {kind:?}"
        );
    }
}

#[test]
fn opening_is_repeated_until_the_wire_recovers() {
    let mut rig = wired_to(
        &sensor(),
        &fault(FaultKind::Unplug { fails: false }, 0, 300),
        force,
    );
    let (log, result) = run(&mut rig, 1000);
    result.unwrap();
    let opened = log
        .events
        .iter()
        .find(|(_, event)| matches!(event, RunEvent::Opened));
    let (at, _) = opened.unwrap();
    assert!((400..403).contains(&(at.as_nanos() / 1_000_000)), "{at}");

    let unplugged = fault(FaultKind::Unplug { fails: false }, 0, 10_000);
    check_missing(wired_to(&sensor(), &unplugged, force), "optoforce");
}

#[test]
fn fast_clock_sends_more_samples() {
    let mut sensor = sensor();
    sensor.clock = BoardClock::new(LocalDuration::ZERO, 10_000_000).unwrap();
    let mut rig = wired_to(&sensor, &FaultSchedule::default(), force);
    let (log, result) = run(&mut rig, 1000);
    result.unwrap();
    let sent = diagnostic(&rig, &log, "optoforce/sent");
    assert!((1009.0..=1012.0).contains(&sent), "{sent}");
}

#[test]
fn restored_rig_continues_bit_for_bit() {
    let faults = fault(FaultKind::Flip { rate: 0.001 }, 0, 10_000);
    check_restored(
        || wired_to(&sensor(), &faults, force),
        &[0, 1, 33, 140],
        400,
    );
}

#[test]
fn invalid_configurations_are_rejected() {
    let mut stopped = sensor();
    stopped.speed = Speed::Stop;
    assert!(
        stopped
            .driver()
            .unwrap_err()
            .to_string()
            .contains("sends no samples")
    );
    let mut invalid = sensor();
    invalid.sensitivity = 0.0;
    assert!(
        invalid
            .driver()
            .unwrap_err()
            .to_string()
            .contains("0 counts per newton")
    );
}
