//! Driver and board, request by request: bytes, times and time-outs.

use twinrig_kernel::{BoardClock, LocalDuration, Port, SimDuration, SimTime, Unit};
use twinrig_runtime::{Driver, Part, Timing};
use twinrig_tactile::protocol::{Command, Message, Status};
use twinrig_tactile::{SampleChoice, Tactile, TactileDriver};
use twinrig_testing::driver_harness::{DriverHarness, StaticPlant, plant, run_device};
use twinrig_wire::FramedMessage;

const ANSWER_TIMEOUT: SimDuration = SimDuration::from_millis(200);
const SHORT_DELAY: SimDuration = SimDuration::from_millis(3);
const SILENCE: SimDuration = SimDuration::from_millis(20);
/// Two periods more, for a sample.
const SAMPLE_TIMEOUT: SimDuration = SimDuration::from_millis(202);

fn config() -> Tactile {
    Tactile {
        noise: [0.0; 3],
        jitter: Timing::ZERO,
        ..Tactile::new("tactile", "bench/force")
    }
}

/// A sample of boot `boot`, with its number as stamp \[ms\].
fn sample(boot: u8, sequence: u16) -> Vec<u8> {
    Message::Data {
        boot,
        sequence,
        stamp: 1000 * u32::from(sequence),
        volts: [16_384, -3277],
        bridge: 1 << 19,
        status: Status::default(),
    }
    .to_frame()
}

fn answer(command: Command, done: bool) -> Vec<u8> {
    Message::Acknowledgement { command, done }.to_frame()
}

fn start() -> Vec<u8> {
    Message::Start {
        period_us: 1000,
        oversampling: 1,
    }
    .to_frame()
}

fn host(config: &Tactile) -> DriverHarness<TactileDriver> {
    DriverHarness::new(config.driver().unwrap())
}

fn opened(take: SampleChoice) -> DriverHarness<TactileDriver> {
    let mut host = host(&Tactile { take, ..config() });
    host.open();
    host.receive(SHORT_DELAY, &answer(Command::Start, true));
    host.receive(SHORT_DELAY, &sample(0, 7));
    assert!(host.is_done());
    host
}

#[test]
fn opening_requires_an_acknowledgement_and_then_a_sample() {
    let mut host = host(&config());
    assert_eq!(host.open(), start());
    assert_eq!(host.timeout(), Some(ANSWER_TIMEOUT));
    host.receive(SHORT_DELAY, &sample(0, 1));
    assert!(!host.is_done(), "the sample may be of an earlier session");
    host.receive(SHORT_DELAY, &answer(Command::Start, true));
    assert!(!host.is_done());
    assert_eq!(host.timeout(), Some(SAMPLE_TIMEOUT));
    host.receive(SHORT_DELAY, &sample(0, 2));
    assert!(host.is_done());
    // Half of 10 V; 3277 counts of 1/3276.8 V; 1/16 of 25 mV/V at 2 mV/V per 50 N.
    let [resistive, electric, reference] = host.driver.to_process() else {
        panic!("three channels");
    };
    assert_eq!(*resistive, 5.0);
    assert!((electric + 1.0).abs() < 1e-4, "{electric}");
    assert!((reference - 39.0625).abs() < 1e-12, "{reference}");
}

#[test]
fn zeroing_at_the_start_is_part_of_opening() {
    let mut config = config();
    config.zero = true;
    let mut host = host(&config);
    assert_eq!(host.open(), [start(), Message::Zero.to_frame()].concat());
    host.receive(SHORT_DELAY, &answer(Command::Start, true));
    host.receive(SHORT_DELAY, &sample(0, 1));
    assert!(!host.is_done(), "the sample is not zeroed");
    host.receive(SHORT_DELAY, &answer(Command::Zero, true));
    host.receive(SHORT_DELAY, &sample(0, 2));
    assert!(host.is_done());
    assert_eq!(host.diagnostic("tactile/samples"), 1.0);
}

