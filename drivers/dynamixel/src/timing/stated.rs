//! Times that users state in public threads, beside simulated ones.

use twinrig_kernel::SimDuration;
use twinrig_runtime::Timing;
use twinrig_wire::UsbTiming;

use super::adapters::adapters;
use super::bus_loop::BusLoop;
use super::host_loop::{HostLoop, LoopError};
use super::statistics::percentile;
use crate::config::ReadPattern;
use crate::x::XM430_W350;

/// Repository of the threads.
const ISSUES: &str = "https://github.com/ROBOTIS-GIT/DynamixelSDK/issues";
/// Adapters with a timer of 1 ms.
const ONE_MS: &[&str] = &["at-once-1ms", "low-latency"];
const SIXTEEN_MS: &[&str] = &["at-once-16ms"];
/// Measured transfers or periods.
const COUNT: usize = 21;
/// Reads of a [`HostLoop`].
const READS: u64 = 5;

/// Time that a user states.
#[derive(Clone, Debug, PartialEq)]
pub struct StatedTime {
    /// Number of the issue.
    pub issue: u32,
    /// Conditions, as far as they are stated.
    pub conditions: &'static str,
    /// The time, as it is stated \[ms\].
    pub stated_ms: &'static str,
    /// Return delay of the servos in the simulation.
    pub return_delay: SimDuration,
    /// Median of the simulation, by the names of adapters.
    pub simulated: Vec<(&'static str, SimDuration)>,
}

impl StatedTime {
    /// Returns the address of the issue.
    pub fn source(&self) -> String {
        format!("{ISSUES}/{}", self.issue)
    }
}

/// Loop of a thread.
#[derive(Clone, Copy)]
enum Subject {
    /// Goals to six servos at 4 Mbit/s, and their positions.
    Six(ReadPattern),
    /// Reads of one servo at 1 Mbit/s.
    Reads(u64),
}

/// Issue, conditions, time as stated, and the loop with its adapters.
type Thread = (
    u32,
    &'static str,
    &'static str,
    Subject,
    &'static [&'static str],
);

const THREADS: [Thread; 4] = [
    (
        302,
        "6 reads one by one, 4 Mbit/s, timer 1 ms",
        "> 6",
        Subject::Six(ReadPattern::Read),
        ONE_MS,
    ),
    (
        302,
        "sync read of 6, 4 Mbit/s, timer 1 ms",
        "> 4",
        Subject::Six(ReadPattern::SyncRead),
        ONE_MS,
    ),
    // A write is as long as a read. ASSUMED.
    (
        288,
        "2 reads and a write, timer 1 ms",
        "6",
        Subject::Reads(3),
        ONE_MS,
    ),
    (
        330,
        "1 read, 1 Mbit/s, return delay at its least",
        "15",
        Subject::Reads(1),
        SIXTEEN_MS,
    ),
];

/// Returns the times of all threads, each with the return delays that it does not exclude: the
/// initial one, 500 µs, and 0.
///
/// # Errors
/// [`LoopError`] if a loop cannot be run.
pub fn stated_times() -> Result<Vec<StatedTime>, LoopError> {
    let mut times = Vec::new();
    for (issue, conditions, stated_ms, subject, names) in THREADS {
        let delays: &[u64] = if names == SIXTEEN_MS { &[0] } else { &[500, 0] };
        for micros in delays {
            let return_delay = SimDuration::from_micros(*micros);
            let mut simulated = Vec::new();
            for adapter in adapters().iter().filter(|it| names.contains(&it.name)) {
                simulated.push((adapter.name, subject.median(&adapter.usb, return_delay)?));
            }
            simulated.sort_by_key(|(name, _)| names.iter().position(|it| it == name));
            times.push(StatedTime {
                issue,
                conditions,
                stated_ms,
                return_delay,
                simulated,
            });
        }
    }
    Ok(times)
}

impl Subject {
    fn median(self, usb: &UsbTiming, return_delay: SimDuration) -> Result<SimDuration, LoopError> {
        let usb = usb.clone();
        Ok(match self {
            Self::Six(pattern) => {
                let bus = BusLoop {
                    kind: &XM430_W350,
                    servos: 6,
                    byte_time: SimDuration::from_nanos(2_500),
                    pattern,
                    usb,
                    return_delay,
                    seed: 1,
                };
                percentile(&mut bus.run(COUNT)?.durations, 50)
            }
            Self::Reads(count) => {
                let host = HostLoop {
                    usb,
                    return_delay,
                    sleep: None,
                    program: Timing::ZERO,
                    seed: 1,
                };
                let median = percentile(&mut host.periods(COUNT)?, 50);
                SimDuration::from_nanos(median.as_nanos() / READS * count)
            }
        })
    }
}
