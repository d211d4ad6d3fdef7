use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use twinrig_kernel::{Agenda, HostTime, Layout, PartId, SimDuration, SimTime};

use super::clock::Clock;
use super::driver_session::duration;
use super::monotonic_clock::MonotonicClock;
use super::observed_thread::{Outcome, observe_thread};
use super::observer_queue::ObserverQueueWriter;
use super::report::EndReason;
use super::serve_options::{Hold, ServeOptions, ServeReport, ServedWire};
use super::served_port::{ServedPort, read_ports};
use super::system::{self, raise_priority};
use crate::event_loop::{Event, EventLoop, rank};
use crate::schedule::EVENTS_MAX;
use crate::{Group, Observer, Plant, RigError, RunEvent, Wire};

/// Plant and emulated boards in real time, each wire with the device of its host: the master end of
/// a PTY. One nanosecond of virtual time is one of the machine's clock.
///
/// Wires, boards and plant run in the event loop of the lockstep rig ([`crate::Rig`]): all events
/// occur at their own instants and in order; only the bytes of the host arrive at arbitrary times.
/// Virtual time is never ahead of the clock. A twin that lags catches up, and its lag is reported;
/// no event is skipped or repeated.
///
/// A host is limited to the baud rate: reads from a device are limited to the room in the transmit
/// buffer of its wire ([`Wire::transmit_buffer`]). A writer without pauses therefore blocks, as at
/// a real converter, and memory is bounded. Bytes that a host writes one by one follow each other
/// on the wire without a pause if each is written before the transmitter has been idle for 200 µs;
/// for that time the twin stays behind the clock after a write.
pub struct Serve {
    /// Wires with their devices, plant and agenda.
    events: EventLoop<ServedPort>,
    /// Release of the plant from its start.
    release: PartId,
    process: Layout,
    options: ServeOptions,
    report: ServeReport,
}

/// Longest advance of a lagging twin between two reads of its devices.
const SLICE: SimDuration = SimDuration::from_millis(1);
/// Wait after the transmitter has become idle, for a host that writes byte by byte: the bytes must
/// follow each other on the wire without a pause, however the operating system preempts host or
/// twin. No answer is delayed by it if the USB path from board to host takes its usual two
/// microframes.
const BURST_GAP_MAX: SimDuration = SimDuration::from_micros(200);
/// Longest total wait per burst, so that a host without longer pauses does not stop the twin.
const BURST_MAX: SimDuration = SimDuration::from_millis(2);

impl Serve {
    /// Connects the wires to the plant.
    ///
    /// # Errors
    /// [`RigError::Wiring`] if the plant lacks a signal that the boards require,
    /// [`RigError::BadPeriod`] if the observation period is zero, [`RigError::NeedsLinux`] on
    /// other systems.
    pub fn new(
        options: ServeOptions,
        plant: Box<dyn Plant>,
        wires: Vec<ServedWire>,
    ) -> Result<Self, RigError> {
        system::check()?;
        let ports = wires.into_iter().map(|served| {
            let ServedWire { name, wire, device } = served;
            (name.clone(), ServedPort::new(name, wire, device))
        });
        let agenda = Agenda::new(EVENTS_MAX);
        let (mut events, release) =
            EventLoop::new(plant, ports.collect(), options.observe, agenda, |agenda| {
                agenda.register("release", rank::CONTROL_STEP)
            })?;
        events.arm_parts();
        if options.hold == Hold::Never {
            events.plant_host.release();
        }
        Ok(Self {
            events,
            release,
            process: Layout::default(),
            options,
            report: ServeReport::default(),
        })
    }

    /// Returns the layout of a group's values as passed to the observer. There is no process.
    pub fn layout(&self, group: Group) -> &Layout {
        match group {
            Group::Plant => &self.events.plant_host.signals.outputs,
            Group::Diagnostics => &self.events.diagnostics,
            Group::ProcessInputs | Group::ProcessOutputs => &self.process,
        }
    }

