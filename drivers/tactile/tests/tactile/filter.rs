//! The filter of the load as a stage of the driver.

use std::f64::consts::TAU;

use crate::support::{STATE, filter, filter_of};
use proptest::prelude::*;
use twinrig_estimate::{Decay, EstimateError, Model};
use twinrig_kernel::SimDuration;
use twinrig_runtime::Driver;
use twinrig_tactile::protocol::{Command, Message, Status};
use twinrig_tactile::{LoadFilter, LoadFilterConfig, Tactile, TactileDriver};
use twinrig_testing::driver_harness::DriverHarness;
use twinrig_wire::FramedMessage;

fn f2() -> LoadFilterConfig {
    let decay = |value| Decay {
        value,
        scale_hz: 1.7,
    };
    filter_of(Model::F2 {
        rate: decay(0.05),
        acceleration: decay(-0.005),
        states: [STATE; 5],
    })
}

/// An opened driver with a filter.
fn host(config: LoadFilterConfig) -> DriverHarness<TactileDriver> {
    let tactile = Tactile::new("tactile", "bench/force");
    let filter = LoadFilter::new(config).unwrap();
    let driver = tactile.driver().unwrap().with_stage(Box::new(filter));
    let mut host = DriverHarness::new(driver);
    host.open();
    let done = Message::Acknowledgement {
        command: Command::Start,
        done: true,
    };
    host.receive(SimDuration::from_micros(100), &done.to_frame());
    host
}

/// Frames of a load of 2 Hz, one per millisecond; those at `boots` are the first after a restart.
fn frames(count: u32, boots: &[u32]) -> Vec<Vec<u8>> {
    let mut boot = 0;
    let mut stamp = 5_000_000;
    let frame = |n: u32| {
        if boots.contains(&n) {
            (boot, stamp) = (boot + 1, 0);
        }
        stamp += 1_000;
        let force = 10.0 * (1.0 - libm::cos(TAU * 2.0 * 1e-3 * f64::from(n)));
        let volts = |volts: f64| {
            #[expect(clippy::cast_possible_truncation, reason = "a few volts")]
            let counts = (volts * 3276.8) as i16;
            counts
        };
        #[expect(clippy::cast_possible_truncation, reason = "24 bits")]
        let bridge = (force / 50.0 * 2.0 / 25.0 * f64::from(1 << 23)) as i32;
        Message::Data {
            boot,
            sequence: u16::try_from(n % 65_536).unwrap(),
            stamp,
            volts: [volts(1.0 + 0.2 * force), volts(0.5)],
            bridge,
            status: Status::default(),
        }
        .to_frame()
    };
    (0..count).map(frame).collect()
}

/// Outputs of the filter after each of the frames, which arrive with these delays \[µs\].
fn estimates(config: LoadFilterConfig, frames: &[Vec<u8>], delays_us: &[u64]) -> Vec<Vec<u64>> {
    let mut host = host(config);
    let mut late = 0;
    let estimate = |(n, frame): (usize, &Vec<u8>)| {
        let delay = delays_us[n % delays_us.len()];
        // The time between two arrivals: a period, and the difference of their delays.
        host.receive(SimDuration::from_micros(1_000 + delay - late), frame);
        late = delay;
        let outputs = host.driver.to_process();
        outputs.iter().map(|value| value.to_bits()).collect()
    };
    frames.iter().enumerate().map(estimate).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]
    /// A twin in lockstep, a twin behind a PTY and a board deliver the same frames at different
    /// times.
    #[test]
    fn estimates_are_a_function_of_the_frames(
        delays_us in proptest::collection::vec(0_u64..900, 1..50),
    ) {
        let frames = frames(600, &[]);
        let prompt = estimates(filter(), &frames, &[0]);
        prop_assert_eq!(&prompt, &estimates(filter(), &frames, &delays_us));
    }
}

#[test]
fn estimate_follows_the_load_over_a_restart_of_the_board() {
    let frames = frames(1_500, &[700]);
    let mut config = filter();
    config.settings.piezoelectric = None;
    let estimates = estimates(config, &frames, &[120, 310, 40]);
    for (n, outputs) in estimates.iter().enumerate().skip(100) {
        let values: Vec<f64> = outputs.iter().map(|bits| f64::from_bits(*bits)).collect();
        let [
            _,
            _,
            reference,
            force,
            deviation,
            _,
            nis,
            of_reference,
            nees,
        ] = values[..]
        else {
            panic!("three channels and six outputs of the filter: {values:?}");
        };
        assert_eq!(reference, of_reference);
        assert!(deviation > 0.0 && nis >= 0.0 && nees >= 0.0);
        // Quantisation, and the lag of the filter behind 126 N/s.
        assert!(
            (force - reference).abs() < 0.1,
            "{force} for {reference} N at {n} ms"
        );
    }
}

#[test]
fn saturated_voltages_are_not_used() {
    let mut host = host(filter());
    let frames = frames(50, &[]);
    for frame in &frames[..25] {
        host.receive(SimDuration::from_millis(1), frame);
    }
    for frame in &frames[25..] {
        let Ok(Message::Data {
            boot,
            sequence,
            stamp,
            bridge,
            ..
        }) = Message::decode(frame)
        else {
            panic!("a sample");
        };
        let saturated = Message::Data {
            boot,
            sequence,
            stamp,
            volts: [i16::MAX, i16::MIN],
            bridge,
            status: Status {
                saturated: [true, true, false],
                ..Status::default()
            },
        };
        host.receive(SimDuration::from_millis(1), &saturated.to_frame());
    }
    assert_eq!(host.diagnostic("estimate/unused"), 50.0);
    // 25 ms without a measurement: the estimate is that of the process.
    assert!(host.driver.to_process()[3] < 5.0);
}

#[test]
fn model_f2_requires_the_signal_of_a_frequency() {
    let error = LoadFilter::new(f2()).unwrap_err();
    assert_eq!(error, EstimateError::NoFrequency);
    let with_signal = LoadFilterConfig {
        frequency: Some("motor/cam/frequency".to_owned()),
        ..f2()
    };
    let filter = LoadFilter::new(with_signal).unwrap();
    let tactile = Tactile::new("tactile", "bench/force");
    let driver = tactile.driver().unwrap().with_stage(Box::new(filter));
    let reads = |name: &str| driver.ports().iter().any(|port| port.name == name);
    assert!(reads("motor/cam/frequency"));
}

#[test]
fn restored_filter_continues_bit_for_bit() {
    let frames = frames(400, &[150]);
    let mut first = host(filter());
    for frame in &frames[..200] {
        first.receive(SimDuration::from_millis(1), frame);
    }
    let saved = first.driver.save();
    let mut second = host(filter());
    second.receive(SimDuration::from_millis(200), &[]);
    second.driver.restore(&saved).unwrap();
    for frame in &frames[200..] {
        first.receive(SimDuration::from_millis(1), frame);
        second.receive(SimDuration::from_millis(1), frame);
        assert_eq!(first.driver.to_process(), second.driver.to_process());
    }
}
