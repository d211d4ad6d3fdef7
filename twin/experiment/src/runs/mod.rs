//! Runs that an engine does, with rows on disk.
//!
//! `plan` and `job` are one scenario at many points, for sweeps, optimizations and radii; `rounds`
//! are runs of studies on scenes, of which `judged` ones differ by settings alone. `missing` does
//! those of both whose rows are not on disk.

pub(crate) mod cases;
pub(crate) mod job;
pub(crate) mod judged;
pub(crate) mod keys;
pub(crate) mod missing;
pub(crate) mod parts;
pub(crate) mod plan;
pub(crate) mod recordings;
pub(crate) mod rounds;
pub(crate) mod scene;
