//! Stages in the driver, and the times of their samples.

use crate::support::{MovingAverage, clock, fault, millis, none, plant, quiet, signal, staged};
use twinrig_kernel::{SimDuration, SimTime, SnapshotError};
use twinrig_runtime::{Driver, Timing};
use twinrig_tactile::Tactile;
use twinrig_testing::rig_harness::{check_restored, diagnostic, rig, run};
use twinrig_wire::FaultKind;

#[test]
fn every_sample_passes_every_stage_and_their_outputs_follow_the_channels() {
    let mut rig = staged(&quiet(), &none());
    let (log, result) = run(&mut rig, 3_000);
    result.unwrap();
    let samples = diagnostic(&rig, &log, "tactile/samples");
    for name in ["first", "second"] {
        let received = format!("tactile/bench/force/{name}/received");
        assert_eq!(diagnostic(&rig, &log, &received), samples);
    }
    // A frame of 18 bytes, jitter of up to 50 µs, less 1 µs of the map's error.
    let latency = diagnostic(&rig, &log, "tactile/bench/force/first/latency");
    assert!((194e-6..247e-6).contains(&latency), "{latency}");
    for (at, values) in &log.inputs[500..] {
        let &[_, _, reference, first, time, second, _] = &values[..] else {
            panic!("{values:?}");
        };
        // The mean of a ramp of 10 N/s is that of 1.5 ms ago; rounded to counts of 75 µN.
        assert!(
            (first / 3.0 - (reference - 0.015)).abs() < 2e-4,
            "{values:?}"
        );
        assert_eq!(first, second);
        let age = at.as_secs_f64() - time;
        assert!((0.19e-3..1.3e-3).contains(&age), "{age}");
    }
}

#[test]
fn mapped_times_match_the_plants_time() {
    // The reference is a clock: 10 N/s. The plant was held while the driver opened; its time is
    // behind that of the rig by a constant.
    let mut config = quiet();
    config.jitter = Timing::Uniform {
        min: SimDuration::ZERO,
        max: SimDuration::from_micros(300),
    };
    let driver = config.driver().unwrap();
    let driver = driver.with_stage(MovingAverage::new("first"));
    let wire = config.wire(&none()).unwrap();
    let mut rig = rig(driver, wire, (2, |_| 1.0), plant(signal));
    let (log, result) = run(&mut rig, 5_000);
    result.unwrap();
    let held: Vec<f64> = log.inputs[1_000..]
        .iter()
        .map(|(_, values)| values[4] - values[2] / 10.0)
        .collect();
    let (least, most) = held
        .iter()
        .fold((f64::MAX, f64::MIN), |(l, m), &v| (l.min(v), m.max(v)));
    // 7.5 µs per count; 20 µs by the bound of the map's test.
    assert!(most - least < 30e-6, "{least} {most}");
    let error = diagnostic(&rig, &log, "tactile/clock_error_worst");
    assert!(error > 0.0 && error < 15e-6, "{error}");
    let rate = diagnostic(&rig, &log, "tactile/clock/rate");
    assert!((rate - 150e-6).abs() < 1e-6, "{rate}");
    // Host less board: −3.2 ms, and −150 ppm of 5 s.
    let offset = diagnostic(&rig, &log, "tactile/clock/offset");
    assert!(
        (offset + 3.210_987e-3 + 5.0 * 150e-6).abs() < 20e-6,
        "{offset}"
    );
}

#[test]
fn restored_rig_continues_bit_for_bit() {
    // At whole milliseconds a frame is being sent, or two of four conversions are done; on a slow
    // line samples wait as well.
    for (offset_ns, baud) in [
        (-5_150_000, 921_600),
        (-5_650_000, 921_600),
        (-5_150_000, 57_600),
    ] {
        let mut config = Tactile::new("tactile", "bench/force");
        (config.oversampling, config.zero, config.baud) = (4, true, baud);
        config.clock = clock(offset_ns, -80_000);
        config.resets = vec![SimTime::ZERO + millis(200)];
        let faults = fault(FaultKind::Flip { rate: 0.001 }, 0, 10_000);
        let rig = || staged(&config, &faults);
        check_restored(rig, &[0, 1, 33, 150, 199, 240, 1_130], 1_700);
    }
}

#[test]
fn state_of_a_driver_with_other_stages_is_rejected() {
    let driver = || quiet().driver().unwrap();
    let saved = driver().with_stage(MovingAverage::new("first")).save();
    let error = driver().restore(&saved).unwrap_err();
    assert!(matches!(error, SnapshotError::Mismatch { .. }), "{error}");
}

#[test]
fn running_bus_does_not_allocate() {
    let config = Tactile::new("tactile", "bench/force");
    let mut rig = staged(&config, &none());
    let at = |seconds| SimTime::ZERO + SimDuration::from_secs(seconds);
    // Buffers reach their final size, and the map its number of points.
    rig.run_until(at(10), &mut ()).unwrap();
    let run = || rig.run_until(at(14), &mut ()).unwrap();
    let allocations = allocation_counter::measure(run);
    assert_eq!(allocations.count_total, 0);
}
