//! The plant against closed forms, an independent integrator, and what must hold of any motion.

mod allocation;
mod energy;
mod extremes;
mod force;
mod friction;
mod motors;
mod passive;
mod properties;
mod reference;
mod scene;
mod statics;
mod symmetry;
