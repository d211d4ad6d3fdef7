//! Radii: from a scenario and its disturbances to the least ones at which expectations fail.

pub(crate) mod chosen;
mod context;
mod disturbances;
pub(crate) mod execute;
mod request;
pub(crate) mod table;
