use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{Part, PlantAccess, PlantSignals, TaskError, WiringError};
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
    /// Whether packets are passed on in advance.
    with_packets: bool,
    /// Times of the next event of the controller, and of all; derived from the other fields.
    controller_wake: Option<SimTime>,
    wake: Option<SimTime>,
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
        let mut controlled = Self {
            name: name.to_owned(),
            controller: Controller::new(config)?,
            bus,
            now: SimTime::ZERO,
            received: Arrivals::default(),
            with_packets: false,
            controller_wake: None,
            wake: None,
        };
        controlled.update_wake();
        Ok(controlled)
    }

    /// Passes requests to the bus as soon as they are certain, and takes undisturbed answers as a
    /// whole ([`Line::take_packet`]). The results are the same; but what is between controller and
    /// bus receives requests before they begin.
    #[must_use]
    pub fn with_packets(self) -> Self {
        Self {
            with_packets: true,
            ..self
        }
    }

    /// Returns the counters of the controller at the last event.
    pub fn counters(&self) -> ControllerCounters {
        self.controller.counters_at(self.now)
    }

    /// Returns the bus behind the controller.
    pub fn bus(&self) -> &L {
        &self.bus
    }

    fn update_wake(&mut self) {
        let controller = &self.controller;
        let reception = earlier(controller.poll_timeout(), controller.expects(self.now));
        let link = controller.link_start().map(|start| start.max(self.now));
        let wake = earlier(reception, earlier(controller.bus_start(), link));
        self.controller_wake = wake;
        self.wake = earlier(self.bus.next_wake(), wake);
    }

    /// Passes bytes of the controller that are due to the bus, and complete requests in advance.
    fn transmit(&mut self) {
        let (controller, bus) = (&mut self.controller, &mut self.bus);
        if self.with_packets && bus.is_quiet() {
            while controller.poll_requests(&mut |piece| bus.send(piece)) {}
        }
        while controller.poll_bus(self.now, &mut |piece| bus.send(piece)) {}
    }
}

impl<L: Line> Part for ControlledBus<L> {
    fn inner(&self) -> Option<&dyn Part> {
        Some(&self.bus)
    }

    fn inner_mut(&mut self) -> Option<&mut dyn Part> {
        Some(&mut self.bus)
    }

    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.bus.connect(owner, plant)?;
        self.update_wake();
        Ok(())
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
        let counters = self.controller.counters_at(now);
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
        self.update_wake();
        Ok(())
    }
}

impl<L: Line> Line for ControlledBus<L> {
    fn send(&mut self, piece: Piece<'_>) {
        self.controller.handle_link(self.now, piece);
        self.transmit();
        self.update_wake();
    }

    fn next_wake(&self) -> Option<SimTime> {
        self.wake
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        self.now = now;
        loop {
            self.bus.advance(now, plant)?;
            let controller = &mut self.controller;
            self.received.clear();
            self.bus.receive(&mut self.received);
            for piece in self.received.pieces() {
                controller.handle_bus(now, piece);
            }
            let with_packets = self.with_packets;
            self.bus
                .take_packet(&mut |piece| with_packets && controller.receive_packet(now, piece));
            // A byte that is complete at the deadline is in time, so the bus is processed first.
            if controller.poll_timeout().is_some_and(|at| at <= now) {
                controller.handle_timeout(now);
            }
            self.transmit();
            if self.bus.next_wake().is_none_or(|wake| wake > now) {
                self.update_wake();
                return Ok(());
            }
        }
    }

    fn is_announced(&self) -> bool {
        self.with_packets && self.bus.is_announced()
    }

    fn run_ahead(
        &mut self,
        now: SimTime,
        before: SimTime,
        plant: &mut dyn PlantAccess,
    ) -> Result<SimTime, TaskError> {
        let before = self.controller_wake.map_or(before, |wake| wake.min(before));
        self.now = self.bus.run_ahead(now, before, plant)?;
        self.wake = earlier(self.bus.next_wake(), self.controller_wake);
        Ok(self.now)
    }

    fn receive(&mut self, arrivals: &mut Arrivals) {
        if self.controller.link_start().is_some() {
            self.controller.poll_link(arrivals);
            self.update_wake();
        }
    }
}
