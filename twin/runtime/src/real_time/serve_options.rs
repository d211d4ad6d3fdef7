use std::fmt;

use twinrig_kernel::SimDuration;

use super::Histogram;
use crate::{Device, Wire};

/// A wire, and the device of its host.
pub struct ServedWire {
    /// Name of the bus.
    pub name: String,
    /// The transport with its boards.
    pub wire: Box<dyn Wire>,
    /// The master end of a PTY, or another device with the host at its other end.
    pub device: Box<dyn Device>,
}

/// Options of serving a twin.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ServeOptions {
    /// Period of the observation grid, which begins at 0.
    pub observe: SimDuration,
    /// Release of the plant from its start.
    pub hold: Hold,
    /// Lag behind the clock above which an instant is counted as late.
    pub behind: SimDuration,
    /// Duration; unlimited if none.
    pub duration: Option<SimDuration>,
    /// Whether to end when the host has closed all devices that it had opened.
    pub until_hang_up: bool,
    /// `SCHED_FIFO` priority, 1 to 99; none leaves the thread at normal priority.
    pub priority: Option<u8>,
    /// Capacity of the observer queue \[bytes\].
    pub queue_bytes: usize,
}

/// Observation every 2 ms, hold until the first byte, unlimited, normal priority: at real-time
/// priority a twin that is too slow would block the machine.
impl Default for ServeOptions {
    fn default() -> Self {
        Self {
            observe: SimDuration::from_millis(2),
            hold: Hold::UntilFirstByte,
            behind: SimDuration::from_millis(1),
            duration: None,
            until_hang_up: false,
            priority: None,
            queue_bytes: 4 << 20,
        }
    }
}

/// Time during which the plant is held at its start: boards boot and calibrate while the robot
/// hangs on its stand. In lockstep it is released at the first control step, which a served twin
/// cannot observe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hold {
    /// Not held.
    Never,
    /// Until the first byte from the host, on any wire.
    UntilFirstByte,
    /// Until the given time after that byte: the time for configuration and calibration.
    AfterFirstByte(SimDuration),
}

/// Report on serving.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ServeReport {
    /// Simulated time.
    pub served: SimDuration,
    /// Lag of the first pending event behind the clock, each time that the twin catches up.
    pub lag: Histogram,
    /// Number of lags longer than [`ServeOptions::behind`].
    pub behind: u64,
    /// Number of bytes that the host did not read in time; they are lost.
    pub unread: u64,
    /// Records lost because the observer's queue was full.
    pub lost: u64,
}

impl fmt::Display for ServeReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "served {}; lag of the events behind the clock:\n{}",
            self.served, self.lag
        )?;
        if self.behind > 0 {
            writeln!(
                f,
                "BEHIND the clock {} times: this machine is too slow for this twin, or busy",
                self.behind
            )?;
        }
        if self.unread > 0 {
            writeln!(f, "{} bytes were not read by the host", self.unread)?;
        }
        if self.lost > 0 {
            writeln!(f, "LOST: {} records did not reach the observer", self.lost)?;
        }
        Ok(())
    }
}
