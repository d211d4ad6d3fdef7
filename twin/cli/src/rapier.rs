//! The plants that stand on Rapier, out of a scenario's words.

use crate::registry::Registry;

pub(crate) fn kinds(registry: Registry) -> Registry {
    registry
}
