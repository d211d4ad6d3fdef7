//! Driver and board connected by a wire, in a rig.

use std::f64::consts::TAU;

use crate::support::{fault, millis, none, quiet, wired, wired_to};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{Driver, RunEvent, Timing};
use twinrig_tactile::{CHANNELS, SampleChoice, Tactile, TactileError};
use twinrig_testing::rig_harness::{check_zero, diagnostic, run};
use twinrig_wire::FaultKind;

#[test]
fn samples_arrive_at_the_rate_of_the_board_and_transfers_never_wait() {
    for (period_ms, oversampling) in [(1, 1), (1, 4), (5, 2), (65, 1)] {
        let mut config = quiet();
        (config.period, config.oversampling) = (millis(period_ms), oversampling);
        let mut rig = wired(&config, &none());
        let (log, result) = run(&mut rig, 1300);
        result.unwrap();
        let health = rig.bus_health().remove(0).1;
        assert!(health.is_clean() && health.silence.is_some(), "{health:?}");
        let (samples, expected) = (
            diagnostic(&rig, &log, "tactile/samples"),
            1300.0 / period_ms as f64,
        );
        assert!(
            (samples - expected).abs() < 3.0,
            "{period_ms} ms: {samples}"
        );
        assert_eq!(
            log.count(|event| matches!(event, RunEvent::TaskSkipped { .. })),
            0
        );
        let zero = [
            "lost",
            "stale",
            "restarts",
            "started_again",
            "overruns",
            "foreign",
        ];
        check_zero(&rig, &log, "tactile", &zero);
        check_zero(&rig, &log, "tactile", &["garbage", "unheard", "overflows"]);
    }
}

#[test]
fn readings_are_quantised_and_saturation_marked() {
    let mut rig = wired(&quiet(), &none());
    let (log, result) = run(&mut rig, 5_100);
    result.unwrap();
    let (at, last) = &log.inputs[2_000];
    let seconds = at.as_secs_f64();
    let (volt, newton) = (10.0 / 32_768.0, 25e-3 / 2e-3 * 50.0 / 8_388_608.0);
    // The plant was paused during opening, 2 ms; the sample is at most 2 ms old.
    assert!(
        (2.0 * seconds - last[0]).abs() < volt + 2.0 * 0.005,
        "{at} {last:?}"
    );
    assert!(
        (10.0 * seconds - last[2]).abs() < newton + 10.0 * 0.005,
        "{at} {last:?}"
    );
    assert_eq!((last[0] / volt).round(), last[0] / volt);
    assert!((last[2] / newton - (last[2] / newton).round()).abs() < 1e-6);
    assert_eq!(last[1], -10.0);
    let saturated =
        CHANNELS.map(|channel| diagnostic(&rig, &log, &format!("tactile/saturated/{channel}")));
    // Both 10 V and the 50 N of the cell are reached at 5 s of the plant.
    assert!((90.0..102.0).contains(&saturated[0]), "{saturated:?}");
    assert!(saturated[1] > 5_090.0, "{saturated:?}");
    assert!((90.0..102.0).contains(&saturated[2]), "{saturated:?}");
}

#[test]
fn noise_has_its_deviation_and_is_averaged_by_oversampling() {
    for (oversampling, part) in [(1, 1.0), (4, 0.5)] {
        let mut config = quiet();
        (config.noise, config.oversampling) = ([0.02, 0.0, 0.1], oversampling);
        config.take = SampleChoice::Fresh;
        let mut rig = wired_to(&config, &none(), |_, channel| [1.0, 2.0, 3.0][channel]);
        let (log, result) = run(&mut rig, 8_000);
        result.unwrap();
        let deviation = |channel: usize| {
            let values: Vec<f64> = log
                .inputs
                .iter()
                .skip(10)
                .map(|(_, v)| v[channel])
                .collect();
            let count = values.len() as f64;
            let mean = values.iter().sum::<f64>() / count;
            let squares = values.iter().map(|value| (value - mean) * (value - mean));
            (squares.sum::<f64>() / count).sqrt()
        };
        // Of 4000 values the deviation deviates by 1.1 %; five times that.
        for (channel, expected) in [(0, 0.02), (2, 0.1)] {
            let found = deviation(channel) / (expected * part);
            assert!((found - 1.0).abs() < 0.056, "{channel}: {found}");
        }
        assert_eq!(deviation(1), 0.0);
        // The driver knows the time from the middle of the conversions to the end of the frame.
        let error = diagnostic(&rig, &log, "tactile/clock_error_worst");
        assert!(error > 0.0 && error < 3e-6, "{oversampling}: {error}");
    }
}

