//! Cost of a frame: sampled by the board, sent over the line, mapped and passed on by the driver.
//! An iteration is a second, a thousand frames: its time in milliseconds is the cost of a frame in
//! microseconds.

use divan::Bencher;
use divan::counter::ItemsCount;
use twinrig_kernel::{HostTime, Port, SimDuration, SimTime, Unit};
use twinrig_runtime::{Driver, Part, Wire};
use twinrig_tactile::protocol::{Command, Message, Status};
use twinrig_tactile::{CHANNELS, Tactile, TactileDriver};
use twinrig_testing::driver_harness::{StaticPlant, plant};
use twinrig_wire::{FaultSchedule, FramedMessage};

fn main() {
    divan::main();
}

const FRAMES: u64 = 1000;

/// Exchanges bytes until `end`, as a task does.
fn run(driver: &mut TactileDriver, wire: &mut dyn Wire, signals: &mut StaticPlant, end: SimTime) {
    let (mut read, mut written) = (Vec::with_capacity(64), Vec::with_capacity(64));
    while let Some(now) = wire.next_wake().filter(|&now| now <= end) {
        let host = HostTime::from_nanos(now.as_nanos());
        wire.advance(now, signals).expect("the wire works");
        wire.receive(&mut read);
        if !read.is_empty() {
            driver.handle_bytes(host, &read);
            read.clear();
        }
        while driver.poll_transmit(&mut written) {
            wire.send(now, &written);
            written.clear();
        }
    }
}

#[divan::bench(args = [1, 4])]
fn frames_from_board_to_driver(bencher: Bencher, oversampling: u8) {
    let mut config = Tactile::new("tactile", "bench/force");
    config.oversampling = oversampling;
    let mut driver = config.driver().expect("a valid configuration");
    let mut wire = config
        .wire(&FaultSchedule::default())
        .expect("a valid configuration");
    let units = [Unit::Volt, Unit::Volt, Unit::Newton];
    let ports = CHANNELS.iter().zip(units);
    let ports = ports.map(|(name, unit)| Port::output(format!("bench/force/{name}"), unit, 1));
    let ports: Vec<Port> = ports.collect();
    wire.connect("tactile", &plant(&ports))
        .expect("all signals");
    let mut signals = StaticPlant {
        outputs: vec![1.0, 2.0, 3.0],
        ..StaticPlant::default()
    };
    let mut start = Vec::new();
    driver.open(HostTime::from_nanos(0));
    driver.poll_transmit(&mut start);
    wire.send(SimTime::ZERO, &start);
    let mut end = SimTime::ZERO + SimDuration::from_secs(10);
    run(&mut driver, &mut wire, &mut signals, end);
    assert_eq!(driver.is_busy(), Ok(false));
    bencher.counter(ItemsCount::new(FRAMES)).bench_local(|| {
        end += SimDuration::from_secs(1);
        run(&mut driver, &mut wire, &mut signals, end);
    });
}

#[divan::bench]
fn frames_in_the_driver(bencher: Bencher) {
    let config = Tactile::new("tactile", "bench/force");
    let mut driver = config.driver().expect("a valid configuration");
    driver.open(HostTime::from_nanos(0));
    let command = Command::Start;
    let done = Message::Acknowledgement {
        command,
        done: true,
    };
    driver.handle_bytes(HostTime::from_nanos(0), &done.to_frame());
    let (mut frame, mut written, mut number) = (Vec::new(), Vec::new(), 0_u64);
    bencher.counter(ItemsCount::new(FRAMES)).bench_local(|| {
        for _ in 0..FRAMES {
            number += 1;
            let [.., a, b, c, d] = (number * 1000).to_be_bytes();
            let data = Message::Data {
                boot: 0,
                sequence: u16::from_be_bytes([number.to_be_bytes()[6], number.to_be_bytes()[7]]),
                stamp: u32::from_be_bytes([a, b, c, d]),
                volts: [1, 2],
                bridge: 3,
                status: Status::default(),
            };
            frame.clear();
            data.encode(&mut frame);
            let jitter = number * 7919 % 50_000;
            driver.handle_bytes(HostTime::from_nanos(number * 1_000_000 + jitter), &frame);
            written.clear();
            driver.poll_transmit(&mut written);
        }
    });
}
