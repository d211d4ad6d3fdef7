use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use twinrig_kernel::{Direction, HostTime, Layout, Port, SimDuration, SimTime};

use super::clock::{Clock, MonotonicClock};
use super::driver_session::duration;
use super::observer_queue::{ObserverQueueWriter, observer_queue};
use super::privileges::raise_priority;
use super::rig::{Ended, forward_records, join_result};
use super::serve_options::{Hold, ServeOptions, ServeReport, ServedWire};
use super::served_port::{ServedPort, read_ports};
use crate::plant_host::PlantHost;
use crate::wiring::check_names;
use crate::{
    DeviceError, Group, Observer, PartKind, Plant, RigError, RunEvent, TaskError, Wire,
    catch_panic, in_part,
};

/// Plant and emulated boards in real time, each wire with the device of its host: the master end of
/// a PTY. One nanosecond of virtual time is one of the machine's clock.
///
/// All events of wires, boards and plant occur at their own instants and in order, as in lockstep;
/// only the bytes of the host arrive at arbitrary times. Virtual time is never ahead of the clock.
/// A twin that lags catches up, and its lag is reported; no event is skipped or repeated.
///
/// A host is limited to the baud rate: reads from a device are limited to the room in the transmit
/// buffer of its wire ([`Wire::transmit_buffer`]). A writer without pauses therefore blocks, as at
/// a real converter, and memory is bounded. Bytes that a host writes one by one follow each other
/// on the wire without a pause if each is written before the transmitter has been idle for 200 µs;
/// for that time the twin stays behind the clock after a write.
pub struct Serve {
    plant_host: PlantHost,
    ports: Vec<ServedPort>,
    diagnostics: Layout,
    process: Layout,
    traces: Vec<String>,
    values: Vec<f64>,
    options: ServeOptions,
    next_observation: SimTime,
    release_at: Option<SimTime>,
    /// Buffer of the bytes from a wire to its device.
    bytes: Vec<u8>,
    report: ServeReport,
}

/// Byte traces of a port, before those of its wire: bytes written and read by the host.
const OUT: usize = 0;
const IN: usize = 1;
const OWN_TRACES: usize = 2;
/// Longest advance of a lagging twin between two reads of its devices.
const SLICE: SimDuration = SimDuration::from_millis(1);
/// Wait after the transmitter has become idle, for a host that writes byte by byte: the bytes must
/// follow each other on the wire without a pause, however the operating system preempts host or
/// twin. No answer is delayed by it if the USB path from board to host takes its usual two
/// microframes.
const BURST_GAP_MAX: SimDuration = SimDuration::from_micros(200);
/// Longest total wait per burst, so that a host without longer pauses does not stop the twin.
const BURST_MAX: SimDuration = SimDuration::from_millis(2);
/// Maximum number of wake-ups of the wires at one instant; more are a livelock.
const WAKES_MAX: u32 = 100_000;

impl Serve {
    /// Connects the wires to the plant.
    ///
    /// # Errors
    /// [`RigError::Wiring`] if the plant lacks a signal that the boards require,
    /// [`RigError::BadPeriod`] if the observation period is zero.
    pub fn new(
        options: ServeOptions,
        plant: Box<dyn Plant>,
        wires: Vec<ServedWire>,
    ) -> Result<Self, RigError> {
        if options.observe.is_zero() {
            return Err(RigError::BadPeriod {
                what: "observation",
            });
        }
        check_names(plant.name(), &plant.ports())?;
        let plant_host = PlantHost::new(plant);
        let mut diagnostics: Vec<Port> = Vec::new();
        let mut traces = Vec::new();
        let mut ports = Vec::new();
        for ServedWire {
            name,
            mut wire,
            device,
        } in wires
        {
            wire.connect(&name, &plant_host.signals)?;
            let before = Layout::of(&diagnostics, Direction::Output).len();
            diagnostics.extend(wire.diagnostics());
            let after = Layout::of(&diagnostics, Direction::Output).len();
            let port_traces = ["out".to_string(), "in".to_string()].into_iter();
            let first_trace = traces.len();
            traces.extend(
                port_traces
                    .chain(wire.traces())
                    .map(|trace| format!("{name}/{trace}")),
            );
            let mut port = ServedPort::new(name, wire, device);
            (port.diagnostics, port.first_trace) = (before..after, first_trace);
            ports.push(port);
        }
        check_names(
            "the list of diagnostics of drivers and devices",
            &diagnostics,
        )?;
        let diagnostics = Layout::of(&diagnostics, Direction::Output);
        let mut serve = Self {
            plant_host,
            ports,
            values: vec![0.0; diagnostics.len()],
            diagnostics,
            process: Layout::default(),
            traces,
            options,
            next_observation: SimTime::ZERO,
            release_at: None,
            bytes: Vec::with_capacity(4096),
            report: ServeReport::default(),
        };
        if serve.options.hold == Hold::Never {
            serve.plant_host.release();
        }
        Ok(serve)
    }

