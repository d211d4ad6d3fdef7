//! Times that users state in public threads, beside simulated ones.

use std::fmt::Write;

use twinrig_dynamixel::timing::{HostLoop, adapters, percentile};
use twinrig_dynamixel::x::XM430_W350;
use twinrig_dynamixel::{JointSignals, ReadPattern, ServoBusConfig, ServoConfig};
use twinrig_kernel::{BoardClock, SimDuration};
use twinrig_runtime::Timing;
use twinrig_testing::wired_harness::WiredHarness;
use twinrig_wire::{FaultSchedule, UsbTiming};

use crate::{check, ms};

const RETURN_DELAY: u16 = 9;

fn adapter(name: &str) -> UsbTiming {
    let mut all = adapters().into_iter();
    all.find(|adapter| adapter.name == name).unwrap().usb
}

/// Returns the median time in which a program writes to six XM430 at 4 Mbit/s and reads them.
fn six_servos(usb: &str, pattern: ReadPattern, return_delay: i32) -> SimDuration {
    let servo = |n: u8| ServoConfig {
        name: format!("joint{n}"),
        kind: &XM430_W350,
        id: n,
        registers: Vec::new(),
        settings: vec![(RETURN_DELAY, return_delay / 2)],
        signals: JointSignals::of_joint(&format!("joint{n}")),
        command: format!("joint{n}/command"),
        voltage: 12.0,
        temperature: 25.0,
        clock: BoardClock::IDEAL,
    };
    let config = ServoBusConfig {
        name: "dxl".to_owned(),
        servos: (1..=6).map(servo).collect(),
        byte_time: SimDuration::from_nanos(2_500),
        pattern,
        period: SimDuration::from_millis(20),
        timeout: SimDuration::from_millis(50),
        usb: adapter(usb),
        turnaround: SimDuration::ZERO,
        faults: FaultSchedule::default(),
        seed: 1,
    };
    let joints: Vec<_> = config
        .servos
        .iter()
        .map(|servo| servo.name.clone())
        .collect();
    let mut rig = WiredHarness::new(config.driver().unwrap(), config.wire().unwrap(), &joints);
    rig.open().unwrap();
    let times = (0..21).map(|_| rig.transfer(&[0.0; 6]));
    percentile(&mut times.collect::<Vec<_>>(), 50)
}

/// Returns the median time of five reads of one servo at 1 Mbit/s.
fn five_reads(usb: &str, return_delay: u64) -> SimDuration {
    let host = HostLoop {
        usb: adapter(usb),
        return_delay: SimDuration::from_micros(return_delay),
        sleep: None,
        program: Timing::ZERO,
        seed: 1,
    };
    percentile(&mut host.periods(21).unwrap(), 50)
}

#[test]
fn threads_state_times_beside_simulated_ones() {
    let one_ms = ["at-once-1ms", "low-latency"];
    let both = |of: &dyn Fn(&str) -> SimDuration| one_ms.map(|usb| ms(of(usb))).join(" / ");
    let six = |pattern, delay| both(&|usb| six_servos(usb, pattern, delay));
    let three =
        |delay| both(&|usb| SimDuration::from_nanos(five_reads(usb, delay).as_nanos() / 5 * 3));
    let single = ms(SimDuration::from_nanos(
        five_reads("at-once-16ms", 0).as_nanos() / 5,
    ));
    let rows = [
        (
            "302",
            "6 reads one by one, 4 Mbit/s, timer 1 ms",
            "> 6",
            500,
            six(ReadPattern::Read, 500),
        ),
        ("302", "the same", "> 6", 0, six(ReadPattern::Read, 0)),
        (
            "302",
            "sync read of 6, 4 Mbit/s, timer 1 ms",
            "> 4",
            500,
            six(ReadPattern::SyncRead, 500),
        ),
        ("302", "the same", "> 4", 0, six(ReadPattern::SyncRead, 0)),
        (
            "288",
            "2 reads and a write, timer 1 ms",
            "6",
            500,
            three(500),
        ),
        ("288", "the same", "6", 0, three(0)),
        (
            "330",
            "1 read, 1 Mbit/s, return delay at its least",
            "15",
            0,
            single,
        ),
    ];
    let mut text = String::from(
        "| issue | as stated | stated \\[ms\\] | return delay | simulated \\[ms\\] |\n|---|---|---|---|---|",
    );
    for (issue, what, stated, delay, simulated) in rows {
        let _ = write!(
            text,
            "\n| [{issue}](https://github.com/ROBOTIS-GIT/DynamixelSDK/issues/{issue}) | {what} | {stated} \
             | {delay} µs | {simulated} |"
        );
    }
    check("threads", &text);
}
