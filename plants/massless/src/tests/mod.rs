//! The plant against closed forms, an independent integrator, and invariants of any motion.

mod allocation;
mod compliant;
mod energy;
mod explicit;
mod extremes;
mod force;
mod friction;
mod harness;
mod impacts;
mod motors;
mod passive;
mod properties;
mod readings;
mod reference;
mod statics;
mod symmetry;