    /// Returns the layout of a group's values as passed to the observer. There is no process.
    pub fn layout(&self, group: Group) -> &Layout {
        match group {
            Group::Plant => &self.plant_host.signals.outputs,
            Group::Diagnostics => &self.diagnostics,
            Group::ProcessInputs | Group::ProcessOutputs => &self.process,
        }
    }

    /// Returns the names of the byte traces: `NAME/out` is written by the host, `NAME/in` read by
    /// it.
    pub fn traces(&self) -> &[String] {
        &self.traces
    }

    /// Serves until the duration has elapsed, `stop` is set, or the host hangs up. `observer` is
    /// called on the calling thread, and may block.
    ///
    /// A panic of the plant, of a wire or of `observer` is an error that names it.
    pub fn run<O: Observer>(
        self,
        observer: &mut O,
        stop: &AtomicBool,
    ) -> (Result<Ended, RigError>, ServeReport) {
        let (writer, mut reader) = observer_queue(self.options.queue_bytes / size_of::<u64>());
        let stop_requested = Arc::new(AtomicBool::new(false));
        let stop_flag = stop_requested.clone();
        let thread = thread::Builder::new().name("serve".into());
        let thread = thread.spawn(move || {
            raise_priority(self.options.priority);
            let clock = MonotonicClock::start();
            let mut writer = writer;
            catch_panic(|| self.serve(&clock, &mut writer, &stop_flag))
        });
        let thread = match thread {
            Ok(thread) => thread,
            Err(error) => {
                let error = RigError::Thread {
                    what: "serving".into(),
                    why: error.to_string(),
                };
                return (Err(error), ServeReport::default());
            }
        };
        let observed = catch_panic(|| {
            forward_records(&mut reader, observer, || {
                stop_requested.store(stop.load(Ordering::Relaxed), Ordering::Relaxed);
            });
        });
        if observed.is_err() {
            stop_requested.store(true, Ordering::Relaxed);
        }
        let (ended, mut report) = join_result(thread);
        report.lost += reader.lost();
        (observed.map_err(RigError::from).and(ended), report)
    }

    fn serve(
        mut self,
        clock: &dyn Clock,
        observer_queue: &mut ObserverQueueWriter,
        stop: &AtomicBool,
    ) -> (Result<Ended, RigError>, ServeReport) {
        let start = clock.now();
        let ended = loop {
            match self.cycle(clock, start, observer_queue) {
                Ok(None) if stop.load(Ordering::Relaxed) => break Ok(Ended::Stopped),
                Ok(None) => {}
                Ok(Some(ended)) => break Ok(ended),
                Err(error) => break Err(error),
            }
        };
        self.report.served = self.now() - SimTime::ZERO;
        self.report.unread = self.ports.iter().map(|port| port.unread).sum();
        (ended, self.report)
    }

    fn now(&self) -> SimTime {
        self.plant_host.state.now
    }

