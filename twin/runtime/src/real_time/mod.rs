//! The scheduling rule in real time: a [`RealTimeRig`] runs a process and its drivers on real
//! devices, a [`Serve`] runs boards and plant behind such devices. Only this module uses a clock
//! and threads. Where there is no Linux, both are refused: [`RigError::NeedsLinux`].
//!
//! The scheduling rule is that of `Manager`, the process and its changes are a `ProcessSlot`, as in
//! lockstep; where `Rig` takes the next event from its agenda, `RealTimeScheduler` reads a `Clock`.
//! It knows no thread, so a test advances its clock by hand and compares every event with the
//! lockstep rig's.
//!
//! ```text
//!  control thread                 a thread per driver                         calling thread
//!  RealTimeScheduler ── triple buffer, order ──► Worker: DriverSession ◄─► Device
//!      ▲ └──── ring: bytes, ended, failed ──┘                        ┌──► Observer
//!      └──────────────── observer queue: a ring ─────────────────────┘    (may be slow)
//! ```
//!
//! - The process gets, and changes use, the times of the grid: without overruns the bytes on the
//!   wire are those of lockstep. Events carry the times at which they happened. Time 0 is control
//!   step 0; opening precedes it.
//! - A [`Steering`] changes variables while the run goes on: its queue is read at each control
//!   step.
//! - No thread waits for a slower one. An observer queue that is full loses records and counts them
//!   (`RealTimeReport::lost`): such a recording is an error, not a slower robot.
//! - Every phase of a driver has a limit, which its own thread keeps; `WorkerPool` gives up a
//!   thread that does not return. However a run ends, the drivers close.
//! - [`Serve`] runs plant and wires in the event loop of `Rig` (`event_loop.rs`), never ahead of
//!   the clock. Bytes of a host are put onto the wire when they have been read. A twin that falls
//!   behind catches up with the clock and reports it.
//!
//! [`RigError::NeedsLinux`]: crate::RigError::NeedsLinux

mod clock;
mod driver_session;
mod histogram;
mod limits;
mod monotonic_clock;
mod observed_thread;
mod observer_queue;
mod privileges;
mod report;
mod rig;
mod ring;
mod scheduler;
mod serve;
mod serve_options;
mod served_port;
mod steering;
#[cfg(target_os = "linux")]
mod system;
#[cfg(not(target_os = "linux"))]
#[path = "system_without.rs"]
mod system;
mod worker;
mod worker_pool;

pub use clock::Clock;
pub use histogram::Histogram;
pub use limits::Limits;
pub use monotonic_clock::MonotonicClock;
pub use privileges::Privileges;
pub use report::{EndReason, RealTimeReport, TaskReport};
pub use rig::{RealTimeOptions, RealTimeRig};
pub use serve::Serve;
pub use serve_options::{Hold, ServeOptions, ServeReport, ServedWire};
pub use steering::Steering;

#[cfg(test)]
mod tests;
