//! Driver and sensor with a wire between them, in a rig.

#[path = "../../toys.rs"]
mod toys;

use std::f64::consts::TAU;

use toys::{PlantAccess, diagnostic, rig, run};
use twinrig_kernel::{BoardClock, LocalDuration, Port, SimDuration, SimTime, Unit};
use twinrig_optoforce::{Cutoff, OptoForce, Speed, Take};
use twinrig_runtime::{Rig, RunEvent};
use twinrig_wire::{Fault, FaultKind, FaultSchedule};

fn sensor() -> OptoForce {
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
    let plant = PlantAccess::new(
        vec![Port::output("leg/LF/foot/force", Unit::Newton, 3)],
        force,
    );
    let wire = sensor.wire(faults).unwrap();
    rig(sensor.driver().unwrap(), wire, (2, |_| 0.0), plant)
}

fn fault(kind: FaultKind, from_ms: u64, for_ms: u64) -> FaultSchedule {
    FaultSchedule {
        faults: vec![Fault {
            at: SimTime::ZERO + SimDuration::from_millis(from_ms),
            on: "wire/optoforce".into(),
            kind,
            lasts: SimDuration::from_millis(for_ms),
        }],
        seed: 1,
    }
}

#[test]
fn samples_come_at_the_pace_of_the_sensor_and_transfers_never_wait() {
    for (speed, sent) in [
        (Speed::Hz1000, 1000.0),
        (Speed::Hz333, 333.0),
        (Speed::Hz100, 100.0),
        (Speed::Hz10, 10.0),
    ] {
        let mut sensor = sensor();
        sensor.speed = speed;
        let mut rig = wired_to(&sensor, &FaultSchedule::default(), force);
        let (log, ended) = run(&mut rig, 1000);
        ended.unwrap();
        let samples = diagnostic(&rig, &log, "optoforce/samples");
        assert!(
            (sent - 1.0..=sent + 2.0).contains(&samples),
            "{speed:?}: {samples}"
        );
        assert_eq!(
            log.count(|event| matches!(event, RunEvent::TaskSkipped { .. })),
            0
        );
        for nothing in ["lost", "stale", "unwell", "foreign", "garbage", "unheard"] {
            assert_eq!(
                diagnostic(&rig, &log, &format!("optoforce/{nothing}")),
                0.0,
                "{nothing}"
            );
        }
    }
}

#[test]
fn forces_are_counted_and_overloads_marked() {
    let mut rig = wired_to(&sensor(), &FaultSchedule::default(), force);
    let (log, ended) = run(&mut rig, 500);
    ended.unwrap();
    let (at, last) = log.inputs.last().unwrap();
    let count = 1600.0 / 6000.0;
    // The plant was held while the sensor was set up; the sample is that of this very millisecond, or the one before.
    assert!(
        (40.0 * at.as_secs_f64() - last[0]).abs() < count + 40.0 * 0.006,
        "{at} {last:?}"
    );
    assert_eq!((last[0] / count).round(), last[0] / count);
    assert!((last[1] + 1000.0).abs() < count);
    assert!(
        (last[2] - 1600.0).abs() < 1e-9,
        "no more than the sensor can count: {last:?}"
    );
    assert!(diagnostic(&rig, &log, "optoforce/overloaded") > 490.0);
}

#[test]
fn the_filter_has_its_cut_off() {
    // At its cut-off a first-order filter lets 1/√2 through.
    fn tone(seconds: f64, _: usize) -> f64 {
        500.0 * libm::sin(TAU * 15.0 * seconds)
    }
    let mut sensor = sensor();
    sensor.cutoff = Cutoff::Hz15;
    let mut rig = wired_to(&sensor, &FaultSchedule::default(), tone);
    let (log, ended) = run(&mut rig, 2000);
    ended.unwrap();
    let late = log.inputs.iter().skip(500);
    let most = late.map(|(_, forces)| forces[0].abs()).fold(0.0, f64::max);
    assert!((most / 500.0 - 0.5_f64.sqrt()).abs() < 0.02, "{most}");
}

#[test]
fn a_sensor_that_is_zeroed_measures_from_there() {
    let mut sensor = sensor();
    sensor.zero = true;
    let mut rig = wired_to(&sensor, &FaultSchedule::default(), |seconds, _| {
        100.0 + 10.0 * seconds
    });
    let (log, ended) = run(&mut rig, 1000);
    ended.unwrap();
    let (_, last) = log.inputs.last().unwrap();
    assert!((last[0] - 10.0).abs() < 0.4, "{last:?}");
}

