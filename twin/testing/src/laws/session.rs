use twinrig_kernel::{HostTime, SimDuration, SimTime, Snapshot};
use twinrig_runtime::{Driver, PlantSignals, Wire};

use super::cable::Cable;
use super::damage::Damage;
use super::inserted_frame::inserted_frame;
use super::log::Log;
use super::probe::{Probe, Tap};
use super::stairs::Stairs;
use super::turns::Turns;
use super::{DeviceSetup, Violation};

mod phases;

/// Periods of a session before the bytes are damaged.
pub(super) const CLEAN: usize = 2;

/// Calls of a driver at one instant, beyond which it does not end.
const CALLS_MAX: u32 = 1000;

/// Looks from one save to the next, which takes longer than all else.
const LOOKS_PER_SAVE: u32 = 8;

/// How a session deviates from that of intact bytes in their own pieces.
#[derive(Clone, Debug, Default)]
pub(super) struct Course {
    /// Number of periods with transfers.
    pub(super) slots: usize,
    /// Damage to the bytes on their way to the driver, and to the devices.
    pub(super) damages: [Vec<Damage>; 2],
    /// Bytes are damaged in these periods.
    pub(super) damaged_slots: std::ops::Range<usize>,
    /// Lengths of the pieces into which streams are cut \[bytes\].
    pub(super) pieces: Option<Turns>,
    /// Times between looks \[ns\].
    pub(super) looks: Option<Turns>,
    /// Instants at which the host reads; None if that is whenever the wire has bytes, which may
    /// depend on pieces and looks.
    pub(super) reads: Option<Vec<SimTime>>,
    /// The host reads a transmission as a whole, some bytes behind its end.
    pub(super) gathers: bool,
}

/// A driver, its devices and a plant, from the opening over transfers to the end of closing.
pub(super) struct Session<'s, D> {
    setup: &'s DeviceSetup<D>,
    law: &'static str,
    course: Course,
    pub(super) driver: D,
    wire: Box<dyn Wire>,
    pub(super) tap: Tap,
    plant: Stairs,
    pub(super) to_driver: Cable,
    to_devices: Cable,
    pub(super) now: SimTime,
    phase: Phase,
    /// Beginning of the phase.
    since: SimTime,
    /// Time of slot 0.
    origin: SimTime,
    next_slot: usize,
    look: Option<SimTime>,
    /// Number of looks so far.
    looks: u32,
    /// Bytes of the wire that the host has not read.
    held: Vec<u8>,
    /// Time at which it reads them unless there are more than these by then.
    gathered: Option<(SimTime, usize)>,
    /// Number of calls at the present instant.
    calls: u32,
    pub(super) log: Log,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Opening,
    Transfer(usize),
    Idle,
    Closing,
    Ended,
}

/// Returns the time of the driver's clock.
pub(super) fn host(now: SimTime) -> HostTime {
    HostTime::from_nanos(now.as_nanos())
}

impl<'s, D: Driver> Session<'s, D> {
    /// Makes driver and devices, and connects them.
    ///
    /// # Panics
    /// If the plant lacks a port that the devices require.
    pub(super) fn new(setup: &'s DeviceSetup<D>, law: &'static str, course: Course) -> Self {
        let tap = Tap::default();
        let nodes = (setup.nodes)().into_iter().map(|node| {
            let (pieces, looks) = (course.pieces.clone(), course.looks.clone());
            Box::new(Probe::new(node, tap.clone(), pieces, looks)) as _
        });
        let mut wire = (setup.wire)(nodes.collect());
        let signals = PlantSignals::of(&setup.ports);
        wire.connect("laws", &signals)
            .unwrap_or_else(|error| panic!("the plant of the setup: {error}"));
        let [to_driver, to_devices] = course
            .damages
            .clone()
            .map(|damages| Cable::new(damages, (setup.spacing, setup.period)));
        let now = SimTime::ZERO + SimDuration::from_millis(1);
        Self {
            look: course.looks.is_some().then_some(now),
            driver: (setup.driver)(),
            wire,
            tap,
            plant: Stairs::new(&signals, &setup.levels, setup.period),
            to_driver,
            to_devices,
            now,
            phase: Phase::Idle,
            since: now,
            origin: now,
            next_slot: 0,
            looks: 0,
            held: Vec::new(),
            gathered: None,
            calls: 0,
            log: Log::default(),
            setup,
            law,
            course,
        }
    }

