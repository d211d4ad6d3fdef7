//! Buses: the [`Driver`] that runs on the robot, the [`Wire`] that carries its bytes in virtual
//! time, and the emulated devices at its end. A [`BusKind`] makes them known to scenarios.
//!
//! A device with a framed protocol takes three small parts: its messages ([`FramedMessage`]), a
//! [`Protocol`], which [`FramedDriver`] turns into a driver, and an [`Emulation`], which
//! [`FramedNode`] turns into a device on a wire.
//!
//! ```
//! use twinrig::bus::{FrameError, FrameMatch, FramedMessage, Framer};
//!
//! /// A byte between brackets: `[x]`.
//! #[derive(Debug, PartialEq)]
//! struct Letter(u8);
//!
//! impl FramedMessage for Letter {
//!     fn match_frame(front: &[u8]) -> FrameMatch {
//!         match front {
//!             [b'[', _, b']', ..] => FrameMatch::Frame(3),
//!             [] => FrameMatch::Missing(3),
//!             [b'['] => FrameMatch::Missing(2),
//!             [b'[', _] => FrameMatch::Missing(1),
//!             _ => FrameMatch::Garbage,
//!         }
//!     }
//!     fn decode(frame: &[u8]) -> Result<Self, FrameError> { Ok(Self(frame[1])) }
//!     fn encode(&self, bytes: &mut Vec<u8>) { bytes.extend([b'[', self.0, b']']); }
//! }
//!
//! let mut bytes = Vec::new();
//! Letter(b'x').encode(&mut bytes);
//! assert_eq!(Letter::match_frame(&bytes), FrameMatch::Frame(3));
//! assert_eq!(Letter::decode(&bytes)?, Letter(b'x'));
//! # Ok::<(), FrameError>(())
//! ```

pub use twinrig_document::Range;
pub use twinrig_kernel::{
    Direction, HostTime, LocalDuration, LocalTime, Port, SimDuration, SimTime, Snapshot,
    SnapshotError, Stream, Unit, signal, stream,
};
pub use twinrig_runtime::{
    Device, DeviceError, Driver, DriverError, NearMisses, Part, PlantAccess, PlantFault,
    PlantSignals, TaskError, TransmitBuffer, Wire, WiringError,
};
pub use twinrig_scenario::{Accepts, BusSpec, OptionSpec, OptionValue, Options};
#[doc(inline)]
pub use twinrig_wire::*;

pub use twinrig_rig::error::BuildError;
pub use twinrig_rig::parts::bus_kind::{BusContext, BusKind};
