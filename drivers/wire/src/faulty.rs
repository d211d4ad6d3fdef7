use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{
    BusHealth, DriverPhase, Part, PlantAccess, PlantSignals, TaskError, TransmitBuffer, WiringError,
};

use crate::channel::Channel;
use crate::distortion::Distortion;
use crate::{Arrivals, FaultSchedule, FrameReader, Line, Piece, WireError};

/// Line with faults in both directions, where any are declared; without them it costs nothing.
pub struct Faulty<L> {
    on: String,
    line: L,
    faults: Option<Box<Faults>>,
}

/// Faults of both directions, and what they hold back.
struct Faults {
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
        Self::framed(on, byte_time, schedule, None, line)
    }

    /// As [`Faulty::new`], with the frames on the line, in either direction. Without them a burst
    /// counts as a frame, and messages have no kinds.
    ///
    /// # Errors
    /// As [`Faulty::new`].
    pub fn framed(
        on: &str,
        byte_time: SimDuration,
        schedule: &FaultSchedule,
        frames: Option<FrameReader>,
        line: L,
    ) -> Result<Self, WireError> {
        let distortion = |channel| Distortion::new(on, channel, byte_time, schedule, frames);
        let mut faults = Faults {
            outward: distortion(Channel::LINE_OUT)?,
            inward: distortion(Channel::LINE_IN)?,
            arrived: Arrivals::default(),
            now: SimTime::ZERO,
            wake: None,
        };
        faults.update_wake(&line);
        let declared = schedule.faults.iter().any(|fault| fault.on == on);
        Ok(Self {
            on: on.to_owned(),
            line,
            faults: declared.then(|| Box::new(faults)),
        })
    }
}

impl Faults {
    fn update_wake(&mut self, line: &impl Line) {
        let events = [
            self.outward.failure(),
            self.inward.failure(),
            self.outward.next_event(),
            self.inward.next_event(),
            self.inward.next_byte(),
            line.next_wake(),
        ];
        self.wake = events.into_iter().flatten().min();
    }

    fn forward(&mut self, line: &mut impl Line) {
        self.outward.take_all(|piece| line.send(piece));
    }

    fn process_instant(
        &mut self,
        on: &str,
        line: &mut impl Line,
        now: SimTime,
        plant: &mut dyn PlantAccess,
    ) -> Result<(), TaskError> {
        let failures = [self.outward.failure(), self.inward.failure()];
        if failures.into_iter().flatten().any(|at| at <= now) {
            let why = format!("{on} is unplugged");
            return Err(TaskError::Device { why });
        }
        self.outward.process_until(now);
        self.forward(line);
        line.advance(now, plant)?;
        line.receive(&mut self.arrived);
        for piece in self.arrived.pieces() {
            self.inward.pass(piece);
        }
        self.arrived.clear();
        self.inward.process_until(now);
        self.now = now;
        self.update_wake(line);
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
        if let Some(faults) = &mut self.faults {
            faults.update_wake(&self.line);
        }
        Ok(())
    }

    fn begin_phase(&mut self, now: SimTime, phase: DriverPhase) {
        if let Some(faults) = &mut self.faults {
            faults.outward.selection.begin_phase(now, phase);
            faults.inward.selection.begin_phase(now, phase);
        }
        self.line.begin_phase(now, phase);
    }

    fn report_health(&self, health: &mut BusHealth) {
        if let Some(faults) = &self.faults {
            faults.outward.report_effects(health);
            faults.inward.report_effects(health);
        }
        self.line.report_health(health);
    }

    fn diagnostics(&self) -> Vec<Port> {
        let harmed = Port::output(format!("{}/harmed", self.on), Unit::One, 1);
        std::iter::once(harmed)
            .chain(self.line.diagnostics())
            .collect()
    }

    fn read_diagnostics(&self, now: SimTime, values: &mut [f64]) {
        if let Some((harmed, line)) = values.split_first_mut() {
            let faults = self.faults.iter();
            let bytes = faults.map(|faults| faults.outward.harmed() + faults.inward.harmed());
            *harmed = bytes.sum::<u64>() as f64;
            self.line.read_diagnostics(now, line);
        }
    }

    fn save(&self) -> Snapshot {
        let faults = self.faults.as_ref();
        let faults = faults.map(|faults| (faults.now, faults.outward.save(), faults.inward.save()));
        Snapshot::of(&(faults, self.line.save()))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        type Saved = (Option<(SimTime, Snapshot, Snapshot)>, Snapshot);
        let (saved, line): Saved = snapshot.read()?;
        self.line.restore(&line)?;
        match (&mut self.faults, saved) {
            (Some(faults), Some((now, outward, inward))) => {
                faults.outward.restore(&outward)?;
                faults.inward.restore(&inward)?;
                faults.now = now;
                faults.update_wake(&self.line);
                Ok(())
            }
            (None, None) => Ok(()),
            (own, _) => {
                let [with, without] = ["with faults", "without faults"];
                let (expected, found) = match own {
                    Some(_) => (with, without),
                    None => (without, with),
                };
                Err(SnapshotError::Mismatch {
                    expected: format!("{} {expected}", self.on),
                    found: found.to_owned(),
                })
            }
        }
    }
}

impl<L: Line> Line for Faulty<L> {
    fn send(&mut self, piece: Piece<'_>) {
        let Some(faults) = &mut self.faults else {
            return self.line.send(piece);
        };
        faults.outward.pass(piece);
        faults.inward.accept_messages(&mut faults.outward);
        faults.forward(&mut self.line);
        faults.update_wake(&self.line);
    }

    fn transmit_buffer(&self) -> Option<TransmitBuffer> {
        self.line.transmit_buffer()
    }

    fn next_wake(&self) -> Option<SimTime> {
        match &self.faults {
            Some(faults) => faults.wake,
            None => self.line.next_wake(),
        }
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        let Some(faults) = &mut self.faults else {
            return self.line.advance(now, plant);
        };
        while let Some(wake) = faults.wake.filter(|wake| *wake < now) {
            faults.process_instant(&self.on, &mut self.line, wake, plant)?;
        }
        faults.process_instant(&self.on, &mut self.line, now, plant)
    }

    fn receive(&mut self, arrivals: &mut Arrivals) {
        let Some(faults) = &mut self.faults else {
            return self.line.receive(arrivals);
        };
        faults
            .inward
            .take(faults.now, |piece| arrivals.push_piece(piece));
        faults.update_wake(&self.line);
    }
}