    /// Runs one cycle: catches up with the clock, writes the host's bytes to the wires, and waits
    /// for bytes until the next event.
    fn cycle<O: Observer>(
        &mut self,
        clock: &dyn Clock,
        start: HostTime,
        observer: &mut O,
    ) -> Result<Option<Ended>, RigError> {
        let end = self
            .options
            .duration
            .map(|duration| SimTime::ZERO + duration);
        self.send_contiguous(wall_time(clock, start), observer)?;
        let wall = wall_time(clock, start);
        if self
            .ports
            .iter()
            .any(|port| port.burst_wait_ended(self.now(), wall))
        {
            // Read after the clock: all bytes that the host had written by then are available,
            // however long this thread was preempted.
            self.read_devices(start, clock)?;
            self.send_contiguous(wall, observer)?;
        }
        let burst_wait = self.burst_wait(wall);
        let wall = end.map_or(wall, |end| wall.min(end)).max(self.now());
        let now = burst_wait.map_or(wall, |(idle, _)| idle.min(wall));
        // Intervals without events are skipped: a slice begins at the next event.
        let begin = self.next_event().map_or(now, |at| at.max(self.now()));
        let now = now.min(begin + SLICE);
        if let Some(first) = self.next_event().filter(|first| *first <= now) {
            let lag = wall - first;
            self.report.lag.count(duration(lag));
            self.report.behind += u64::from(lag > self.options.behind);
        }
        self.catch_up(now, observer)?;
        self.send(wall, observer)?;
        if end.is_some_and(|end| self.now() >= end) {
            return Ok(Some(Ended::Duration));
        }
        if self.options.until_hang_up && self.all_hung_up() {
            return Ok(Some(Ended::HungUp));
        }
        // The stop flag is checked at least every 20 slices.
        let mut until = self.now() + SLICE * 20;
        until = self.next_event().map_or(until, |at| at.min(until));
        if let Some((_, by)) = self.burst_wait(wall).filter(|(idle, _)| *idle < until) {
            until = until.max(by);
        }
        until = end.map_or(until, |end| end.min(until));
        let until = start + duration(until - SimTime::ZERO);
        self.read_devices(until, clock)?;
        Ok(None)
    }

    /// Waits for bytes until `until` at the latest, and reads them.
    fn read_devices(&mut self, until: HostTime, clock: &dyn Clock) -> Result<(), RigError> {
        let now = self.now();
        read_ports(&mut self.ports, now, until, clock).map_err(|error| self.port_error(error))
    }

    /// Returns the earliest time at which the twin must wait for further bytes of a host, and the
    /// clock time at which the wait ends, given the clock time `wall`.
    fn burst_wait(&self, wall: SimTime) -> Option<(SimTime, SimTime)> {
        let ports = self.ports.iter();
        ports
            .filter_map(|port| port.burst_wait(self.now(), wall))
            .min()
    }

    /// Returns whether all devices that the host had opened are closed. They may be closed at
    /// different times.
    fn all_hung_up(&self) -> bool {
        let mut used = self.ports.iter().filter(|port| port.was_open).peekable();
        used.peek().is_some() && used.all(ServedPort::is_hung_up)
    }

    fn port_error(&self, error: DeviceError) -> RigError {
        RigError::Task {
            task: "serving".into(),
            time: self.now(),
            source: TaskError::Port(error),
        }
    }

    /// Returns the time of the next event.
    fn next_event(&self) -> Option<SimTime> {
        let now = self.now();
        let wakes = self.ports.iter().filter_map(|port| port.next_wake(now));
        wakes
            .chain([self.next_observation])
            .chain(self.release_at)
            .min()
    }

    /// Handles all events up to and at `now`, each at its own instant.
    fn catch_up<O: Observer>(&mut self, now: SimTime, observer: &mut O) -> Result<(), RigError> {
        let mut wakes = 0;
        while let Some(at) = self.next_event().filter(|at| *at <= now) {
            wakes = if at > self.now() { 0 } else { wakes + 1 };
            self.plant_host.state.now = at;
            if self.release_at.is_some_and(|due| due <= at) {
                self.release_at = None;
                self.release_plant(observer);
            }
            for n in 0..self.ports.len() {
                if self.ports[n].next_wake(at).is_some_and(|due| due <= at) {
                    if wakes > WAKES_MAX {
                        return Err(RigError::WakeInThePast {
                            task: self.ports[n].name.clone(),
                            time: at,
                            wanted: at,
                        });
                    }
                    self.advance_wire(n, observer)?;
                }
            }
            if self.next_observation <= at {
                self.next_observation = at + self.options.observe;
                self.observe(observer)?;
            }
        }
        self.plant_host.state.now = now;
        Ok(())
    }

