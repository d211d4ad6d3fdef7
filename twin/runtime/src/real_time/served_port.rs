use std::time::Duration;

use twinrig_kernel::{HostTime, SimDuration, SimTime};

use super::clock::Clock;
use super::system::Watched;
use crate::event_loop::{PartSlot, Wakeable};
use crate::traced_wire::TracedWire;
use crate::{Device, DeviceError, Part, PlantAccess, Progress, RigError, TaskError, Wire};

/// A wire with the device of its host, and the state of both.
pub(super) struct ServedPort {
    wire: TracedWire,
    device: Box<dyn Device>,
    /// Bytes read from the device and not yet written to the wire.
    pub(super) pending: Vec<u8>,
    /// Time of the next check of a device whose other end is closed.
    closed_until: Option<HostTime>,
    /// Whether the other end was ever open.
    pub(super) was_open: bool,
    /// Clock times: end of the wait for further bytes of the current burst, and limit of all such
    /// waits in it.
    burst_wait_until: SimTime,
    pub(super) burst_limit: SimTime,
    /// Number of bytes that the host did not read.
    pub(super) unread: u64,
}

/// Interval of the checks whether a closed other end has been opened.
const REOPEN_INTERVAL: Duration = Duration::from_millis(5);
/// Polling interval of a device without descriptor, and of a transmit buffer without room.
const POLL_INTERVAL: Duration = Duration::from_millis(1);
/// Maximum number of bytes per read \[bytes\], independent of the room of the wire.
const READ_MAX: usize = 4096;
/// Minimum room for a read \[bytes\]: a USB bulk packet, which a converter accepts as a whole or
/// not at all.
const USB_PACKET: usize = 512;

impl ServedPort {
    pub(super) fn new(name: String, wire: Box<dyn Wire>, device: Box<dyn Device>) -> Self {
        Self {
            wire: TracedWire::new(name, wire),
            device,
            pending: Vec::with_capacity(READ_MAX),
            closed_until: None,
            was_open: false,
            burst_wait_until: SimTime::ZERO,
            burst_limit: SimTime::ZERO,
            unread: 0,
        }
    }

    /// Returns whether the other end was open and is closed.
    pub(super) fn is_hung_up(&self) -> bool {
        self.was_open && self.closed_until.is_some()
    }

    /// Returns the number of bytes that may be read at `now`, beside those read and not yet written
    /// to the wire; the others remain in the device, whose writer blocks when it is full.
    fn room(&self, now: SimTime) -> usize {
        let buffer = self.wire.wire.transmit_buffer();
        let room = buffer.map(|buffer| buffer.room(now).saturating_sub(self.pending.len()));
        match room {
            None => READ_MAX,
            Some(room) if room < USB_PACKET => 0,
            Some(room) => room.min(READ_MAX),
        }
    }

    /// Returns the time from which the transmitter is idle; none before the first byte.
    pub(super) fn idle_from(&self) -> Option<SimTime> {
        let idle = self
            .wire
            .wire
            .transmit_buffer()
            .map(|buffer| buffer.idle_from);
        idle.filter(|idle| *idle > SimTime::ZERO)
    }

    /// Extends the wait for further bytes after a write at `now`, clock time `wall`: until the
    /// transmitter has been idle for `timeout`.
    pub(super) fn extend_burst_wait(&mut self, now: SimTime, wall: SimTime, timeout: SimDuration) {
        let busy = self.idle_from().and_then(|idle| idle.checked_since(now));
        let until = wall + busy.unwrap_or_default() + timeout;
        self.burst_wait_until = until.min(self.burst_limit.max(wall));
    }

    /// Returns the time at which the twin, now at `now`, must wait for further bytes of the host,
    /// and the clock time at which the wait ends.
    pub(super) fn burst_wait(&self, now: SimTime, wall: SimTime) -> Option<(SimTime, SimTime)> {
        let idle = self.idle_from().filter(|idle| *idle >= now)?;
        (wall < self.burst_wait_until).then_some((idle, self.burst_wait_until))
    }