    /// Makes a session and opens the driver.
    pub(super) fn open(setup: &'s DeviceSetup<D>, law: &'static str, course: Course) -> Self {
        let mut session = Self::new(setup, law, course);
        let values = session.driver.to_process().to_vec();
        session.log.first_values.push((session.now, values));
        session.phase = Phase::Opening;
        session.driver.open(host(session.now));
        session.write();
        session
    }

    /// Returns a copy of this session with another driver and other devices, restored from the
    /// saved states of these.
    ///
    /// # Errors
    /// [`Violation`] if a snapshot is refused.
    pub(super) fn restored(&self) -> Result<Self, Violation> {
        let mut copy = Self::new(self.setup, self.law, self.course.clone());
        let driver: Snapshot = self.driver.save();
        let refused = |part, error| self.violation(format!("{part} refuses its snapshot: {error}"));
        copy.driver
            .restore(&driver)
            .map_err(|error| refused("the driver", error))?;
        let wire = copy.wire.restore(&self.wire.save());
        wire.map_err(|error| refused("the wire with the devices", error))?;
        copy.tap.copy_from(&self.tap);
        copy.plant = self.plant.clone();
        copy.to_driver = self.to_driver.clone();
        copy.to_devices = self.to_devices.clone();
        (copy.now, copy.phase, copy.since) = (self.now, self.phase, self.since);
        (copy.origin, copy.next_slot) = (self.origin, self.next_slot);
        (copy.look, copy.calls) = (self.look, self.calls);
        copy.held.clone_from(&self.held);
        copy.gathered = self.gathered;
        copy.log.clone_from(&self.log);
        Ok(copy)
    }

    pub(super) fn violation(&self, what: impl Into<String>) -> Violation {
        Violation::new(self.law, self.now, what)
    }

    /// Runs to the end.
    ///
    /// # Errors
    /// [`Violation`] if the driver does not end a phase within the deadline, or a part fails.
    pub(super) fn finish(mut self) -> Result<Self, Violation> {
        self.run_until(SimTime::MAX)?;
        Ok(self)
    }

    /// Runs to an instant, events of this instant included, or to the end.
    ///
    /// # Errors
    /// As [`Session::finish`].
    pub(super) fn run_until(&mut self, until: SimTime) -> Result<(), Violation> {
        while self.phase != Phase::Ended {
            let next = self.next_event().max(self.now);
            if next > until {
                self.calls = 0;
                self.now = until;
                return self.step();
            }
            self.calls = if next > self.now { 0 } else { self.calls + 1 };
            self.now = next;
            if self.calls > CALLS_MAX {
                let what = format!("{CALLS_MAX} wake-ups at one instant, and no end");
                return Err(self.violation(what));
            }
            self.step()?;
        }
        Ok(())
    }

    fn next_event(&self) -> SimTime {
        let timeout = self.driver.poll_timeout();
        let events = [
            self.wire.next_wake(),
            timeout.map(|at| SimTime::from_nanos(at.as_nanos())),
            self.to_driver.next(),
            self.to_devices.next(),
            (self.phase == Phase::Idle).then(|| self.slot_start()),
            self.look,
            self.next_read(),
            self.gathered.map(|(at, _)| at),
        ];
        let limit = match self.phase {
            Phase::Idle => SimTime::MAX,
            _ => self.since + self.deadline() + SimDuration::from_nanos(1),
        };
        events
            .into_iter()
            .flatten()
            .min()
            .map_or(limit, |at| at.min(limit))
    }

    /// Returns the next prescribed instant at which the host reads.
    fn next_read(&self) -> Option<SimTime> {
        let reads = self.course.reads.as_ref()?;
        let passed = reads.partition_point(|at| *at <= self.now);
        reads.get(passed).copied()
    }

    fn slot_start(&self) -> SimTime {
        self.origin + self.setup.period * self.next_slot as u64
    }

