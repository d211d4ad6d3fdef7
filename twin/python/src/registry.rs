//! Parts and engines of the package.

use twinrig::Registry;

use crate::ray_engine::RayEngine;

/// Returns the registry of the commands, and of the workers that they use.
pub(crate) fn registry() -> Registry {
    Registry::standard().with_engine(RayEngine)
}
