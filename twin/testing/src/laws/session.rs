use twinrig_kernel::{Direction, HostTime, Layout, SimDuration, SimTime, Snapshot};
use twinrig_runtime::{Driver, PlantSignals, Wire};

use super::cable::Cable;
use super::case::Damage;
use super::log::{Log, Transfer};
use super::probe::{Probe, Tap};
use super::stairs::Stairs;
use super::turns::Turns;
use super::{DeviceSetup, Violation};

/// Periods of a session before the bytes are damaged.
pub(super) const CLEAN: usize = 2;

/// Calls of a driver at one instant, beyond which it does not end.
const CALLS_MAX: u32 = 1000;

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
            plant: Stairs::new(&signals, setup.levels, setup.period),
            to_driver,
            to_devices,
            now,
            phase: Phase::Idle,
            since: now,
            origin: now,
            next_slot: 0,
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

    /// Ends the phase if the driver is done, and begins the next one if it is due.
    fn update_phase(&mut self) -> Result<(), Violation> {
        loop {
            match self.phase {
                Phase::Ended => return Ok(()),
                Phase::Idle if self.now < self.slot_start() => return Ok(()),
                Phase::Idle => {
                    self.begin_slot();
                    self.write();
                }
                _ => match self.driver.is_busy() {
                    Ok(true) => return self.check_deadline(),
                    Ok(false) => self.end_phase(),
                    Err(error) => {
                        self.log.ended = Some((self.now, Err(error.why)));
                        self.phase = Phase::Ended;
                    }
                },
            }
        }
    }

    /// Returns the time within which the phase ends.
    fn deadline(&self) -> SimDuration {
        match self.phase {
            Phase::Transfer(_) => self.setup.transfer_deadline,
            _ => self.setup.deadline,
        }
    }

    fn check_deadline(&self) -> Result<(), Violation> {
        let limit = self.deadline();
        if self.now <= self.since + limit {
            return Ok(());
        }
        let phase = self.phase;
        Err(self.violation(format!("{phase:?} has not ended within {limit}")))
    }

    fn end_phase(&mut self) {
        let values = self.driver.to_process().to_vec();
        let traffic = (self.setup.traffic)(&self.driver, host(self.now));
        match self.phase {
            Phase::Opening => {
                self.origin = self.now;
                self.log.first_values.push((self.now, values));
                self.log.opened = Some((self.to_driver.entered, traffic));
                self.phase = Phase::Idle;
            }
            Phase::Transfer(slot) => {
                self.log.transfers.push(Transfer {
                    slot,
                    at: self.now,
                    values,
                    diagnostics: self.diagnostics(),
                    traffic,
                    received: self.to_driver.entered,
                });
                let period = self.setup.period.as_nanos().max(1);
                let elapsed = (self.now - self.origin).as_nanos();
                let soonest = usize::try_from(elapsed.div_ceil(period)).unwrap_or(usize::MAX);
                self.next_slot = soonest.max(slot + 1);
                self.phase = Phase::Idle;
            }
            Phase::Closing => {
                self.log.ended = Some((self.now, Ok(())));
                self.phase = Phase::Ended;
            }
            Phase::Idle | Phase::Ended => {}
        }
    }

    /// Begins the transfer of the present slot, or closing after the last one.
    fn begin_slot(&mut self) {
        self.since = self.now;
        let now = host(self.now);
        if self.next_slot >= self.course.slots {
            self.phase = Phase::Closing;
            return self.driver.close(now);
        }
        self.phase = Phase::Transfer(self.next_slot);
        let inputs = Layout::of(&self.driver.ports(), Direction::Input).len();
        let commands = (0..inputs).map(|n| (self.setup.commands)(self.next_slot, n));
        self.driver.begin(now, &commands.collect::<Vec<_>>());
    }

    fn diagnostics(&self) -> Vec<f64> {
        let ports = self.driver.diagnostics();
        let mut values = vec![0.0; Layout::of(&ports, Direction::Output).len()];
        self.driver.read_diagnostics(&mut values);
        values
    }

    /// Calls everything that must not change anything.
    fn look(&mut self) {
        let Some(looks) = &mut self.course.looks else {
            return;
        };
        while self.look.is_some_and(|at| at <= self.now) {
            self.look = Some(self.look.unwrap_or(self.now) + SimDuration::from_nanos(looks.next()));
        }
        let driver = &mut self.driver;
        let due = |driver: &D| driver.poll_timeout().is_some_and(|at| at <= host(self.now));
        if !due(driver) {
            driver.handle_timeout(host(self.now));
            driver.handle_bytes(host(self.now), &[]);
        }
        let _ = (driver.is_busy(), driver.to_process(), driver.save());
        let _ = (self.wire.next_wake(), self.wire.save(), self.diagnostics());
        self.write();
    }
}

/// Returns the frame of a number, foreign ones and, if answers are numbered, the last ones, if a
/// transmission begins with the byte `before`.
fn inserted_frame<D>(
    setup: &DeviceSetup<D>,
    tap: &Tap,
    number: u8,
    before: u64,
) -> Option<Vec<u8>> {
    let transmissions = tap.transmissions();
    let mut start = 0;
    let begun = transmissions.iter().take_while(|transmission| {
        let is_begun = start <= before;
        start += transmission.bytes.len() as u64;
        is_begun
    });
    let begun: Vec<_> = begun.map(|it| &it.bytes).collect();
    let before_last = begun.iter().rev().skip(1).map(|bytes| bytes.len() as u64);
    if before_last.sum::<u64>() != before {
        return None;
    }
    let last = begun.into_iter().rev();
    let last: Vec<_> = last
        .take(if setup.numbers_answers { 4 } else { 0 })
        .collect();
    let foreign: Vec<_> = setup.foreign.iter().collect();
    // One half of each, if there are both.
    let is_foreign = last.is_empty() || (!foreign.is_empty() && number.is_multiple_of(2));
    let all = if is_foreign { foreign } else { last };
    let chosen = usize::from(number / 2).checked_rem(all.len())?;
    Some(all[chosen].clone())
}
