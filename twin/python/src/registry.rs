//! Parts and engines of the package.

use twinrig::{Registry, fmu_plant};

use crate::exceptions::Exceptions;
use crate::fmu;
use crate::ray_engine::RayEngine;

/// Returns the standard parts with those that require Python: the plant of FMUs, if the package
/// that reads them is installed, and the engine of clusters. `exceptions` takes those of signal
/// handlers while an FMU is awaited.
pub(crate) fn registry(exceptions: &Exceptions) -> Registry {
    let registry = twinrig::registry().with_engine(RayEngine);
    match fmu::kind(exceptions) {
        Some(kind) => registry.with_plant(kind),
        None => registry.without_plant(fmu_plant::offer(), fmu_plant::REMEDY_IN_PACKAGE),
    }
}