#[test]
fn repeated_opening_requires_a_new_acknowledgement() {
    let mut host = host(&config());
    host.open();
    host.receive(SHORT_DELAY, &answer(Command::Start, true));
    assert_eq!(host.expire(), start());
    host.receive(SHORT_DELAY, &sample(0, 1));
    assert!(!host.is_done());
    assert_eq!(host.expire(), start());
    assert!(host.expire().is_empty());
    let reason = host.driver.is_busy().unwrap_err().why;
    assert!(reason.contains("did not acknowledge"), "{reason}");
}

#[test]
fn rejected_command_is_reported() {
    let mut host = host(&config());
    host.open();
    for _ in 0..3 {
        host.receive(SHORT_DELAY, &answer(Command::Unknown, false));
        host.expire();
    }
    let reason = host.driver.is_busy().unwrap_err().why;
    assert!(reason.contains("rejects"), "{reason}");
}

#[test]
fn newest_sample_is_immediate_and_fresh_one_is_awaited_for_two_periods() {
    let mut newest = opened(SampleChoice::Newest);
    assert!(newest.begin(&[]).is_empty());
    assert!(newest.is_done());
    let mut fresh = opened(SampleChoice::Fresh);
    assert!(fresh.begin(&[]).is_empty());
    // Two periods and a frame of 18 bytes at 921 600 baud.
    let timeout = SimDuration::from_nanos(2_000_000 + 18 * 10_851);
    assert_eq!(fresh.timeout(), Some(timeout));
    fresh.receive(SimDuration::from_micros(500), &sample(0, 7));
    assert!(!fresh.is_done(), "a repeated sample is not fresh");
    fresh.receive(SimDuration::from_micros(500), &sample(0, 8));
    assert!(fresh.is_done());
    let stale = fresh.diagnostic("tactile/stale");
    fresh.begin(&[]);
    fresh.expire();
    assert!(fresh.is_done());
    assert_eq!(fresh.diagnostic("tactile/stale"), stale + 1.0);
}

#[test]
fn silent_board_is_started_again_until_it_answers() {
    let mut host = opened(SampleChoice::Newest);
    assert_eq!(host.timeout(), Some(SILENCE));
    host.receive(SHORT_DELAY, &sample(0, 8));
    assert_eq!(host.timeout(), Some(SILENCE), "a sample defers it");
    assert_eq!(host.expire(), start());
    assert_eq!(host.expire(), start());
    host.receive(SHORT_DELAY, &answer(Command::Start, true));
    host.receive(SHORT_DELAY, &sample(1, 0));
    assert_eq!(host.timeout(), Some(SILENCE));
    let counts = ["restarts", "started_again", "lost", "samples"];
    let counts = counts.map(|name| host.diagnostic(&format!("tactile/{name}")));
    assert_eq!(counts, [1.0, 2.0, 0.0, 3.0]);
    // A late frame of the boot before.
    host.receive(SHORT_DELAY, &sample(0, 9));
    assert_eq!(host.diagnostic("restarts"), 1.0);
    assert_eq!(host.diagnostic("tactile/stale"), 1.0);
}

#[test]
fn stamp_that_jumps_back_is_a_restart_and_a_wrap_is_not() {
    let stamped = |sequence, stamp| {
        Message::Data {
            boot: 0,
            sequence,
            stamp,
            volts: [0; 2],
            bridge: 0,
            status: Status::default(),
        }
        .to_frame()
    };
    let mut host = host(&config());
    host.open();
    host.receive(SHORT_DELAY, &answer(Command::Start, true));
    host.receive(SHORT_DELAY, &stamped(0, u32::MAX - 2_999));
    host.receive(SHORT_DELAY, &stamped(1, 0));
    let offset = host.diagnostic("clock/offset");
    // 71.6 min: the stamp continues behind its wrap.
    assert!((offset + 4_294.967).abs() < 0.1, "{offset}");
    assert_eq!(host.diagnostic("restarts"), 0.0);
    // An hour and a half without samples: two wraps, less 10 s.
    let pause = SimDuration::from_micros((2 << 32) - 10_000_000);
    host.receive(pause, &stamped(2, 0_u32.wrapping_sub(10_000_000)));
    let offset = host.diagnostic("clock/offset");
    assert!((offset + 4_294.967).abs() < 0.1, "{offset}");
    assert_eq!(host.diagnostic("restarts"), 0.0);
    host.receive(SHORT_DELAY, &stamped(3, 0_u32.wrapping_sub(10_000_001)));
    assert_eq!(host.diagnostic("restarts"), 1.0);
}

