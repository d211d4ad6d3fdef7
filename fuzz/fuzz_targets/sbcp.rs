//! Parser, slave, bus controller and master under arbitrary bytes, at arbitrary rates: no panic,
//! and no endless wait.

#![no_main]

use libfuzzer_sys::fuzz_target;
use twinrig_kernel::{HostTime, SimDuration, SimTime};
use twinrig_sbcp::codes::CLASS_MOTORDRIVER;
use twinrig_sbcp::{
    Address, Controller, ControllerConfig, Instruction, Master, MasterConfig, Parser,
    RegisterTable, Request, Slave, SlaveConfig, Topology,
};
use twinrig_wire::{Arrivals, Piece};

/// Splits the input into pieces: a byte with length and direction, a pause, a spacing, then the
/// bytes.
fn pieces(mut data: &[u8]) -> impl Iterator<Item = (SimDuration, SimDuration, bool, &[u8])> {
    std::iter::from_fn(move || {
        let (&[control, pause, spacing], rest) = data.split_first_chunk()?;
        let (bytes, remaining) = rest.split_at(rest.len().min(usize::from(control >> 1)));
        data = remaining;
        let micros = |n: u8| SimDuration::from_micros(u64::from(n));
        Some((micros(pause), micros(spacing), control & 1 == 1, bytes))
    })
}

fuzz_target!(|data: &[u8]| {
    let (Ok(to), Ok(registers)) = (
        Address::new(CLASS_MOTORDRIVER, 1),
        RegisterTable::new(1, 1, &[]),
    ) else {
        return;
    };
    let (Ok(mut slave), Ok(mut controller), Ok(request)) = (
        Slave::new(SlaveConfig::new(CLASS_MOTORDRIVER), registers),
        Controller::new(ControllerConfig::default()),
        Request::new(to, Instruction::LOW_LATENCY, &[1, 2, 3, 4]),
    ) else {
        return;
    };
    let mut master = Master::new(MasterConfig::new(Topology::Controller));
    let mut parser = Parser::default();
    let mut now = SimTime::ZERO;
    let (mut transmitted, mut arrivals) = (Vec::new(), Arrivals::default());
    for (pause, spacing, link, bytes) in pieces(data) {
        let first = now + pause;
        let piece = Piece {
            first,
            spacing,
            bytes,
            framing_error: false,
        };
        now = first + spacing * bytes.len() as u64;
        let mut rest = bytes;
        while parser.next(&mut rest).is_some() {}
        slave.receive(piece);
        while slave.poll_event().is_some() {}
        slave.poll_transmit(&mut transmitted);
        if link {
            controller.handle_link(now, piece);
        } else {
            controller.handle_bus(now, piece);
        }
        let host = HostTime::from_nanos(now.as_nanos());
        let _ = master.cycle(host, &[request; 4]);
        master.poll_transmit(&mut transmitted);
        master.handle_bytes(host, bytes);
        master.handle_timeout(host);
        transmitted.clear();
    }
    // Without further input, everything becomes idle.
    for _ in 0..10_000 {
        let wakes = [controller.poll_timeout(), controller.bus_start()];
        let Some(wake) = wakes.into_iter().flatten().min() else {
            break;
        };
        now = now.max(wake);
        controller.handle_timeout(now);
        controller.poll_bus(now, &mut |_| {});
    }
    assert!(
        controller.poll_timeout().is_none(),
        "the controller does not become idle"
    );
    controller.poll_link(&mut arrivals);
    for _ in 0..3 {
        if let Some(due) = master.poll_timeout() {
            master.handle_timeout(due);
        }
        master.poll_transmit(&mut transmitted);
    }
    assert!(!master.is_busy(), "the master does not become idle");
});
