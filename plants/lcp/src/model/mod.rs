//! The robot as equations: masses, geometry, the legs' chains and the constraints inside them, the
//! coupling of legs and trunk, and drives, in any number type. It knows no time, no choice of the
//! active constraints and no method of integration. It uses no other room.

pub(crate) mod articulated;
pub(crate) mod chain;
pub(crate) mod constants;
pub(crate) mod coupling;
pub(crate) mod dense;
pub(crate) mod drives;
pub(crate) mod elimination;
pub(crate) mod energy;
pub(crate) mod feet;
pub(crate) mod leg_constraints;
pub(crate) mod load;
mod parameters;
pub(crate) mod real;
pub(crate) mod rotation;
pub(crate) mod site;
pub(crate) mod start;
pub(crate) mod state;
pub(crate) mod trunk;

pub(crate) use parameters::{LegModel, Model};
