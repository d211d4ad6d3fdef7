//! Property-based tests of the timing of the driver, on the harnesses of `twinrig::testing`.

use proptest::collection::vec;
use proptest::prelude::*;
use twinrig::bus::{
    AnalogSource, FaultKind, FaultSchedule, FramedDriver, FramedMessage, FramedNode, UsbTiming,
    Wire, device_wire, usb_device_wire,
};
use twinrig::kernel::{Port, SimDuration, SimTime, Unit};
use twinrig::runtime::{Driver, Rig, Timing};
use twinrig::testing::driver_harness::DriverHarness;
use twinrig::testing::rig_harness::{self, RecordingPlant, diagnostic};

use crate::bus::{BYTE_TIME, HEIGHT, NAME};
use crate::device::EmulatedRangeFinder;
use crate::driver::{ANSWER_TIMEOUT, RangeFinder};
use crate::protocol::{Answer, MILLIMETRES_MAX};

type Host = DriverHarness<FramedDriver<RangeFinder>>;

fn driver() -> FramedDriver<RangeFinder> {
    FramedDriver::new(RangeFinder::new(NAME))
}

/// Returns a driver whose device has answered once.
fn open_host() -> Host {
    let mut host = DriverHarness::new(driver());
    assert_eq!(host.open(), b"R");
    host.receive(SimDuration::from_millis(5), &Answer(100).to_frame());
    assert!(host.is_done());
    host
}

fn micros(range: std::ops::Range<u64>) -> impl Strategy<Value = SimDuration> {
    range.prop_map(SimDuration::from_micros)
}

/// Number of pauses that are over before the time-out.
const PAUSES: usize = 10;

fn pause() -> impl Strategy<Value = SimDuration> {
    micros(0..ANSWER_TIMEOUT.as_nanos() / 1_000 / PAUSES as u64)
}

proptest! {
    /// A serial port passes bytes on in pieces of any length, at any times before the time-out.
    #[test]
    fn answer_in_any_pieces_completes_the_transfer(
        millimetres in 0..=MILLIMETRES_MAX,
        pauses in vec(pause(), PAUSES),
    ) {
        let (mut host, frame) = (open_host(), Answer(millimetres).to_frame());
        prop_assert_eq!(host.begin(&[]), b"R");
        for (n, byte) in frame.iter().enumerate() {
            prop_assert!(!host.is_done(), "done after {} bytes", n);
            host.receive(pauses[n], &[*byte]);
        }
        prop_assert!(host.is_done());
        prop_assert_eq!(host.driver.to_process(), [f64::from(millimetres) * 1e-3]);
    }

    /// Noise is no reason for a new request, and does not move the time-out.
    #[test]
    fn no_request_before_the_deadline(
        noise in vec((pause(), vec(any::<u8>(), 0..20)), 0..PAUSES),
    ) {
        let mut host = open_host();
        host.begin(&[]);
        let mut left = ANSWER_TIMEOUT;
        for (pause, bytes) in noise {
            // An end of line would complete an answer.
            let bytes: Vec<u8> = bytes.into_iter().filter(|byte| *byte != b'\n').collect();
            host.receive(pause, &bytes);
            left = left - pause;
            prop_assert!(!host.driver.poll_transmit(&mut Vec::new()));
            prop_assert_eq!(host.timeout(), Some(left));
        }
    }

    /// Each lost answer costs one time-out and is counted; the next one is read as ever.
    #[test]
    fn lost_answers_are_counted_and_then_forgotten(answered in vec(any::<bool>(), 1..30)) {
        let mut host = open_host();
        for (n, answered) in answered.iter().enumerate() {
            prop_assert_eq!(host.begin(&[]), b"R");
            prop_assert_eq!(host.timeout(), Some(ANSWER_TIMEOUT));
            if *answered {
                let answer = Answer(u32::try_from(n).unwrap()).to_frame();
                host.receive(SimDuration::from_millis(6), &answer);
                prop_assert_eq!(host.driver.to_process(), [n as f64 * 1e-3]);
            } else {
                prop_assert!(host.expire().is_empty());
            }
            prop_assert!(host.is_done());
        }
        let lost = answered.iter().filter(|answered| !**answered).count();
        prop_assert_eq!(host.diagnostic("lost"), lost as f64);
    }
}

/// Time by which the device is open and has answered once \[ms\]; faults begin later.
const OPEN_MS: u64 = 10;
/// Period of the controller.
const PERIOD: SimDuration = SimDuration::from_millis(2);
/// Time between two measurements: request, measurement and answer take 5.6 ms, so that every third
/// step of the controller has a new one.
const INTERVAL: SimDuration = SimDuration::from_millis(6);

/// Returns a rig of driver, wire and emulated device; without `usb` the host has a UART. The trunk
/// rises by 1 m/s, so that 1 mm more means 1 ms later.
fn rig(faults: &FaultSchedule, usb: Option<UsbTiming>) -> Rig {
    let height = AnalogSource {
        signal: HEIGHT.to_owned(),
        component: 2,
        scale: 1.0,
        offset: 0.0,
    };
    let device = FramedNode::new(EmulatedRangeFinder::new(NAME, height));
    let wire: Box<dyn Wire> = match usb {
        Some(timing) => Box::new(usb_device_wire(timing, BYTE_TIME, faults, device).unwrap()),
        None => Box::new(device_wire(BYTE_TIME, faults, device).unwrap()),
    };
    let trunk = vec![Port::output(HEIGHT, Unit::Meter, 3)];
    let plant = RecordingPlant::new(trunk, |seconds, _| seconds);
    rig_harness::rig(
        driver(),
        wire,
        (PERIOD.as_nanos() / 1_000_000, |_| 0.0),
        plant,
    )
}