    /// Returns whether the wait has ended and the twin, at `now`, is about to pass that time.
    pub(super) fn burst_wait_ended(&self, now: SimTime, wall: SimTime) -> bool {
        let passes = |idle: &SimTime| (now..=wall).contains(idle);
        wall >= self.burst_wait_until && self.idle_from().is_some_and(|idle| passes(&idle))
    }

    /// Reads the bytes that arrive within `timeout`, at most `room`.
    fn read(
        &mut self,
        room: usize,
        timeout: Duration,
        clock: &dyn Clock,
    ) -> Result<(), DeviceError> {
        match self.device.read_up_to(room, timeout, &mut self.pending) {
            Ok(()) => {
                self.closed_until = None;
                self.was_open = true;
            }
            Err(DeviceError::HungUp { .. }) => {
                self.closed_until = Some(clock.now() + REOPEN_INTERVAL);
            }
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// Writes the bytes read from the device to the wire, as [`Wire::send`] or
    /// [`Wire::send_contiguous`].
    pub(super) fn send(
        &mut self,
        now: SimTime,
        plant: &mut dyn PlantAccess,
        send: impl FnOnce(&mut dyn Wire, &[u8]),
    ) -> Result<Progress, TaskError> {
        self.wire.advance(now, plant)?;
        self.wire.send(&self.pending, send);
        self.pending.clear();
        self.wake(now, plant)
    }

    /// Writes the bytes of the wire to the host. Unread bytes are lost, as with a converter chip.
    fn write(&mut self) -> Result<(), DeviceError> {
        let bytes = &self.wire.received;
        let lost = self.closed_until.is_some();
        let written = if lost {
            Ok(())
        } else {
            self.device.write(bytes)
        };
        match written {
            Ok(()) if !lost => {}
            Ok(()) | Err(DeviceError::HungUp { .. } | DeviceError::Stuck { .. }) => {
                self.unread += bytes.len() as u64;
            }
            Err(error) => return Err(error),
        }
        Ok(())
    }
}

impl Part for ServedPort {
    fn inner(&self) -> Option<&dyn Part> {
        Some(&self.wire)
    }

    fn inner_mut(&mut self) -> Option<&mut dyn Part> {
        Some(&mut self.wire)
    }
}

impl Wakeable for ServedPort {
    /// Advances the wire and passes its bytes to the host.
    fn wake(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<Progress, TaskError> {
        if self.wire.receive(now, plant)? {
            self.write()?;
        }
        Ok(Progress::Done)
    }

    fn idle_wake(&self) -> Option<SimTime> {
        self.wire.wire.next_wake()
    }
}

/// Waits for bytes at any of the devices, until `until` at the latest, and reads those that have
/// room on their wires, which are at `now`.
pub(super) fn read_ports(
    ports: &mut [PartSlot<ServedPort>],
    now: SimTime,
    until: HostTime,
    clock: &dyn Clock,
) -> Result<(), RigError> {
    let begin = clock.now();
    let timeout = until.since(begin);
    if let [slot] = &mut *ports
        && slot.part.closed_until.is_none()
        && slot.part.room(now) > 0
    {
        let room = slot.part.room(now);
        let read = slot.part.read(room, timeout, clock);
        return read.map_err(|error| slot.error(now, error.into()));
    }
    if !timeout.is_zero() {
        wait_for_bytes(ports, now, timeout, begin, clock);
    }
    for slot in ports {
        let room = slot.part.room(now);
        if room > 0 && slot.part.closed_until.is_none_or(|until| until <= begin) {
            let read = slot.part.read(room, Duration::ZERO, clock);
            read.map_err(|error| slot.error(now, error.into()))?;
        }
    }
    Ok(())
}

fn wait_for_bytes(
    ports: &[PartSlot<ServedPort>],
    now: SimTime,
    mut timeout: Duration,
    begin: HostTime,
    clock: &dyn Clock,
) {
    let mut watched = Watched::default();
    for PartSlot { part: port, .. } in ports {
        match port.closed_until {
            Some(until) => timeout = timeout.min(until.since(begin)),
            None if port.room(now) > 0 && watched.add(&*port.device) => {}
            None => timeout = timeout.min(POLL_INTERVAL),
        }
    }
    watched.wait(begin, timeout, clock);
}
