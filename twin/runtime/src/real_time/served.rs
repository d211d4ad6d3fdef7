use std::os::fd::BorrowedFd;
use std::time::Duration;

use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;
use twinrig_kernel::{HostTime, SimDuration, SimTime};

use super::clock::{Clock, later};
use crate::{Device, DeviceError, Wire};

/// A wire with the device at which the host is, and how that is.
pub(super) struct Served {
    pub(super) name: String,
    pub(super) wire: Box<dyn Wire>,
    device: Box<dyn Device>,
    /// What was read and not put onto the wire yet.
    pub(super) heard: Vec<u8>,
    /// When to look again, if nobody has the other end open.
    hung_until: Option<HostTime>,
    /// Whether somebody ever had it open.
    pub(super) was_open: bool,
    /// Until when, by the clock, more bytes of the host may belong to those that it wrote last, and until when the whole burst may
    /// go on so.
    gathers_until: SimTime,
    pub(super) burst_until: SimTime,
    /// How many of the gauges are this wire's.
    pub(super) diagnostics: std::ops::Range<usize>,
    /// The number of its first lane.
    pub(super) first_lane: usize,
    /// Bytes for a host that did not read them.
    pub(super) unread: u64,
}

/// How soon it is noticed that somebody opens the other end.
const LOOK_AGAIN: Duration = Duration::from_millis(5);
/// How soon bytes are noticed at a device for which the system cannot wait, and how soon room in a transmit buffer.
const GLANCE: Duration = Duration::from_millis(1);
/// Most that is read at once \[bytes\], whatever the wire has room for.
const READ_MAX: usize = 4096;
/// No less room than this makes a transmit buffer take bytes \[bytes\]: a bulk packet of USB, which a converter takes as a whole
/// or not at all.
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

    /// Whether somebody had the other end open, and has no more.
    pub(super) fn is_over(&self) -> bool {
        self.was_open && self.hung_until.is_some()
    }

    /// How many bytes may be read at `now`; the others stay in the device, whose writer waits when it is full.
    fn room(&self, now: SimTime) -> usize {
        let room = self.wire.transmit_buffer().map(|buffer| buffer.room(now));
        match room {
            None => READ_MAX,
            Some(room) if room < PACKET => 0,
            Some(room) => room.min(READ_MAX),
        }
    }

    /// When the transmitter is idle, if anything was ever written to it.
    pub(super) fn idle_from(&self) -> Option<SimTime> {
        let idle = self.wire.transmit_buffer().map(|buffer| buffer.idle_from);
        idle.filter(|idle| *idle > SimTime::ZERO)
    }

    /// At `now`, when the clock shows `wall`, something was put onto the wire: more is waited for until the transmitter has been
    /// idle for `patience`.
    pub(super) fn gather(&mut self, now: SimTime, wall: SimTime, patience: SimDuration) {
        let busy = self.idle_from().and_then(|idle| idle.checked_since(now));
        let until = wall + busy.unwrap_or_default() + patience;
        self.gathers_until = until.min(self.burst_until.max(wall));
    }

    /// Where the twin, which is at `now`, is to wait for more bytes of the host, and until when by the clock.
    pub(super) fn gathers(&self, now: SimTime, wall: SimTime) -> Option<(SimTime, SimTime)> {
        let idle = self.idle_from().filter(|idle| *idle >= now)?;
        (wall < self.gathers_until).then_some((idle, self.gathers_until))
    }

    /// Whether the twin has waited there for long enough, and is to go beyond.
    pub(super) fn gathers_no_longer(&self, now: SimTime, wall: SimTime) -> bool {
        let passes = |idle: &SimTime| (now..=wall).contains(idle);
        wall >= self.gathers_until && self.idle_from().is_some_and(|idle| passes(&idle))
    }

    /// Reads what comes within `patience`, `room` bytes at most.
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

    /// Writes what the wire has for the host. What nobody reads is lost, as it is from a chip.
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

    /// When the wire wants to go on.
    pub(super) fn next_wake(&self, now: SimTime) -> Option<SimTime> {
        self.wire.next_wake().map(|at| at.max(now))
    }
}

/// Waits for bytes at any of the devices, until `until` at the latest, and reads those that have come and have room on their
/// wires, which are at `now`.
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
        // Whatever ended the wait: the devices are looked at next.
        let _ = ppoll(&mut watched, Some(TimeSpec::from(patience)), None);
    }
}
