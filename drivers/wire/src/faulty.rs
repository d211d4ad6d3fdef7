use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{PlantAccess, PlantSignals, TaskError, TransmitBuffer, WiringError};

use crate::distortion::Distortion;
use crate::{Arrivals, FaultSchedule, Line, Piece, WireError};

/// A line with faults, in both directions.
pub struct Faulty<L> {
    on: String,
    line: L,
    outward: Distortion,
    inward: Distortion,
    /// What has just come from the line.
    arrived: Arrivals,
    now: SimTime,
    /// When anything happens next: follows from the rest.
    wake: Option<SimTime>,
}

impl<L: Line> Faulty<L> {
    /// `line` with those faults of the schedule that are `on` it. A byte takes `byte_time` on it. Its gauge, bytes that did not
    /// pass as they were, is `ON/harmed`.
    ///
    /// # Errors
    /// [`WireError`] if a fault cannot be, or `byte_time` is zero.
    pub fn new(
        on: &str,
        byte_time: SimDuration,
        schedule: &FaultSchedule,
        line: L,
    ) -> Result<Self, WireError> {
        let mut faulty = Self {
            on: on.to_owned(),
            line,
            outward: Distortion::new(on, "out", true, byte_time, schedule)?,
            inward: Distortion::new(on, "in", true, byte_time, schedule)?,
            arrived: Arrivals::default(),
            now: SimTime::ZERO,
            wake: None,
        };
        faulty.look_ahead();
        Ok(faulty)
    }

    fn look_ahead(&mut self) {
        let own = [
            self.outward.failure(),
            self.outward.next_event(),
            self.inward.next_event(),
            self.inward.next_byte(),
            self.line.next_wake(),
        ];
        self.wake = own.into_iter().flatten().min();
    }

    fn hand_on(&mut self) {
        let line = &mut self.line;
        self.outward.take_all(|piece| line.send(piece));
    }

    fn instant(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        if self.outward.failure().is_some_and(|at| at <= now) {
            let why = format!("{} is unplugged", self.on);
            return Err(TaskError::Device { why });
        }
        self.outward.settle(now);
        self.hand_on();
        self.line.advance(now, plant)?;
        self.line.receive(&mut self.arrived);
        for piece in self.arrived.pieces() {
            self.inward.pass(piece);
        }
        self.arrived.clear();
        self.inward.settle(now);
        self.now = now;
        self.look_ahead();
        Ok(())
    }
}

impl<L: Line> Line for Faulty<L> {
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.line.connect(owner, plant)?;
        self.look_ahead();
        Ok(())
    }

    fn send(&mut self, piece: Piece<'_>) {
        self.outward.pass(piece);
        self.hand_on();
        self.look_ahead();
    }

    fn transmit_buffer(&self) -> Option<TransmitBuffer> {
        self.line.transmit_buffer()
    }

    fn next_wake(&self) -> Option<SimTime> {
        self.wake
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        while let Some(wake) = self.wake.filter(|wake| *wake < now) {
            self.instant(wake, plant)?;
        }
        self.instant(now, plant)
    }

    fn receive(&mut self, arrivals: &mut Arrivals) {
        self.inward
            .take(self.now, |piece| arrivals.push_piece(piece));
        self.look_ahead();
    }

    fn diagnostics(&self) -> Vec<Port> {
        let own = Port::output(format!("{}/harmed", self.on), Unit::One, 1);
        std::iter::once(own)
            .chain(self.line.diagnostics())
            .collect()
    }

    fn read_diagnostics(&self, now: SimTime, values: &mut [f64]) {
        if let Some((own, line)) = values.split_first_mut() {
            *own = (self.outward.harmed() + self.inward.harmed()) as f64;
            self.line.read_diagnostics(now, line);
        }
    }

    fn traces(&self) -> Vec<String> {
        self.line.traces()
    }

    fn drain_traffic(&mut self, passed: &mut dyn FnMut(usize, &[u8])) {
        self.line.drain_traffic(passed);
    }

    fn save(&self) -> Snapshot {
        let (outward, inward) = (self.outward.save(), self.inward.save());
        Snapshot::of(&(self.now, outward, inward, self.line.save()))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (now, outward, inward, line): (_, Snapshot, Snapshot, Snapshot) = snapshot.read()?;
        self.outward.restore(&outward)?;
        self.inward.restore(&inward)?;
        self.line.restore(&line)?;
        self.now = now;
        self.look_ahead();
        Ok(())
    }
}
