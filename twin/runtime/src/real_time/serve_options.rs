use std::fmt;

use twinrig_kernel::SimDuration;

use super::Histogram;
use crate::{Device, Wire};

/// A wire, and the device at which its host is.
pub struct ServedWire {
    /// Name of the bus.
    pub name: String,
    /// The transport with its boards.
    pub wire: Box<dyn Wire>,
    /// The master end of a PTY, or whatever the host is at the other end of.
    pub device: Box<dyn Device>,
}

/// How a twin is served.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ServeOptions {
    /// Period of the observation grid, which begins at 0.
    pub observe: SimDuration,
    /// How long the plant is held in its start.
    pub hold: Hold,
    /// Falling behind the clock by more than this is counted.
    pub behind: SimDuration,
    /// When to end; without end if there is none.
    pub duration: Option<SimDuration>,
    /// Whether to end when the host has closed the devices that it had opened.
    pub until_hang_up: bool,
    /// Priority among the threads of `SCHED_FIFO`, 1 to 99; none leaves the twin an ordinary thread.
    pub priority: Option<u8>,
    /// Room for what the observer has not seen yet \[bytes\].
    pub queue_bytes: usize,
}

/// Observed every 2 ms, held until the first byte, without end. An ordinary thread: a twin that cannot keep up
/// would stop the machine.
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

/// How long the plant is held in its start: boards wake up and calibrate while the robot hangs on its stand. In
/// lockstep it is let go at the first control step, of which nobody tells a twin that is served.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hold {
    /// It is not.
    Never,
    /// Until the host sends its first byte, on whatever wire.
    UntilFirstByte,
    /// Until so long after that byte: what the host takes to configure and calibrate.
    AfterFirstByte(SimDuration),
}

/// How serving went.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ServeReport {
    /// What was simulated.
    pub served: SimDuration,
    /// How much later than its instant anything happened, each time that the twin caught up with the clock.
    pub lag: Histogram,
    /// How often that was more than [`ServeOptions::behind`].
    pub behind: u64,
    /// Bytes that the host did not read in time, and will not.
    pub unread: u64,
    /// Records that the observer never saw, because its queue was full.
    pub lost: u64,
}

impl fmt::Display for ServeReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "served {}; later than its instant by:\n{}",
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