    /// Returns the names of the byte traces: `NAME/out` is written by the host, `NAME/in` read by
    /// it.
    pub fn traces(&self) -> &[String] {
        &self.events.traces
    }

    /// Serves until the duration has elapsed, `stop` is set, or the host hangs up. `observer` is
    /// called on the calling thread, and may block.
    ///
    /// A panic of the plant, of a wire or of `observer` is an error that names it.
    pub fn run<O: Observer>(
        self,
        observer: &mut O,
        stop: &AtomicBool,
    ) -> (Result<EndReason, RigError>, ServeReport) {
        let queue_bytes = self.options.queue_bytes;
        let run = |mut writer, stop: Arc<AtomicBool>| {
            raise_priority(self.options.priority);
            self.serve(&MonotonicClock::start(), &mut writer, &stop)
        };
        let ((ended, mut report), lost) =
            observe_thread("serving", queue_bytes, observer, stop, run);
        report.lost += lost;
        (ended, report)
    }

    fn serve(
        mut self,
        clock: &dyn Clock,
        observer_queue: &mut ObserverQueueWriter,
        stop: &AtomicBool,
    ) -> Outcome<ServeReport> {
        let start = clock.now();
        let ended = loop {
            match self.cycle(clock, start, observer_queue) {
                Ok(None) if stop.load(Ordering::Relaxed) => break Ok(EndReason::Stopped),
                Ok(None) => {}
                Ok(Some(ended)) => break Ok(ended),
                Err(error) => break Err(error),
            }
        };
        self.report.served = self.now() - SimTime::ZERO;
        self.report.unread = self.ports().map(|port| port.unread).sum();
        (ended, self.report)
    }

    fn now(&self) -> SimTime {
        self.events.now()
    }

    fn ports(&self) -> impl Iterator<Item = &ServedPort> {
        self.events.parts.iter().map(|slot| &slot.part)
    }

    /// Runs one cycle: catches up with the clock, writes the host's bytes to the wires, and waits
    /// for bytes until the next event.
    fn cycle<O: Observer>(
        &mut self,
        clock: &dyn Clock,
        start: HostTime,
        observer: &mut O,
    ) -> Result<Option<EndReason>, RigError> {
        let end = self
            .options
            .duration
            .map(|duration| SimTime::ZERO + duration);
        self.send_contiguous(wall_time(clock, start), observer)?;
        let wall = wall_time(clock, start);
        if self
            .ports()
            .any(|port| port.burst_wait_ended(self.now(), wall))
        {
            // Read after the clock: all bytes that the host had written by then are available,
            // however long this thread was preempted.
            self.read_ports(start, clock)?;
            self.send_contiguous(wall, observer)?;
        }
        let burst_wait = self.burst_wait(wall);
        let wall = end.map_or(wall, |end| wall.min(end)).max(self.now());
        let now = burst_wait.map_or(wall, |(idle, _)| idle.min(wall));
        // Intervals without events are skipped: a slice begins at the next event.
        let begin = self
            .events
            .agenda
            .next_time()
            .map_or(now, |at| at.max(self.now()));
        let now = now.min(begin + SLICE);
        if let Some(first) = self.events.agenda.next_time().filter(|first| *first <= now) {
            let lag = wall - first;
            self.report.lag.count(duration(lag));
            self.report.behind += u64::from(lag > self.options.behind);
        }
        self.catch_up(now, observer)?;
        self.send(wall, observer)?;
        if end.is_some_and(|end| self.now() >= end) {
            return Ok(Some(EndReason::Duration));
        }
        if self.options.until_hang_up && self.all_hung_up() {
            return Ok(Some(EndReason::HungUp));
        }
        // The stop flag is checked at least every 20 slices.
        let mut until = self.now() + SLICE * 20;
        until = self
            .events
            .agenda
            .next_time()
            .map_or(until, |at| at.min(until));
        if let Some((_, by)) = self.burst_wait(wall).filter(|(idle, _)| *idle < until) {
            until = until.max(by);
        }
        until = end.map_or(until, |end| end.min(until));
        let until = start + duration(until - SimTime::ZERO);
        self.read_ports(until, clock)?;
        Ok(None)
    }

