//! Cost of a cycle over converter and bus with minimal boards: four requests of 10 bytes and four
//! answers of 22, board by board, every 4 ms of simulated time.

use divan::Bencher;
use divan::counter::ItemsCount;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{Part, PlantAccess, TaskError, Wire};
use twinrig_testing::driver_harness::StaticPlant;
use twinrig_wire::{
    Fault, FaultKind, FaultSchedule, FaultSelection, Faulty, Line, Node, Piece, Rs485, UsbSerial,
    UsbTiming,
};

fn main() {
    divan::main();
}

/// Time of a byte.
const BYTE: SimDuration = SimDuration::from_micros(3);
/// Cycles per iteration.
const CYCLES: u64 = 1000;
/// Requests and answers per cycle.
const PACKETS: u64 = 8;

fn us(micros: u64) -> SimDuration {
    SimDuration::from_micros(micros)
}

/// Minimal board: counts received bytes and answers the tenth byte of a request to it.
struct Echo {
    address: u8,
    received: usize,
    addressed: bool,
    last: SimTime,
    answer: Option<SimTime>,
}

impl Part for Echo {}

impl Node for Echo {
    fn name(&self) -> &'static str {
        "echo"
    }

    fn receive(&mut self, piece: Piece<'_>) {
        if piece.first > self.last + us(15) {
            self.received = 0;
            self.addressed = piece.bytes[0] == self.address;
        }
        self.received += piece.bytes.len();
        self.last = piece.last();
        if self.addressed && self.received == 10 {
            self.answer = Some(self.last + us(10));
        }
    }

    fn next_wake(&self) -> Option<SimTime> {
        None
    }

    fn advance(&mut self, _: SimTime, _: &mut dyn PlantAccess) -> Result<(), TaskError> {
        Ok(())
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        let start = self.answer.take()?;
        bytes.extend_from_slice(&[0xF0; 22]);
        Some(start)
    }
}

fn bus() -> Rs485 {
    let echo = |address| -> Box<dyn Node> {
        Box::new(Echo {
            address,
            received: 0,
            addressed: false,
            last: SimTime::ZERO,
            answer: None,
        })
    };
    let nodes = [0, 1, 2, 3].map(echo);
    Rs485::new("sbcp", BYTE, us(2), nodes.into()).unwrap()
}

/// Sends each request when the answer to the previous one is complete.
fn cycles(wire: &mut dyn Wire, start: &mut SimTime, wakes: &mut u64) {
    let (mut bytes, mut no_plant) = (Vec::new(), StaticPlant::default());
    for _ in 0..CYCLES {
        let mut now = *start;
        for board in 0..4 {
            wire.advance(now, &mut no_plant).unwrap();
            wire.send(now, &[board, 1, 2, 3, 4, 5, 6, 7, 8, 9]);
            bytes.clear();
            while bytes.len() < 22 {
                now = wire.next_wake().unwrap();
                *wakes += 1;
                wire.advance(now, &mut no_plant).unwrap();
                wire.receive(&mut bytes);
            }
        }
        *start += us(4000);
    }
}

fn measure(bencher: Bencher, line: impl Line) {
    let mut wire = UsbSerial::new("sbcp", UsbTiming::default(), BYTE, 1, line).unwrap();
    let (mut start, mut wakes) = (SimTime::ZERO, 0);
    bencher
        .counter(ItemsCount::new(CYCLES * PACKETS))
        .bench_local(|| cycles(&mut wire, &mut start, &mut wakes));
    let cycles = start.since_start().as_nanos() / us(4000).as_nanos();
    println!("{:.1} wake-ups a cycle", wakes as f64 / cycles as f64);
}

/// Packets per second; the time of a packet is that of an iteration divided by 8000.
#[divan::bench]
fn usb_and_rs485(bencher: Bencher) {
    measure(bencher, bus());
}

/// The same with a fault that never becomes active.
#[divan::bench]
fn usb_faults_and_rs485(bencher: Bencher) {
    let fault = Fault {
        at: SimTime::MAX,
        on: "wire/sbcp".to_owned(),
        kind: FaultKind::Stuck,
        lasts: us(1),
        select: FaultSelection::default(),
    };
    let schedule = FaultSchedule {
        faults: vec![fault],
        seed: 1,
    };
    measure(
        bencher,
        Faulty::new("wire/sbcp", BYTE, &schedule, bus()).unwrap(),
    );
}
