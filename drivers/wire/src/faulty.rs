use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{Part, PlantAccess, PlantSignals, TaskError, TransmitBuffer, WiringError};

use crate::distortion::Distortion;
use crate::{Arrivals, FaultSchedule, Line, Piece, WireError};

/// Line with faults in both directions.
pub struct Faulty<L> {
    on: String,
    line: L,
    outward: Distortion,
    inward: Distortion,
    /// Bytes just received from the line.
    arrived: Arrivals,
    now: SimTime,
    /// Time of the next event; derived from the other fields.
    wake: Option<SimTime>,
}

impl<L: Line> Faulty<L> {
    /// Applies the faults of the schedule that are `on` this place to `line`, on which a byte takes
    /// `byte_time`. Diagnostic: `ON/harmed`, the number of bytes that were altered, delayed, lost
    /// or added.
    ///
    /// # Errors
    /// [`WireError`] if a fault is invalid or `byte_time` is zero.
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
        faulty.update_wake();
        Ok(faulty)
    }

    fn update_wake(&mut self) {
        let events = [
            self.outward.failure(),
            self.outward.next_event(),
            self.inward.next_event(),
            self.inward.next_byte(),
            self.line.next_wake(),
        ];
        self.wake = events.into_iter().flatten().min();
    }

    fn forward(&mut self) {
        let line = &mut self.line;
        self.outward.take_all(|piece| line.send(piece));
    }

    fn process_instant(
        &mut self,
        now: SimTime,
        plant: &mut dyn PlantAccess,
    ) -> Result<(), TaskError> {
        if self.outward.failure().is_some_and(|at| at <= now) {
            let why = format!("{} is unplugged", self.on);
            return Err(TaskError::Device { why });
        }
        self.outward.process_until(now);
        self.forward();
        self.line.advance(now, plant)?;
        self.line.receive(&mut self.arrived);
        for piece in self.arrived.pieces() {
            self.inward.pass(piece);
        }
        self.arrived.clear();
        self.inward.process_until(now);
        self.now = now;
        self.update_wake();
        Ok(())
    }
}

impl<L: Line> Part for Faulty<L> {
    fn inner(&self) -> Option<&dyn Part> {
        Some(&self.line)
    }

    fn inner_mut(&mut self) -> Option<&mut dyn Part> {
        Some(&mut self.line)
    }

    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.line.connect(owner, plant)?;
        self.update_wake();
        Ok(())
    }

    fn diagnostics(&self) -> Vec<Port> {
        let harmed = Port::output(format!("{}/harmed", self.on), Unit::One, 1);
        std::iter::once(harmed)
            .chain(self.line.diagnostics())
            .collect()
    }

    fn read_diagnostics(&self, now: SimTime, values: &mut [f64]) {
        if let Some((harmed, line)) = values.split_first_mut() {
            *harmed = (self.outward.harmed() + self.inward.harmed()) as f64;
            self.line.read_diagnostics(now, line);
        }
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
        self.update_wake();
        Ok(())
    }
}

impl<L: Line> Line for Faulty<L> {
    fn send(&mut self, piece: Piece<'_>) {
        self.outward.pass(piece);
        self.forward();
        self.update_wake();
    }

    fn transmit_buffer(&self) -> Option<TransmitBuffer> {
        self.line.transmit_buffer()
    }

    fn next_wake(&self) -> Option<SimTime> {
        self.wake
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        while let Some(wake) = self.wake.filter(|wake| *wake < now) {
            self.process_instant(wake, plant)?;
        }
        self.process_instant(now, plant)
    }

    fn receive(&mut self, arrivals: &mut Arrivals) {
        self.inward
            .take(self.now, |piece| arrivals.push_piece(piece));
        self.update_wake();
    }
}
