//! Master, bus controller and four boards, connected without a bus: the cost of the protocol alone.

use twinrig_kernel::{HostTime, SimDuration, SimTime};
use twinrig_sbcp::codes::CLASS_MOTORDRIVER;
use twinrig_sbcp::{
    Address, BYTE_TIME, Controller, ControllerConfig, Instruction, Master, MasterConfig,
    RegisterTable, Request, Slave, SlaveConfig, Topology,
};
use twinrig_wire::{Arrivals, Piece};

pub struct ProtocolStack {
    pub master: Master,
    controller: Controller,
    slaves: Vec<Slave>,
    frame: [Request; 4],
    now: SimTime,
    bytes: Vec<u8>,
    tx: Vec<u8>,
    arrivals: Arrivals,
}

impl ProtocolStack {
    pub fn new() -> Self {
        let board = |id| Address::new(CLASS_MOTORDRIVER, id).unwrap();
        let request = |id| Request::new(board(id), Instruction::LOW_LATENCY, &[1, 2, 3, 4]);
        let slave = |id| {
            let registers = RegisterTable::new(id, 1, &[]).unwrap();
            Slave::new(SlaveConfig::new(CLASS_MOTORDRIVER), registers).unwrap()
        };
        Self {
            master: Master::new(MasterConfig::new(Topology::Controller)),
            controller: Controller::new(ControllerConfig::default()).unwrap(),
            slaves: (1..=4).map(slave).collect(),
            frame: [1, 2, 3, 4].map(|id| request(id).unwrap()),
            now: SimTime::ZERO,
            bytes: Vec::with_capacity(256),
            tx: Vec::with_capacity(256),
            arrivals: Arrivals::default(),
        }
    }

    /// Runs a cycle, 2 ms after the last one.
    pub fn cycle(&mut self) {
        self.now += SimDuration::from_millis(2);
        let host = HostTime::from_nanos(self.now.as_nanos());
        for slave in &mut self.slaves {
            slave.set_reply(&[7; 16]).unwrap();
        }
        self.master.cycle(host, &self.frame).unwrap();
        self.bytes.clear();
        self.master.poll_transmit(&mut self.bytes);
        let piece = Piece {
            first: self.now + BYTE_TIME,
            spacing: BYTE_TIME,
            bytes: &self.bytes,
            framing_error: false,
        };
        self.controller.handle_link(self.now, piece);
        while let Some(start) = self.controller.bus_start() {
            self.exchange(start);
        }
        self.arrivals.clear();
        self.controller.poll_link(&mut self.arrivals);
        self.master.handle_bytes(host, self.arrivals.bytes());
        assert!(self.master.outcomes().iter().all(Result::is_ok));
    }

    fn exchange(&mut self, start: SimTime) {
        let slaves = &mut self.slaves;
        self.controller.poll_bus(start, &mut |piece| {
            for slave in slaves.iter_mut() {
                slave.receive(piece);
            }
        });
        for transmitter in 0..self.slaves.len() {
            self.tx.clear();
            let slave = &mut self.slaves[transmitter];
            while slave.poll_event().is_some() {}
            let Some(start) = slave.poll_transmit(&mut self.tx) else {
                continue;
            };
            let piece = Piece {
                first: start + BYTE_TIME,
                spacing: BYTE_TIME,
                bytes: &self.tx,
                framing_error: false,
            };
            for (other, slave) in self.slaves.iter_mut().enumerate() {
                if other != transmitter {
                    slave.receive(piece);
                }
            }
            self.controller.handle_bus(piece.last(), piece);
        }
    }
}