#[test]
fn oversampling_attenuates_a_tone_above_the_band() {
    // 900 Hz: the mean of four at 4 kHz leaves sin(0.9π)/(4 sin(0.225π)), that of one everything.
    fn tone(seconds: f64, _: usize) -> f64 {
        5.0 * libm::sin(TAU * 900.0 * seconds)
    }
    for (oversampling, expected) in [(1, 1.0), (2, 0.156), (4, 0.119)] {
        let mut config = quiet();
        config.oversampling = oversampling;
        let mut rig = wired_to(&config, &none(), tone);
        let (log, result) = run(&mut rig, 1_000);
        result.unwrap();
        let values = log
            .inputs
            .iter()
            .skip(10)
            .map(|(_, values)| values[0].abs());
        let most = values.fold(0.0, f64::max) / 5.0;
        assert!((most - expected).abs() < 0.01, "{oversampling}: {most}");
    }
}

#[test]
fn zeroed_reference_subtracts_its_offset() {
    let mut config = quiet();
    config.zero = true;
    let mut rig = wired_to(&config, &none(), |seconds, _| 3.0 + 2.0 * seconds);
    let (log, result) = run(&mut rig, 1000);
    result.unwrap();
    let (_, last) = log.inputs.last().unwrap();
    assert!((last[2] - 2.0).abs() < 0.02, "{last:?}");
    assert!(
        (last[0] - 5.0).abs() < 0.02,
        "the voltages are not zeroed: {last:?}"
    );
}

#[test]
fn dropped_samples_are_counted_as_lost() {
    for kind in [
        FaultKind::Drop { probability: 0.1 },
        FaultKind::Flip { rate: 0.0005 },
    ] {
        let mut rig = wired(&quiet(), &fault(kind, 100, 1_500));
        let (log, result) = run(&mut rig, 3_500);
        result.unwrap();
        let [samples, lost, sent, error] = ["samples", "lost", "sent", "clock_error_worst"]
            .map(|name| diagnostic(&rig, &log, &format!("tactile/{name}")));
        assert!(lost > 80.0, "{kind:?}: {lost}");
        // One sample may be in transit, and some were sent before the acknowledgement.
        assert!(
            (0.0..=2.0).contains(&(sent - samples - lost)),
            "{kind:?}: {sent} {samples} {lost}"
        );
        assert!(error > 0.0 && error < 3e-6, "{kind:?}: {error}");
    }
}

#[test]
fn repeated_and_late_samples_are_discarded() {
    for kind in [
        FaultKind::Duplicate { probability: 0.3 },
        FaultKind::Reorder { probability: 0.3 },
    ] {
        let mut rig = wired(&quiet(), &fault(kind, 100, 500));
        let (log, result) = run(&mut rig, 1000);
        result.unwrap();
        assert!(diagnostic(&rig, &log, "tactile/stale") > 20.0, "{kind:?}");
        assert_eq!(diagnostic(&rig, &log, "tactile/restarts"), 0.0);
        let ramp = log.inputs.iter().map(|(_, values)| values[0]);
        assert!(
            ramp.is_sorted_by(|a, b| a <= b),
            "the ramp is monotonic: {kind:?}"
        );
    }
}

#[test]
fn reset_board_is_noticed_mapped_anew_and_started_again() {
    let mut config = quiet();
    let resets = [6_500, 3_000];
    config.resets = resets.map(|at| SimTime::ZERO + millis(at)).to_vec();
    let mut rig = wired(&config, &none());
    let (log, result) = run(&mut rig, 10_000);
    result.unwrap();
    assert_eq!(diagnostic(&rig, &log, "tactile/restarts"), 2.0);
    // Of every 20 ms of the 100 ms until it accepts commands.
    let started = diagnostic(&rig, &log, "tactile/started_again");
    assert!((10.0..=12.0).contains(&started), "{started}");
    // Its clock began at 0: 6.5 s behind that of the host.
    let offset = diagnostic(&rig, &log, "tactile/clock/offset");
    assert!((offset - 6.5).abs() < 1e-3, "{offset}");
    let [error, worst] = ["clock_error", "clock_error_worst"]
        .map(|name| diagnostic(&rig, &log, &format!("tactile/{name}")));
    assert!(error.abs() < 3e-6 && worst < 3e-6, "{error} {worst}");
    let samples = diagnostic(&rig, &log, "tactile/samples");
    assert!((9_730.0..9_800.0).contains(&samples), "{samples}");
    assert_eq!(diagnostic(&rig, &log, "tactile/lost"), 0.0);
}

