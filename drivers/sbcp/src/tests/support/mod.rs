//! Master, optional bus controller and boards on a bus that applies a test's byte filter.

#![allow(dead_code, reason = "no test uses all of it")]

use std::collections::BTreeMap;
use std::time::Duration;

use twinrig_kernel::{HostTime, SimDuration, SimTime};
use twinrig_sbcp::codes::CLASS_MOTORDRIVER;
use twinrig_sbcp::{
    Address, BYTE_TIME, Controller, ControllerConfig, Instruction, Master, MasterConfig, Outcome,
    RegisterTable, Request, Slave, SlaveConfig, Topology,
};
use twinrig_wire::{Arrivals, Piece};

pub const COMMAND: [u8; 4] = [1, 2, 3, 4];

pub fn micros(n: u64) -> SimDuration {
    SimDuration::from_micros(n)
}

pub fn board(id: u8) -> Address {
    Address::new(CLASS_MOTORDRIVER, id).unwrap()
}

pub fn slave_with(id: u8, config: SlaveConfig) -> Slave {
    let mut slave = Slave::new(config, RegisterTable::new(id, 1, &[]).unwrap()).unwrap();
    slave.set_reply(&[id; 16]).unwrap();
    slave
}

pub fn slave(id: u8) -> Slave {
    slave_with(id, SlaveConfig::new(CLASS_MOTORDRIVER))
}

/// The four requests of a cycle.
pub fn frame() -> [Request; 4] {
    [1, 2, 3, 4].map(|id| Request::new(board(id), Instruction::LOW_LATENCY, &COMMAND).unwrap())
}

/// Station that transmits.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Transmitter {
    Near,
    Board(usize),
}

/// Filter of the bytes on the bus: changes or drops a byte.
pub type ByteFilter = Box<dyn FnMut(Transmitter, SimTime, u8) -> Option<u8>>;

pub struct Rig {
    pub master: Master,
    pub controller: Option<Controller>,
    pub slaves: Vec<Slave>,
    /// Latency from the host to the link, and back.
    pub latency: SimDuration,
    pub filter: ByteFilter,
    pub now: SimTime,
    /// Bytes in transmission, by completion time.
    bus: BTreeMap<(SimTime, u64), (Transmitter, u8)>,
    /// Bytes on the way to the host, by arrival time.
    inbound: BTreeMap<(SimTime, u64), u8>,
    sequence: u64,
    /// Time of the master's last write.
    pub written: SimTime,
}

pub fn host(at: SimTime) -> HostTime {
    HostTime::from_nanos(at.as_nanos())
}

impl Rig {
    pub fn new(topology: Topology) -> Self {
        Self::with(MasterConfig::new(topology), ControllerConfig::default())
    }

    pub fn with(config: MasterConfig, controller: ControllerConfig) -> Self {
        let controlled = config.topology == Topology::Controller;
        Self {
            master: Master::new(config),
            controller: controlled.then(|| Controller::new(controller).unwrap()),
            slaves: (1..=4).map(slave).collect(),
            latency: micros(250),
            filter: Box::new(|_, _, byte| Some(byte)),
            now: SimTime::ZERO,
            bus: BTreeMap::new(),
            inbound: BTreeMap::new(),
            sequence: 0,
            written: SimTime::ZERO,
        }
    }

    fn transmit(&mut self, transmitter: Transmitter, piece: Piece<'_>) {
        for (index, byte) in piece.bytes.iter().enumerate() {
            let at = piece.at(index);
            if let Some(byte) = (self.filter)(transmitter, at, *byte) {
                self.sequence += 1;
                self.bus.insert((at, self.sequence), (transmitter, byte));
            }
        }
    }

    fn write(&mut self) {
        let mut bytes = Vec::new();
        while self.master.poll_transmit(&mut bytes) {
            self.written = self.now;
            let piece = Piece {
                first: self.now + self.latency + BYTE_TIME,
                spacing: BYTE_TIME,
                bytes: &bytes,
                framing_error: false,
            };
            match &mut self.controller {
                Some(controller) => controller.handle_link(self.now, piece),
                None => self.transmit(Transmitter::Near, piece),
            }
            bytes.clear();
        }
    }