    /// Waits for bytes until `until` at the latest, and reads them.
    fn read_ports(&mut self, until: HostTime, clock: &dyn Clock) -> Result<(), RigError> {
        let now = self.now();
        read_ports(&mut self.events.parts, now, until, clock)
    }

    /// Returns the earliest time at which the twin must wait for further bytes of a host, and the
    /// clock time at which the wait ends, given the clock time `wall`.
    fn burst_wait(&self, wall: SimTime) -> Option<(SimTime, SimTime)> {
        self.ports()
            .filter_map(|port| port.burst_wait(self.now(), wall))
            .min()
    }

    /// Returns whether all devices that the host had opened are closed. They may be closed at
    /// different times.
    fn all_hung_up(&self) -> bool {
        let mut used = self.ports().filter(|port| port.was_open).peekable();
        used.peek().is_some() && used.all(ServedPort::is_hung_up)
    }

    /// Handles all events up to and at `now`, each at its own instant.
    fn catch_up<O: Observer>(&mut self, now: SimTime, observer: &mut O) -> Result<(), RigError> {
        while let Some(event) = self.events.step(now, observer)? {
            if let Event::Own(_) = event {
                self.release_plant(observer);
            }
        }
        self.events.advance_to(now);
        Ok(())
    }

    fn release_plant<O: Observer>(&mut self, observer: &mut O) {
        if self.events.plant_host.is_held() {
            self.events.plant_host.release();
            observer.event(self.now(), RunEvent::Opened);
        }
    }

    /// Writes the bytes read while the transmitter was busy, or just idle, to the wires: without a
    /// pause after the earlier ones.
    fn send_contiguous<O: Observer>(
        &mut self,
        wall: SimTime,
        observer: &mut O,
    ) -> Result<(), RigError> {
        let now = self.now();
        for n in 0..self.events.parts.len() {
            let port = &self.events.parts[n].part;
            if !port.pending.is_empty() && port.idle_from().is_some_and(|idle| now <= idle) {
                self.write_wire(n, |wire, bytes| wire.send_contiguous(now, bytes), observer)?;
                let port = &mut self.events.parts[n].part;
                port.extend_burst_wait(now, wall, BURST_GAP_MAX);
            }
        }
        Ok(())
    }

    /// Writes the bytes read to the wires.
    fn send<O: Observer>(&mut self, wall: SimTime, observer: &mut O) -> Result<(), RigError> {
        let now = self.now();
        for n in 0..self.events.parts.len() {
            if !self.events.parts[n].part.pending.is_empty() {
                self.write_wire(n, |wire, bytes| wire.send(now, bytes), observer)?;
                let port = &mut self.events.parts[n].part;
                port.burst_limit = wall + BURST_MAX;
                port.extend_burst_wait(now, wall, BURST_GAP_MAX);
            }
        }
        Ok(())
    }

    /// Writes the bytes read from a device to its wire; the first ones release the plant.
    fn write_wire<O: Observer>(
        &mut self,
        n: usize,
        send: impl FnOnce(&mut dyn Wire, &[u8]),
        observer: &mut O,
    ) -> Result<(), RigError> {
        match self.options.hold {
            Hold::AfterFirstByte(after) if self.events.plant_host.is_held() => {
                let now = self.now();
                let agenda = &mut self.events.agenda;
                if agenda.pending(self.release).is_none() {
                    agenda.arm(self.release, now + after);
                }
            }
            _ => self.release_plant(observer),
        }
        self.events
            .call(n, observer, |port, now, plant| port.send(now, plant, send))?;
        Ok(())
    }
}

/// Returns the clock time since the start of serving.
fn wall_time(clock: &dyn Clock, start: HostTime) -> SimTime {
    let since = clock.now().since(start).as_nanos();
    SimTime::from_nanos(u64::try_from(since).unwrap_or(u64::MAX))
}

#[cfg(test)]
mod tests;