    fn release_plant<O: Observer>(&mut self, observer: &mut O) {
        if self.plant_host.is_held() {
            self.plant_host.release();
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
        for n in 0..self.ports.len() {
            let port = &self.ports[n];
            if !port.received.is_empty() && port.idle_from().is_some_and(|idle| now <= idle) {
                self.write_wire(n, |wire, bytes| wire.send_contiguous(now, bytes), observer)?;
                self.ports[n].extend_burst_wait(now, wall, BURST_GAP_MAX);
            }
        }
        Ok(())
    }

    /// Writes the bytes read to the wires.
    fn send<O: Observer>(&mut self, wall: SimTime, observer: &mut O) -> Result<(), RigError> {
        let now = self.now();
        for n in 0..self.ports.len() {
            if !self.ports[n].received.is_empty() {
                self.write_wire(n, |wire, bytes| wire.send(now, bytes), observer)?;
                let port = &mut self.ports[n];
                port.burst_limit = wall + BURST_MAX;
                port.extend_burst_wait(now, wall, BURST_GAP_MAX);
            }
        }
        Ok(())
    }

    fn write_wire<O: Observer>(
        &mut self,
        n: usize,
        send: impl FnOnce(&mut dyn Wire, &[u8]),
        observer: &mut O,
    ) -> Result<(), RigError> {
        let now = self.now();
        match self.options.hold {
            Hold::AfterFirstByte(after) if self.plant_host.is_held() => {
                self.release_at = self.release_at.or(Some(now + after));
            }
            _ => self.release_plant(observer),
        }
        let port = &mut self.ports[n];
        let plant_host = &mut self.plant_host;
        let sent = in_part(PartKind::Wire, &port.name, || {
            port.wire.advance(now, plant_host)?;
            send(&mut *port.wire, &port.received);
            Ok(())
        });
        sent.map_err(failed(&port.name, now))?;
        observer.bytes(now, port.first_trace + OUT, &port.received);
        port.received.clear();
        self.advance_wire(n, observer)
    }

    /// Advances a wire to now and passes its bytes to the host.
    fn advance_wire<O: Observer>(&mut self, n: usize, observer: &mut O) -> Result<(), RigError> {
        let now = self.now();
        let port = &mut self.ports[n];
        let (plant_host, bytes) = (&mut self.plant_host, &mut self.bytes);
        bytes.clear();
        let received = in_part(PartKind::Wire, &port.name, || {
            port.wire.advance(now, plant_host)?;
            port.wire.receive(bytes);
            Ok(())
        });
        received.map_err(failed(&port.name, now))?;
        let first_trace = port.first_trace;
        let wire_trace = first_trace + OWN_TRACES;
        let written = if self.bytes.is_empty() {
            Ok(())
        } else {
            // Bytes are written to the host before they are recorded.
            let written = port.write(&self.bytes);
            observer.bytes(now, first_trace + IN, &self.bytes);
            written
        };
        port.wire
            .drain_traffic(&mut |trace, bytes| observer.bytes(now, wire_trace + trace, bytes));
        written.map_err(|error| self.port_error(error))
    }

    fn observe<O: Observer>(&mut self, observer: &mut O) -> Result<(), RigError> {
        let now = self.now();
        observer.samples(now, Group::Plant, self.plant_host.observe()?);
        self.plant_host.begin_window();
        if !self.values.is_empty() {
            for port in &self.ports {
                let values = &mut self.values[port.diagnostics.clone()];
                port.wire.read_diagnostics(now, values);
            }
            observer.samples(now, Group::Diagnostics, &self.values);
        }
        Ok(())
    }
}

/// Returns the clock time since the start of serving.
fn wall_time(clock: &dyn Clock, start: HostTime) -> SimTime {
    let since = clock.now().since(start).as_nanos();
    SimTime::from_nanos(u64::try_from(since).unwrap_or(u64::MAX))
}

/// Converts the failure of a wire; an error of the plant is passed unchanged.
fn failed(name: &str, time: SimTime) -> impl FnOnce(TaskError) -> RigError + '_ {
    move |source| match source {
        TaskError::Plant(fault) => fault.into(),
        source => RigError::Task {
            task: name.into(),
            time,
            source,
        },
    }
}

#[cfg(test)]
mod tests;