    fn next_wake(&self) -> Option<SimTime> {
        let controller = self.controller.as_ref();
        let wakes = [
            self.bus.keys().next().map(|key| key.0),
            self.inbound.keys().next().map(|key| key.0),
            self.master
                .poll_timeout()
                .map(|at| SimTime::from_nanos(at.as_nanos())),
            controller.and_then(Controller::poll_timeout),
            controller.and_then(Controller::bus_start),
        ];
        wakes.into_iter().flatten().min()
    }

    /// Advances to the earliest wake-up.
    pub fn step(&mut self) -> bool {
        let Some(wake) = self.next_wake() else {
            return false;
        };
        self.now = self.now.max(wake);
        while let Some((&key, _)) = self.bus.first_key_value() {
            if key.0 > self.now {
                break;
            }
            let (transmitter, byte) = self.bus.remove(&key).unwrap();
            self.receive(transmitter, key.0, byte);
        }
        if let Some(controller) = &mut self.controller {
            if controller.poll_timeout().is_some_and(|at| at <= self.now) {
                controller.handle_timeout(self.now);
            }
            let mut pieces = Vec::new();
            while controller.poll_bus(self.now, &mut |piece| {
                pieces.push((piece.first, piece.bytes.to_vec()));
            }) {}
            let mut arrivals = Arrivals::default();
            controller.poll_link(&mut arrivals);
            for (first, bytes) in pieces {
                let spacing = BYTE_TIME;
                self.transmit(
                    Transmitter::Near,
                    Piece {
                        first,
                        spacing,
                        bytes: &bytes,
                        framing_error: false,
                    },
                );
            }
            for (at, byte) in arrivals.iter() {
                self.arrive(at, byte);
            }
        }
        while let Some((&key, &byte)) = self.inbound.first_key_value() {
            if key.0 > self.now {
                break;
            }
            self.inbound.remove(&key);
            self.master.handle_bytes(host(self.now), &[byte]);
        }
        if self
            .master
            .poll_timeout()
            .is_some_and(|at| at <= host(self.now))
        {
            self.master.handle_timeout(host(self.now));
        }
        self.write();
        true
    }

    /// Puts a byte on the way to the host.
    pub fn arrive(&mut self, at: SimTime, byte: u8) {
        self.sequence += 1;
        self.inbound
            .insert((at + self.latency, self.sequence), byte);
    }

    fn receive(&mut self, transmitter: Transmitter, at: SimTime, byte: u8) {
        let bytes = [byte];
        let piece = Piece {
            first: at,
            spacing: BYTE_TIME,
            bytes: &bytes,
            framing_error: false,
        };
        let mut sent = Vec::new();
        for (index, slave) in self.slaves.iter_mut().enumerate() {
            if transmitter == Transmitter::Board(index) {
                continue;
            }
            slave.receive(piece);
            while slave.poll_event().is_some() {}
            let mut bytes = Vec::new();
            if let Some(start) = slave.poll_transmit(&mut bytes) {
                sent.push((index, start, bytes));
            }
        }
        if transmitter != Transmitter::Near {
            match &mut self.controller {
                Some(controller) => controller.handle_bus(self.now, piece),
                None => self.arrive(at, byte),
            }
        }
        for (index, start, bytes) in sent {
            self.transmit(
                Transmitter::Board(index),
                Piece {
                    first: start + BYTE_TIME,
                    spacing: BYTE_TIME,
                    bytes: &bytes,
                    framing_error: false,
                },
            );
        }
    }

    /// Begins a cycle.
    pub fn begin(&mut self, frame: &[Request]) {
        self.master.cycle(host(self.now), frame).unwrap();
        self.write();
    }

    /// Runs a cycle to its end; returns its outcomes and its duration.
    pub fn cycle(&mut self, frame: &[Request]) -> (Vec<Outcome>, Duration) {
        let begin = self.now;
        self.begin(frame);
        while self.master.is_busy() {
            assert!(
                self.step(),
                "no further events, but the cycle is not complete"
            );
        }
        let outcomes = self.master.outcomes().to_vec();
        (outcomes, host(self.now).since(host(begin)))
    }

    /// Transfers one request.
    pub fn transfer(&mut self, request: &Request) -> Outcome {
        self.master.transfer(host(self.now), request).unwrap();
        self.write();
        while self.master.is_busy() {
            assert!(self.step(), "no further events");
        }
        self.master.outcomes()[0]
    }

    /// Advances by `duration`.
    pub fn wait(&mut self, duration: SimDuration) {
        let until = self.now + duration;
        while self.next_wake().is_some_and(|wake| wake <= until) {
            self.step();
        }
        self.now = until;
    }
}
