use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{Part, PlantAccess, TaskError};
use twinrig_wire::{Arrivals, Line, Piece, earlier};

use crate::controller::Controller;
use crate::controller_config::{ControllerConfig, ControllerCounters};
use crate::error::SbcpError;

/// Bus behind a bus controller. The near end is the link to the host; the far end is the near end
/// of the bus.
pub struct ControlledBus<L> {
    name: String,
    controller: Controller,
    bus: L,
    now: SimTime,
    /// Bytes just received from the bus.
    received: Arrivals,
}

#[derive(Serialize, Deserialize)]
struct Saved {
    controller: Controller,
    bus: Snapshot,
    now: SimTime,
}

/// Names of the controller's diagnostics.
const DIAGNOSTICS: [&str; 6] = [
    "requests",
    "answers",
    "failures",
    "timeouts",
    "overflows",
    "framing_errors",
];

impl<L: Line> ControlledBus<L> {
    /// Puts a controller in front of `bus`. `name` is that of the bus; the diagnostics are
    /// `NAME/controller/requests`, `answers`, `failures`, `timeouts`, `overflows` and
    /// `framing_errors`.
    ///
    /// # Errors
    /// [`SbcpError`] if the configuration is invalid.
    pub fn new(name: &str, config: ControllerConfig, bus: L) -> Result<Self, SbcpError> {
        Ok(Self {
            name: name.to_owned(),
            controller: Controller::new(config)?,
            bus,
            now: SimTime::ZERO,
            received: Arrivals::default(),
        })
    }

    /// Returns the counters of the controller.
    pub fn counters(&self) -> ControllerCounters {
        self.controller.counters()
    }

    /// Returns the bus behind the controller.
    pub fn bus(&self) -> &L {
        &self.bus
    }
}

impl<L: Line> Part for ControlledBus<L> {
    fn inner(&self) -> Option<&dyn Part> {
        Some(&self.bus)
    }

    fn inner_mut(&mut self) -> Option<&mut dyn Part> {
        Some(&mut self.bus)
    }

    fn diagnostics(&self) -> Vec<Port> {
        let ports = DIAGNOSTICS.iter().map(|diagnostic| {
            Port::output(
                format!("{}/controller/{diagnostic}", self.name),
                Unit::One,
                1,
            )
        });
        ports.chain(self.bus.diagnostics()).collect()
    }

    fn read_diagnostics(&self, now: SimTime, values: &mut [f64]) {
        let counters = self.controller.counters();
        let counts = [
            counters.requests,
            counters.answers,
            counters.failures,
            counters.timeouts,
            counters.overflows,
            counters.framing_errors,
        ];
        let (values, bus) = values.split_at_mut(DIAGNOSTICS.len());
        for (value, count) in values.iter_mut().zip(counts) {
            *value = count as f64;
        }
        self.bus.read_diagnostics(now, bus);
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&Saved {
            controller: self.controller.clone(),
            bus: self.bus.save(),
            now: self.now,
        })
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let saved: Saved = snapshot.read()?;
        self.bus.restore(&saved.bus)?;
        self.controller = saved.controller;
        self.now = saved.now;
        Ok(())
    }
}

impl<L: Line> Line for ControlledBus<L> {
    fn send(&mut self, piece: Piece<'_>) {
        self.controller.handle_link(self.now, piece);
    }

    fn next_wake(&self) -> Option<SimTime> {
        let controller = &self.controller;
        let reception = earlier(controller.poll_timeout(), controller.expects(self.now));
        let wake = earlier(reception, controller.bus_start());
        earlier(self.bus.next_wake(), wake)
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        self.now = now;
        loop {
            self.bus.advance(now, plant)?;
            self.received.clear();
            self.bus.receive(&mut self.received);
            for piece in self.received.pieces() {
                self.controller.handle_bus(now, piece);
            }
            // A byte that is complete at the deadline is in time, so the bus is processed first.
            if self.controller.poll_timeout().is_some_and(|at| at <= now) {
                self.controller.handle_timeout(now);
            }
            let bus = &mut self.bus;
            let send = &mut |piece: Piece<'_>| bus.send(piece);
            while self.controller.poll_bus(now, send) {}
            if self.bus.next_wake().is_none_or(|wake| wake > now) {
                return Ok(());
            }
        }
    }

    fn receive(&mut self, arrivals: &mut Arrivals) {
        self.controller.poll_link(arrivals);
    }
}