#[test]
fn a_fresh_sample_is_waited_for() {
    let mut sensor = sensor();
    sensor.take = Take::Fresh;
    sensor.speed = Speed::Hz333;
    let mut rig = wired_to(&sensor, &FaultSchedule::default(), force);
    let (log, ended) = run(&mut rig, 600);
    ended.unwrap();
    // Steps every 2 ms, samples every 3: the task is busy at some steps.
    assert!(log.count(|event| matches!(event, RunEvent::TaskSkipped { .. })) > 50);
    assert_eq!(diagnostic(&rig, &log, "optoforce/stale"), 0.0);
}

#[test]
fn what_is_dropped_is_lost_by_the_count_of_the_sensor() {
    for kind in [
        FaultKind::Drop { probability: 0.3 },
        FaultKind::Flip { rate: 0.002 },
    ] {
        let mut rig = wired_to(&sensor(), &fault(kind.clone(), 100, 500), force);
        let (log, ended) = run(&mut rig, 1000);
        ended.unwrap();
        let [samples, lost, sent] = ["samples", "lost", "sent"]
            .map(|name| diagnostic(&rig, &log, &format!("optoforce/{name}")));
        assert!(lost > 50.0, "{kind:?}");
        // One may be under way, and some were sent before the driver opened.
        assert!(
            (0.0..=2.0).contains(&(sent - samples - lost)),
            "{kind:?}: {sent} {samples} {lost}"
        );
    }
}

#[test]
fn repeated_and_late_samples_are_not_taken() {
    for kind in [
        FaultKind::Duplicate { probability: 0.3 },
        FaultKind::Reorder { probability: 0.3 },
    ] {
        let mut rig = wired_to(&sensor(), &fault(kind.clone(), 100, 500), force);
        let (log, ended) = run(&mut rig, 1000);
        ended.unwrap();
        assert!(diagnostic(&rig, &log, "optoforce/stale") > 20.0, "{kind:?}");
        let forces = log.inputs.iter().map(|(_, forces)| forces[0]);
        assert!(
            forces.is_sorted_by(|a, b| a <= b),
            "the force only grows: {kind:?}"
        );
    }
}

#[test]
fn a_bad_wire_at_the_beginning_is_asked_again() {
    let mut rig = wired_to(
        &sensor(),
        &fault(FaultKind::Unplug { fails: false }, 0, 300),
        force,
    );
    let (log, ended) = run(&mut rig, 1000);
    ended.unwrap();
    let opened = log
        .events
        .iter()
        .find(|(_, event)| matches!(event, RunEvent::Opened));
    let (at, _) = opened.unwrap();
    assert!((400..403).contains(&(at.as_nanos() / 1_000_000)), "{at}");

    let mut rig = wired_to(
        &sensor(),
        &fault(FaultKind::Unplug { fails: false }, 0, 10_000),
        force,
    );
    let why = run(&mut rig, 1000).1.unwrap_err().to_string();
    assert!(
        why.contains("optoforce") && why.contains("is it there"),
        "{why}"
    );
}

#[test]
fn a_fast_clock_sends_more() {
    let mut sensor = sensor();
    sensor.clock = BoardClock::new(LocalDuration::ZERO, 10_000_000).unwrap();
    let mut rig = wired_to(&sensor, &FaultSchedule::default(), force);
    let (log, ended) = run(&mut rig, 1000);
    ended.unwrap();
    let sent = diagnostic(&rig, &log, "optoforce/sent");
    assert!((1009.0..=1012.0).contains(&sent), "{sent}");
}

#[test]
fn a_restored_rig_goes_on_bit_for_bit() {
    let faults = fault(FaultKind::Flip { rate: 0.001 }, 0, 10_000);
    for saved_at in [0, 1, 33, 140] {
        let mut rig = wired_to(&sensor(), &faults, force);
        run(&mut rig, saved_at).1.unwrap();
        let saved = rig.save();
        let rest = run(&mut rig, 400);
        let mut again = wired_to(&sensor(), &faults, force);
        again.restore(&saved).unwrap();
        assert_eq!(run(&mut again, 400), rest, "{saved_at} ms");
    }
}

#[test]
fn sensors_that_cannot_be_are_refused() {
    let mut stopped = sensor();
    stopped.speed = Speed::Stop;
    assert!(
        stopped
            .driver()
            .unwrap_err()
            .to_string()
            .contains("sends nothing")
    );
    let mut blind = sensor();
    blind.sensitivity = 0.0;
    assert!(
        blind
            .driver()
            .unwrap_err()
            .to_string()
            .contains("0 counts a newton")
    );
}
