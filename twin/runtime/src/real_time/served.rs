use std::os::fd::BorrowedFd;
use std::time::Duration;

use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;
use twinrig_kernel::{HostTime, SimDuration, SimTime};

use super::clock::{Clock, later};
use crate::{Device, DeviceError, Wire};

/// A wire with the device of its host, and the state of both.
pub(super) struct Served {
    pub(super) name: String,
    pub(super) wire: Box<dyn Wire>,
    device: Box<dyn Device>,
    /// Bytes read from the device and not yet written to the wire.
    pub(super) heard: Vec<u8>,
    /// Time of the next check of a device whose other end is closed.
    hung_until: Option<HostTime>,
    /// Whether the other end was ever open.
    pub(super) was_open: bool,
    /// Clock times: end of the wait for further bytes of the current burst, and limit of all such
    /// waits in it.
    gathers_until: SimTime,
    pub(super) burst_until: SimTime,
    /// Range of its diagnostics.
    pub(super) diagnostics: std::ops::Range<usize>,
    /// Index of its first byte trace.
    pub(super) first_lane: usize,
    /// Number of bytes that the host did not read.
    pub(super) unread: u64,
}

/// Interval of the checks whether a closed other end has been opened.
const LOOK_AGAIN: Duration = Duration::from_millis(5);
/// Polling interval of a device without descriptor, and of a transmit buffer without room.
const GLANCE: Duration = Duration::from_millis(1);
/// Maximum number of bytes per read \[bytes\], independent of the room of the wire.
const READ_MAX: usize = 4096;
/// Minimum room for a read \[bytes\]: a USB bulk packet, which a converter accepts as a whole or
/// not at all.
const PACKET: usize = 512;

impl Served {
    pub(super) fn new(name: String, wire: Box<dyn Wire>, device: Box<dyn Device>) -> Self {
        Self {
            name,
            wire,
            device,
            heard: Vec::with_capacity(4096),
            hung_until: None,
            was_open: false,
            gathers_until: SimTime::ZERO,
            burst_until: SimTime::ZERO,
            diagnostics: 0..0,
            first_lane: 0,
            unread: 0,
        }
    }

    /// Returns whether the other end was open and is closed.
    pub(super) fn is_over(&self) -> bool {
        self.was_open && self.hung_until.is_some()
    }

    /// Returns the number of bytes that may be read at `now`; the others remain in the device,
    /// whose writer blocks when it is full.
    fn room(&self, now: SimTime) -> usize {
        let room = self.wire.transmit_buffer().map(|buffer| buffer.room(now));
        match room {
            None => READ_MAX,
            Some(room) if room < PACKET => 0,
            Some(room) => room.min(READ_MAX),
        }
    }

    /// Returns the time from which the transmitter is idle; none before the first byte.
    pub(super) fn idle_from(&self) -> Option<SimTime> {
        let idle = self.wire.transmit_buffer().map(|buffer| buffer.idle_from);
        idle.filter(|idle| *idle > SimTime::ZERO)
    }

    /// Extends the wait for further bytes after a write at `now`, clock time `wall`: until the
    /// transmitter has been idle for `patience`.
    pub(super) fn gather(&mut self, now: SimTime, wall: SimTime, patience: SimDuration) {
        let busy = self.idle_from().and_then(|idle| idle.checked_since(now));
        let until = wall + busy.unwrap_or_default() + patience;
        self.gathers_until = until.min(self.burst_until.max(wall));
    }

    /// Returns the time at which the twin, now at `now`, must wait for further bytes of the host,
    /// and the clock time at which the wait ends.
    pub(super) fn gathers(&self, now: SimTime, wall: SimTime) -> Option<(SimTime, SimTime)> {
        let idle = self.idle_from().filter(|idle| *idle >= now)?;
        (wall < self.gathers_until).then_some((idle, self.gathers_until))
    }

    /// Returns whether the wait has ended and the twin, at `now`, is about to pass that time.
    pub(super) fn gathers_no_longer(&self, now: SimTime, wall: SimTime) -> bool {
        let passes = |idle: &SimTime| (now..=wall).contains(idle);
        wall >= self.gathers_until && self.idle_from().is_some_and(|idle| passes(&idle))
    }

    /// Reads the bytes that arrive within `patience`, at most `room`.
    fn read(
        &mut self,
        room: usize,
        patience: Duration,
        clock: &dyn Clock,
    ) -> Result<(), DeviceError> {
        match self.device.read_up_to(room, patience, &mut self.heard) {
            Ok(()) => {
                self.hung_until = None;
                self.was_open = true;
            }
            Err(DeviceError::HungUp { .. }) => {
                self.hung_until = Some(later(clock.now(), LOOK_AGAIN));
            }
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// Writes bytes of the wire to the host. Unread bytes are lost, as with a converter chip.
    pub(super) fn write(&mut self, bytes: &[u8]) -> Result<(), DeviceError> {
        let lost = self.hung_until.is_some();
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

    /// Returns the next wake-up of the wire, not before `now`.
    pub(super) fn next_wake(&self, now: SimTime) -> Option<SimTime> {
        self.wire.next_wake().map(|at| at.max(now))
    }
}

/// Waits for bytes at any of the devices, until `until` at the latest, and reads those that have
/// room on their wires, which are at `now`.
pub(super) fn listen(
    ports: &mut [Served],
    now: SimTime,
    until: HostTime,
    clock: &dyn Clock,
) -> Result<(), DeviceError> {
    let begin = clock.now();
    let patience = until.since(begin);
    if let [only] = &mut *ports
        && only.hung_until.is_none()
        && only.room(now) > 0
    {
        return only.read(only.room(now), patience, clock);
    }
    if !patience.is_zero() {
        wait(ports, now, patience, begin, clock);
    }
    for port in ports {
        let room = port.room(now);
        if room > 0 && port.hung_until.is_none_or(|until| until <= begin) {
            port.read(room, Duration::ZERO, clock)?;
        }
    }
    Ok(())
}

fn wait(
    ports: &[Served],
    now: SimTime,
    mut patience: Duration,
    begin: HostTime,
    clock: &dyn Clock,
) {
    let mut watched = Vec::with_capacity(ports.len());
    for port in ports {
        let descriptor: Option<BorrowedFd<'_>> = port.device.descriptor();
        match (port.hung_until, descriptor) {
            (Some(until), _) => patience = patience.min(until.since(begin)),
            (None, Some(descriptor)) if port.room(now) > 0 => {
                watched.push(PollFd::new(descriptor, PollFlags::POLLIN));
            }
            (None, _) => patience = patience.min(GLANCE),
        }
    }
    if watched.is_empty() {
        clock.sleep_until(later(begin, patience));
    } else {
        // All devices are read next, whatever ended the wait.
        let _ = ppoll(&mut watched, Some(TimeSpec::from(patience)), None);
    }
}
