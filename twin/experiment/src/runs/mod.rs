//! Runs of one scenario at many points: their plan, their keys, and the job of an engine that does
//! them. Sweeps, optimizations and studies of radii share them.

pub(crate) mod cases;
pub(crate) mod job;
pub(crate) mod judged;
pub(crate) mod keys;
pub(crate) mod parts;
pub(crate) mod plan;
pub(crate) mod rounds;
pub(crate) mod scene;
pub(crate) mod tasks;