#[test]
fn restart_is_noticed_without_a_boot_number() {
    let mut host = opened(SampleChoice::Newest);
    host.receive(SHORT_DELAY, &sample(0, 3));
    assert_eq!(host.diagnostic("tactile/stale"), 1.0, "a late sample");
    host.expire();
    host.receive(SHORT_DELAY, &sample(0, 0));
    host.receive(SHORT_DELAY, &sample(0, 3));
    let counts = ["restarts", "stale", "lost"];
    let counts = counts.map(|name| host.diagnostic(&format!("tactile/{name}")));
    assert_eq!(counts, [1.0, 1.0, 2.0]);
}

#[test]
fn long_pause_is_bridged_by_the_elapsed_time() {
    let mut host = opened(SampleChoice::Newest);
    // The sequence wraps every 65.5 s: 40 s and 100 s without samples are not late ones.
    let mut expected = 0.0;
    for (pause_s, sequence, stamp) in [(40_u32, 40_007, 40_007_000), (100, 8_935, 140_007_000)] {
        let frame = Message::Data {
            boot: 0,
            sequence,
            stamp,
            volts: [0; 2],
            bridge: 0,
            status: Status::default(),
        };
        host.receive(SimDuration::from_secs(pause_s.into()), &frame.to_frame());
        expected += 1e3 * f64::from(pause_s) - 1.0;
        assert_eq!(host.diagnostic("tactile/lost"), expected);
    }
    assert_eq!(host.diagnostic("tactile/stale"), 0.0);
    // As many boots as a boot number has, less one, are not a late one after a silence.
    host.receive(SILENCE, &sample(255, 0));
    assert_eq!(host.diagnostic("restarts"), 1.0);
    assert_eq!(host.diagnostic("tactile/stale"), 0.0);
    host.receive(SHORT_DELAY, &sample(254, 7));
    assert_eq!(host.diagnostic("tactile/stale"), 1.0);
}

#[test]
fn clock_is_reported_once_a_second() {
    let mut host = opened(SampleChoice::Newest);
    let mut reports = 0;
    for sequence in 8..3_508 {
        host.receive(SimDuration::from_millis(1), &sample(0, sequence));
        let sent = host.begin(&[]);
        reports += u32::from(!sent.is_empty());
        if let Ok(Message::Clock { boot, stamp, .. }) = Message::decode(&sent) {
            assert_eq!((boot, stamp), (0, 1000 * u32::from(sequence)));
        } else {
            assert!(sent.is_empty(), "{sent:02x?}");
        }
    }
    assert_eq!(reports, 3);
}

#[test]
fn closing_stops_the_board_and_awaits_its_acknowledgement() {
    let mut host = opened(SampleChoice::Newest);
    assert_eq!(host.close(), Message::Stop.to_frame());
    host.receive(SHORT_DELAY, &sample(0, 8));
    assert!(!host.is_done());
    assert_eq!(host.expire(), Message::Stop.to_frame());
    host.receive(SHORT_DELAY, &answer(Command::Stop, true));
    assert!(host.is_done());
    assert_eq!(host.timeout(), None, "a stopped board may be silent");
}

/// Signals of the plant: 5 V, −12 V, 25 N.
fn signals() -> ([Port; 3], StaticPlant) {
    let units = [Unit::Volt, Unit::Volt, Unit::Newton];
    let ports = std::array::from_fn(|channel| {
        let name = format!("bench/force/{}", twinrig_tactile::CHANNELS[channel]);
        Port::output(name, units[channel], 1)
    });
    let plant = StaticPlant {
        outputs: vec![5.0, -12.0, 25.0],
        ..StaticPlant::default()
    };
    (ports, plant)
}

fn at(micros: u64) -> SimTime {
    SimTime::ZERO + SimDuration::from_micros(micros)
}