#[test]
fn unplugged_board_continues_afterwards() {
    let mut rig = wired(
        &quiet(),
        &fault(FaultKind::Unplug { fails: false }, 1_000, 2_000),
    );
    let (log, result) = run(&mut rig, 4_000);
    result.unwrap();
    assert_eq!(diagnostic(&rig, &log, "tactile/restarts"), 0.0);
    let lost = diagnostic(&rig, &log, "tactile/lost");
    assert!((1_995.0..2_005.0).contains(&lost), "{lost}");
}

#[test]
fn slow_line_overflows_the_boards_memory_and_says_so() {
    let mut config = quiet();
    // 18 bytes take 3.1 ms at 57 600 baud: two of three samples are dropped.
    config.baud = 57_600;
    let mut rig = wired(&config, &none());
    let (log, result) = run(&mut rig, 2_000);
    result.unwrap();
    let [samples, lost, sent, overflows, overruns] =
        ["samples", "lost", "sent", "overflows", "overruns"]
            .map(|name| diagnostic(&rig, &log, &format!("tactile/{name}")));
    assert!((630.0..650.0).contains(&samples), "{samples}");
    assert!(
        overflows > 1_200.0 && overruns > 500.0,
        "{overflows} {overruns}"
    );
    // 64 samples wait.
    assert!((sent - samples - 64.0).abs() <= 2.0, "{sent} {samples}");
    assert!((overflows - lost).abs() < 200.0, "{overflows} {lost}");
}

#[test]
fn opening_is_repeated_until_the_wire_recovers() {
    let unplug = FaultKind::Unplug { fails: false };
    let mut rig = wired(&quiet(), &fault(unplug, 0, 300));
    let (log, result) = run(&mut rig, 1000);
    result.unwrap();
    let opened = |event: &&(SimTime, RunEvent)| matches!(event.1, RunEvent::Opened);
    let (at, _) = log.events.iter().find(opened).unwrap();
    assert!((400..403).contains(&(at.as_nanos() / 1_000_000)), "{at}");

    let mut rig = wired(&quiet(), &fault(unplug, 0, 10_000));
    let message = run(&mut rig, 1000).1.unwrap_err().to_string();
    assert!(
        message.contains("tactile") && message.contains("check the connection"),
        "{message}"
    );
}

#[test]
fn invalid_configurations_are_rejected() {
    let error = |change: fn(&mut Tactile)| {
        let mut config = quiet();
        change(&mut config);
        let error = config.driver().err().unwrap();
        let board = config.board().err().unwrap();
        assert_eq!(board.to_string(), error.to_string());
        error
    };
    let period = |period| TactileError::Period { period };
    let (zero, odd, long) = (
        SimDuration::ZERO,
        SimDuration::from_micros(1_500),
        millis(66),
    );
    assert_eq!(error(|c| c.period = SimDuration::ZERO), period(zero));
    assert_eq!(
        error(|c| c.period = SimDuration::from_micros(1_500)),
        period(odd)
    );
    assert_eq!(error(|c| c.period = millis(66)), period(long));
    assert!(
        error(|c| c.oversampling = 3)
            .to_string()
            .contains("3 conversions")
    );
    assert_eq!(error(|c| c.baud = 300), TactileError::Baud { baud: 300 });
    let noise = error(|c| c.noise[1] = -0.5).to_string();
    assert!(
        noise.contains("-0.5 of the noise of piezoelectric"),
        "{noise}"
    );
    assert!(matches!(
        error(|c| c.noise[0] = f64::NAN),
        TactileError::Noise { .. }
    ));
    let cell = error(|c| c.reference.sensitivity = 0.0).to_string();
    assert!(
        cell.contains("the sensitivity of the reference cell, 0"),
        "{cell}"
    );
    let jitter = error(|c| c.jitter = Timing::Trace(Vec::new())).to_string();
    assert!(jitter.contains("trace is empty"), "{jitter}");
    let input = error(|c| c.inputs[0].channel = 3).to_string();
    assert!(input.contains("input 3 of 3"), "{input}");
    assert_eq!(quiet().driver().unwrap().name(), "tactile");
}
