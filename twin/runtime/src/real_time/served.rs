use std::os::fd::BorrowedFd;
use std::time::Duration;

use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;
use twinrig_kernel::{HostTime, SimTime};

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
    /// How many of the gauges are this wire's.
    pub(super) gauges: std::ops::Range<usize>,
    /// The number of its first lane.
    pub(super) first_lane: usize,
    /// Bytes for a host that did not read them.
    pub(super) unread: u64,
}

/// How soon it is noticed that somebody opens the other end.
const LOOK_AGAIN: Duration = Duration::from_millis(5);
/// How soon bytes are noticed at a device for which the system cannot wait.
const GLANCE: Duration = Duration::from_millis(1);

impl Served {
    pub(super) fn new(name: String, wire: Box<dyn Wire>, device: Box<dyn Device>) -> Self {
        Self {
            name,
            wire,
            device,
            heard: Vec::with_capacity(4096),
            hung_until: None,
            was_open: false,
            gauges: 0..0,
            first_lane: 0,
            unread: 0,
        }
    }

    /// Whether somebody had the other end open, and has no more.
    pub(super) fn is_over(&self) -> bool {
        self.was_open && self.hung_until.is_some()
    }

    /// Reads what comes within `patience`.
    fn read(&mut self, patience: Duration, clock: &dyn Clock) -> Result<(), DeviceError> {
        match self.device.read(patience, &mut self.heard) {
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

/// Waits for bytes at any of the devices, until `until` at the latest, and reads those that have come.
pub(super) fn listen(
    ports: &mut [Served],
    until: HostTime,
    clock: &dyn Clock,
) -> Result<(), DeviceError> {
    let now = clock.now();
    let patience = until.since(now);
    if let [only] = &mut *ports
        && only.hung_until.is_none()
    {
        return only.read(patience, clock);
    }
    if !patience.is_zero() {
        wait(ports, patience, now);
    }
    for port in ports {
        if port.hung_until.is_none_or(|until| until <= now) {
            port.read(Duration::ZERO, clock)?;
        }
    }
    Ok(())
}

fn wait(ports: &[Served], mut patience: Duration, now: HostTime) {
    let mut watched = Vec::with_capacity(ports.len());
    for port in ports {
        let descriptor: Option<BorrowedFd<'_>> = port.device.descriptor();
        match (port.hung_until, descriptor) {
            (Some(until), _) => patience = patience.min(until.since(now)),
            (None, Some(descriptor)) => watched.push(PollFd::new(descriptor, PollFlags::POLLIN)),
            (None, None) => patience = patience.min(GLANCE),
        }
    }
    // Whatever ended the wait: the devices are looked at next.
    let _ = ppoll(&mut watched, Some(TimeSpec::from(patience)), None);
}
