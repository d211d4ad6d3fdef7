//! Names that nearly every crate with parts of its own needs: the registry, the kinds of parts, the
//! traits that they implement, and the types of their signals.
//!
//! ```
//! use twinrig::prelude::*;
//!
//! let port = Port::output("leg/LF/hip/command", Unit::Radian, 1);
//! assert_eq!(port.unit, Unit::Radian);
//! assert!(Registry::standard().controllers().any(|name| name == "cpg"));
//! ```

pub use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
pub use twinrig_runtime::{Driver, Plant, Process, ProcessVariable, Wire};

pub use crate::error::TwinError;
pub use twinrig_experiment::execute;
pub use twinrig_rig::PlantContext;
pub use twinrig_rig::assembly::Assembly;
pub use twinrig_rig::error::{BuildError, Error};
pub use twinrig_rig::parts::bus_kind::{BusContext, BusKind};
pub use twinrig_rig::parts::controller_kind::{ControllerContext, ControllerKind};
pub use twinrig_rig::parts::plant_kind::PlantKind;
pub use twinrig_rig::registry::Registry;
pub use twinrig_rig::run::execution::Execution;
