//! Functional Mock-up Units (FMUs) of scenarios, for co-simulation by FMI 2.0 and 3.0: export, and
//! the instance behind the C interface, which is in the crate `twinrig-fmu`.
//!
//! An FMU keeps the files that a recording keeps for its replay, and its instance is built from
//! them. One table of variables (`Variables`) is the source of the model description and of the
//! instance. An instance has no global state: several in a process, on threads of their own, are
//! independent.
//!
//! An instance is built by `AssemblyBuilder::recorded`, as for a replay: there is no second
//! description of a model. [`FmuInstance`] is safe code without a state machine; `twinrig-fmu` adds
//! the C functions, the states of the standard and the logger. FMI has no call for
//! `Plant::begin_window`; `PlantPart` makes it at the beginning of a step that starts on the
//! observation grid, and divides longer steps there, so that a plant receives the calls that a rig
//! makes (the tests compare fingerprints).

mod archive;
mod description;
mod error;
mod export;
mod file_uri;
mod instance;
mod library;
mod part;
mod plant_part;
mod resources;
mod rig_part;
mod unit_type;
mod variables;
mod xml;

#[cfg(test)]
mod tests;

pub use error::{ExportError, FmuError};
pub use export::{FmuRequest, export};
pub use instance::{FmuInstance, FmuState};
pub use library::MARKER;

/// Version of FMI.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FmiVersion {
    /// FMI 2.0.
    Fmi2,
    /// FMI 3.0.
    Fmi3,
}

/// Name of the library inside an FMU, without its extension: the `modelIdentifier`.
pub(crate) const MODEL_IDENTIFIER: &str = "twinrig_fmu";