#[test]
fn board_samples_by_its_own_clock_once_it_is_started() {
    let mut config = config();
    // Half a millisecond ahead of time, just before the wrap of its stamp.
    let offset = LocalDuration::from_nanos(((1 << 32) - 2_500) * 1000);
    config.clock = BoardClock::new(offset, 0).unwrap();
    let mut board = config.board().unwrap();
    let (ports, mut signals) = signals();
    board.connect("tactile", &plant(&ports)).unwrap();
    let commands = [start(), Message::Zero.to_frame()].concat();
    let sent = run_device(&mut board, &mut signals, (at(1_250), &commands), at(3_800));
    let (times, frames): (Vec<_>, Vec<_>) = sent.into_iter().unzip();
    // The clock shows whole milliseconds less 296 µs (2³² modulo 1000) at 2.204 ms.
    assert_eq!(times, [at(1_300), at(1_300), at(2_204), at(3_204)]);
    assert_eq!(frames[0], answer(Command::Start, true));
    assert_eq!(frames[1], answer(Command::Zero, true));
    let expected = |sequence, stamp, bridge| Message::Data {
        boot: 0,
        sequence,
        stamp,
        volts: [16_384, i16::MIN],
        bridge,
        status: Status {
            saturated: [false, true, false],
            ..Status::default()
        },
    };
    let stamp = u32::MAX - 295;
    assert_eq!(Message::decode(&frames[2]), Ok(expected(0, stamp, 0)));
    assert_eq!(
        Message::decode(&frames[3]),
        Ok(expected(1, stamp.wrapping_add(1000), 0))
    );
}

#[test]
fn repeated_start_does_not_interrupt_a_sample() {
    let mut board = config().board().unwrap();
    let (ports, mut signals) = signals();
    board.connect("tactile", &plant(&ports)).unwrap();
    let start = Message::Start {
        period_us: 1000,
        oversampling: 4,
    }
    .to_frame();
    let first = run_device(&mut board, &mut signals, (at(500), &start), at(2_900));
    // In the middle of the conversions of the sample of 3.375 ms.
    let second = run_device(&mut board, &mut signals, (at(3_400), &start), at(4_900));
    let samples = |sent: Vec<(SimTime, Vec<u8>)>| {
        let messages = sent.into_iter();
        let messages = messages.filter_map(|(_, frame)| match Message::decode(&frame) {
            Ok(Message::Data {
                sequence, stamp, ..
            }) => Some((sequence, stamp)),
            _ => None,
        });
        messages.collect::<Vec<_>>()
    };
    assert_eq!(samples(first), [(0, 1_375), (1, 2_375)]);
    assert_eq!(samples(second), [(2, 3_375), (3, 4_375)]);
}

#[test]
fn oversampled_stamp_is_the_middle_of_its_conversions() {
    let mut config = config();
    config.oversampling = 4;
    let mut board = config.board().unwrap();
    let (ports, mut signals) = signals();
    board.connect("tactile", &plant(&ports)).unwrap();
    let start = Message::Start {
        period_us: 1000,
        oversampling: 4,
    };
    let sent = run_device(
        &mut board,
        &mut signals,
        (at(500), &start.to_frame()),
        at(1_900),
    );
    // Converted at 1000, 1250, 1500 and 1750 µs.
    let [_, (sent_at, frame)] = &sent[..] else {
        panic!("{sent:?}");
    };
    assert_eq!(*sent_at, at(1_750));
    let Ok(Message::Data { stamp, status, .. }) = Message::decode(frame) else {
        panic!("{frame:02x?}");
    };
    assert_eq!((stamp, status.anti_aliased), (1_375, true));
}

#[test]
fn unsupported_start_is_rejected() {
    let mut board = config().board().unwrap();
    let (ports, mut signals) = signals();
    board.connect("tactile", &plant(&ports)).unwrap();
    let start = Message::Start {
        period_us: 1500,
        oversampling: 1,
    };
    let sent = run_device(
        &mut board,
        &mut signals,
        (at(500), &start.to_frame()),
        at(9_000),
    );
    assert_eq!(sent, [(at(550), answer(Command::Unknown, false))]);
}