    /// Handles everything that is due now.
    fn step(&mut self) -> Result<(), Violation> {
        self.plant.now = self.now;
        let before = self.plant.inputs.clone();
        let advanced = self.wire.advance(self.now, &mut self.plant);
        advanced.map_err(|error| self.violation(error.to_string()))?;
        let same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits();
        if !before.iter().zip(&self.plant.inputs).all(same) {
            let inputs = self.plant.inputs.clone();
            self.log.actuated.push((self.now, inputs));
        }
        self.wire.receive(&mut self.held);
        self.damage();
        if !self.held.is_empty() && self.reads_now() {
            self.log.reads.push(self.now);
            let held = std::mem::take(&mut self.held);
            let (setup, tap) = (self.setup, &self.tap);
            let frame = |number, before| inserted_frame(setup, tap, number, before);
            self.to_driver.pass(self.now, &held, frame);
        }
        self.deliver();
        if self
            .driver
            .poll_timeout()
            .is_some_and(|at| at <= host(self.now))
        {
            self.driver.handle_timeout(host(self.now));
        }
        self.write();
        self.update_phase()?;
        self.look();
        Ok(())
    }

    /// Begins or ends the damage.
    fn damage(&mut self) {
        let slots = &self.course.damaged_slots;
        let is_damaged = match self.phase {
            Phase::Opening => slots.start == 0,
            Phase::Closing => self.course.slots < slots.end,
            Phase::Transfer(slot) => slots.contains(&slot),
            Phase::Idle | Phase::Ended => slots.contains(&self.next_slot.saturating_sub(1)),
        };
        self.to_driver.is_damaged = is_damaged;
        self.to_devices.is_damaged = is_damaged;
    }

    /// Returns whether the host reads the bytes of the wire at this instant.
    fn reads_now(&mut self) -> bool {
        if self.course.gathers {
            let count = self.held.len();
            match self.gathered {
                Some((at, _)) if self.now < at => {}
                Some((_, before)) if count == before => self.gathered = None,
                _ => self.gathered = Some((self.now + self.setup.byte_time * 3, count)),
            }
            return self.gathered.is_none();
        }
        let reads = self.course.reads.as_ref();
        reads.is_none_or(|reads| reads.binary_search(&self.now).is_ok())
    }

    fn deliver(&mut self) {
        let mut bytes = Vec::new();
        self.to_driver.take(self.now, &mut bytes);
        let mut rest = &bytes[..];
        while !rest.is_empty() {
            let pieces = self.course.pieces.as_mut();
            let length = pieces.map_or(rest.len(), Turns::next_usize);
            let (piece, after) = rest.split_at(length.min(rest.len()));
            rest = after;
            self.driver.handle_bytes(host(self.now), piece);
        }
    }

    /// Passes the bytes that the driver writes to the wire.
    fn write(&mut self) {
        let mut bytes = Vec::new();
        for _ in 0..CALLS_MAX {
            bytes.clear();
            if !self.driver.poll_transmit(&mut bytes) {
                break;
            }
            match self.log.written.last_mut() {
                Some((at, earlier)) if *at == self.now => earlier.extend(&bytes),
                _ => self.log.written.push((self.now, bytes.clone())),
            }
            self.to_devices.pass(self.now, &bytes, |_, _| None);
        }
        bytes.clear();
        self.to_devices.take(self.now, &mut bytes);
        if !bytes.is_empty() {
            self.wire.send(self.now, &bytes);
        }
    }

    /// Calls everything that must not change anything.
    fn look(&mut self) {
        let Some(turns) = &mut self.course.looks else {
            return;
        };
        while let Some(at) = self.look.filter(|at| *at <= self.now) {
            self.look = Some(at + SimDuration::from_nanos(turns.next()));
            self.looks += 1;
        }
        let now = host(self.now);
        if self.driver.poll_timeout().is_none_or(|at| at > now) {
            self.driver.handle_timeout(now);
            self.driver.handle_bytes(now, &[]);
        }
        let _ = (
            self.driver.is_busy(),
            self.driver.to_process(),
            self.diagnostics(),
        );
        if self.looks.is_multiple_of(LOOKS_PER_SAVE) {
            let _ = (self.driver.save(), self.wire.save());
        }
        self.write();
    }
}
