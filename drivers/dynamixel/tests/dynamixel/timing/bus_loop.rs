//! Loops over a bus of several servos, against the bytes on the wire.

use std::fmt::Write;

use twinrig_dynamixel::ReadPattern;
use twinrig_dynamixel::ax::AX12A;
use twinrig_dynamixel::timing::{BusLoop, adapters, percentile};
use twinrig_dynamixel::x::XL330_M288;
use twinrig_kernel::SimDuration;
use twinrig_wire::{InRule, OutRule, UsbPreset, UsbTiming};

use super::check;

const MICROFRAME: SimDuration = SimDuration::from_micros(125);

/// Microframes without other delays, so that a duration is that of the bytes, rounded up.
fn bus(servos: u8, pattern: ReadPattern) -> BusLoop {
    BusLoop {
        kind: &XL330_M288,
        servos,
        byte_time: SimDuration::from_micros(10),
        pattern,
        usb: UsbTiming {
            out: OutRule::AtOnce,
            inn: InRule::ByThisFrame,
            turnaround: SimDuration::ZERO,
            ..UsbTiming::preset(UsbPreset::Earliest)
        },
        return_delay: SimDuration::ZERO,
        seed: 1,
    }
}

/// Bytes of protocol 2.0 (manual): a sync write of `n` goals has 14 + 5n, a sync read 14 + n, a
/// read 14, an answer 15, a fast sync read 14 + n with one answer of 8 + 8n, a bulk read 10 + 5n.
#[test]
fn durations_are_those_of_the_bytes() {
    for servos in [1_u8, 6, 30] {
        let n = u64::from(servos);
        let goals = 14 + 5 * n;
        let answers = 15 * n;
        let bytes = [
            (ReadPattern::SyncRead, goals + 14 + n + answers),
            (ReadPattern::BulkRead, goals + 10 + 5 * n + answers),
            (ReadPattern::FastSyncRead, goals + 14 + n + 8 + 8 * n),
        ];
        for (pattern, bytes) in bytes {
            let mut times = bus(servos, pattern).run(20).unwrap();
            let found = percentile(&mut times.durations, 50);
            let wires = SimDuration::from_micros(10) * bytes;
            // Each answer may be read a microframe after its last byte.
            assert!(
                wires <= found && found <= wires + MICROFRAME * 2,
                "{pattern:?} of {servos}: {found}, {wires} of bytes"
            );
        }
    }
}

/// A program that reads one after the other waits for the latency timer each time.
#[test]
fn a_latency_timer_counts_once_or_for_each_servo() {
    for (pattern, timers) in [(ReadPattern::SyncRead, 1), (ReadPattern::Read, 6)] {
        let mut bus = bus(6, pattern);
        bus.usb.latency_timer = SimDuration::from_millis(16);
        let mut times = bus.run(20).unwrap();
        let found = percentile(&mut times.durations, 50);
        assert_eq!(found, SimDuration::from_millis(16) * timers, "{pattern:?}");
    }
}

/// A servo samples every millisecond; its position waits until its answer is read. In a sync read
/// the instruction determines the age of all; in single reads that of the first is the oldest.
#[test]
fn ages_are_from_the_instruction_to_the_end() {
    for kind in [&XL330_M288, &AX12A] {
        let bus = BusLoop {
            kind,
            ..bus(6, ReadPattern::Read)
        };
        let times = bus.run(40).unwrap();
        let period = SimDuration::from_millis(1);
        for (age, duration) in times.ages.iter().zip(&times.durations) {
            assert!(*age <= *duration + period, "{age} of {duration}");
            // All but the goals and the first read.
            assert!(*age * 10 >= *duration * 6, "{age} of {duration}");
        }
    }
}

/// Ages beyond a second are told apart, too, where angles are coarse.
#[test]
fn ages_of_long_transfers_are_whole() {
    let mut bus = BusLoop {
        kind: &AX12A,
        ..bus(70, ReadPattern::Read)
    };
    bus.usb.latency_timer = SimDuration::from_millis(16);
    let times = bus.run(2).unwrap();
    let found = times.ages[1].as_secs_f64();
    // All but the first read; each waits for the timer.
    assert!((found - 69.0 * 0.016).abs() < 0.02, "{found}");
}

/// The table of docs/timing.md.
#[test]
fn rates_by_number_of_servos_are_those_of_the_page() {
    let at_once = adapters().into_iter().find(|it| it.name == "at-once");
    let usb = at_once.unwrap().usb;
    let mut text =
        String::from("| timer | read | 1 servo | 6 servos | 12 servos |\n|---|---|---|---|---|");
    for timer in [0, 1, 16] {
        for pattern in ReadPattern::ALL {
            let _ = write!(text, "\n| {timer} ms | `{}` |", pattern.name());
            for servos in [1, 6, 12] {
                let mut bus = BusLoop {
                    usb: usb.clone(),
                    ..bus(servos, pattern)
                };
                bus.usb.latency_timer = SimDuration::from_millis(timer);
                let mut times = bus.run(20).unwrap();
                let median = percentile(&mut times.durations, 50).as_secs_f64();
                let age = percentile(&mut times.ages, 50).as_secs_f64();
                let _ = write!(text, " {:.0}, {:.1} |", 1.0 / median, 1e3 * age);
            }
        }
    }
    check("rates", &text);
}
