//! Objects of Python parts, for the garbage collector.

use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;

/// A Python object with several owners in Rust, which are one reference for Python.
///
/// The collector finds a cycle only where every reference is reported once. The parts of a rig are
/// behind interfaces that do not know Python, so the rig shares their objects, and reports them.
pub(crate) type SharedObject = Arc<Py<PyAny>>;

/// Objects that parts have been built from. Clones share them; a part has no clone, which would
/// refer to the part itself.
#[derive(Clone, Default)]
pub(crate) struct PartObjects(Arc<Mutex<Vec<SharedObject>>>);

impl PartObjects {
    /// Returns the object, to be shared with the rig.
    pub(crate) fn share(&self, object: Py<PyAny>) -> SharedObject {
        let shared = SharedObject::new(object);
        let mut objects = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        objects.push(shared.clone());
        shared
    }

    /// Takes the objects that parts still have.
    pub(crate) fn take(&self) -> Vec<SharedObject> {
        let mut objects = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut objects = std::mem::take(&mut *objects);
        objects.retain(|object| Arc::strong_count(object) > 1);
        objects
    }
}