/// A measurement as the controller reads it.
struct Reading {
    at: SimTime,
    /// Time since it was taken \[s\].
    age: f64,
    /// Whether it differs from the last one.
    fresh: bool,
}

/// Runs a rig and returns the readings of all steps, and the number of lost answers.
fn readings(mut rig: Rig, end_ms: u64) -> (Vec<Reading>, f64) {
    let (log, ended) = rig_harness::run(&mut rig, end_ms);
    ended.unwrap();
    // The trunk is held until the driver is open.
    let begin = log.inputs[0].0;
    let mut last = None;
    let readings = log.inputs.iter().map(|(at, inputs)| Reading {
        at: *at,
        age: (*at - begin).as_secs_f64() - inputs[0],
        fresh: last.replace(inputs[0]) != Some(inputs[0]),
    });
    let lost = diagnostic(&rig, &log, &format!("{NAME}/lost"));
    (readings.collect(), lost)
}

/// Returns the longest time from one fresh reading to the next.
fn longest_interval(readings: &[Reading]) -> SimDuration {
    let fresh: Vec<SimTime> = readings
        .iter()
        .filter(|reading| reading.fresh)
        .map(|reading| reading.at)
        .collect();
    let intervals = fresh.windows(2).map(|pair| pair[1] - pair[0]);
    intervals
        .max()
        .expect("fewer than two readings: the time-out is shorter than an answer")
}

#[test]
fn readings_have_a_bounded_age_and_no_jitter() {
    let (readings, lost) = readings(rig(&FaultSchedule::default(), None), 1_000);
    // Read 0.9 ms after the measurement and kept for two steps more; the resolution is 1 mm.
    for reading in &readings[3..] {
        assert!((0.4e-3..5.5e-3).contains(&reading.age), "{}", reading.age);
    }
    assert_eq!((longest_interval(&readings), lost), (INTERVAL, 0.0));
}

proptest! {
    /// A fault of the wire delays readings by no more than its duration and a time-out, and leaves
    /// no trace after that.
    #[test]
    fn fault_delays_readings_by_a_bounded_time(from_ms in OPEN_MS..100, for_ms in 1..90_u64) {
        let wire = format!("wire/{NAME}");
        let fault = rig_harness::fault(&wire, FaultKind::Drop { probability: 1.0 }, from_ms, for_ms);
        let (readings, lost) = readings(rig(&fault, None), 300);
        let delay_max = SimDuration::from_millis(for_ms) + ANSWER_TIMEOUT + INTERVAL + PERIOD;
        prop_assert!(longest_interval(&readings) <= INTERVAL + delay_max);
        // The first one lost may have begun an interval before the fault, the others follow each
        // after a time-out.
        let harmed = SimDuration::from_millis(for_ms) + INTERVAL;
        let lost_max = 1 + harmed.as_nanos() / ANSWER_TIMEOUT.as_nanos();
        prop_assert!(lost <= lost_max as f64, "{} lost", lost);
        let over = SimTime::ZERO + SimDuration::from_millis(from_ms) + delay_max;
        let after: Vec<Reading> = readings.into_iter().filter(|it| it.at > over).collect();
        prop_assert!(after.iter().all(|reading| reading.age < 5.5e-3));
        prop_assert_eq!(longest_interval(&after), INTERVAL);
    }

    /// A USB converter delays answers by its latency timer, four microframes and the jitter.
    #[test]
    fn usb_delays_readings_by_a_bounded_time(timer in micros(0..16_000), jitter in micros(0..900)) {
        let usb = UsbTiming {
            latency_timer: timer,
            jitter: Timing::Uniform { min: SimDuration::ZERO, max: jitter },
            ..UsbTiming::default()
        };
        let microframes = SimDuration::from_nanos(4 * usb.microframe.as_nanos());
        let (readings, lost) = readings(rig(&FaultSchedule::default(), Some(usb)), 300);
        // The next step of the controller has it.
        let interval_max = INTERVAL + timer + microframes + jitter + PERIOD;
        let interval = longest_interval(&readings);
        prop_assert!(interval <= interval_max, "{}", interval);
        prop_assert_eq!(lost, 0.0);
    }
}

/// A limit of the protocol, which has no checksum: an answer that has lost a digit is another one.
#[test]
fn lost_digit_is_not_detected() {
    let mut host = open_host();
    host.begin(&[]);
    host.receive(SimDuration::from_millis(6), b"R38\n"); // of R138
    assert!(host.is_done());
    assert_eq!(host.driver.to_process(), [0.038]);
}

/// A limit of the protocol, which has no sequence number: an answer that comes after the time-out
/// is taken for that of the next request.
#[test]
fn late_answer_is_taken_for_the_next() {
    let mut host = open_host();
    host.begin(&[]);
    host.expire();
    host.begin(&[]);
    host.receive(SimDuration::from_millis(1), &Answer(7).to_frame()); // of the request before
    assert!(host.is_done());
    assert_eq!(host.driver.to_process(), [0.007]);
}
