//! The scheduling rule in real time: a [`RealTimeRig`] runs a process and its drivers on real
//! devices, a [`Serve`] runs boards and plant behind such devices. Only this module uses a clock
//! and threads. Where there is no Linux, both are refused: [`RigError::NeedsLinux`].
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

#[cfg(test)]
mod tests;
