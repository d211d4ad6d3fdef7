//! Plants on third-party physics engines, as parts of scenarios: kinds of plants with their
//! options and methods, which [`register`] adds to a registry.
//!
//! ```
//! use twinrig_rig::Registry;
//!
//! let registry = twinrig_engines::register(Registry::standard());
//! assert_eq!(
//!     registry.plants().any(|name| name == "rapier"),
//!     cfg!(feature = "rapier"),
//! );
//! ```
//!
//! Each engine is a cargo feature. This crate is above `twinrig-rig`, which is thus the same with
//! and without engines: programs, Python modules and FMUs share its compiled code.
//!
//! # Limits
//!
//! No physics: it is in `twinrig-mujoco` and `twinrig-rapier`, which know no scenarios.

#[cfg(feature = "mujoco")]
mod model_file;
#[cfg(feature = "mujoco")]
mod mujoco;
#[cfg(feature = "mujoco")]
mod mujoco_methods;
#[cfg(feature = "rapier")]
mod rapier;

#[cfg(feature = "mujoco")]
pub use mujoco::mujoco;
#[cfg(feature = "rapier")]
pub use rapier::rapier;

use twinrig_rig::Registry;

/// Adds the plants on the engines of this build. The standard registry has their names, with the
/// remedy for a build without them.
#[must_use]
pub fn register(registry: Registry) -> Registry {
    #[cfg(feature = "mujoco")]
    let registry = registry
        .with_plant(mujoco::kind())
        .with_plant(model_file::kind());
    #[cfg(feature = "rapier")]
    let registry = registry.with_plant(rapier::kind());
    registry
}
