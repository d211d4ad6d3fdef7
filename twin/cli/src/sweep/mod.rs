//! Sweeps: from a specification to rows, files and reports. Optimisations share their runs.

pub(crate) mod cases;
pub(crate) mod execute;
pub(crate) mod files;
pub(crate) mod job;
pub(crate) mod junit;
pub(crate) mod keys;
mod parts;
pub(crate) mod plan;
pub(crate) mod progress;
mod recordings;
pub(crate) mod runs;
pub(crate) mod table;
pub(crate) mod tasks;
