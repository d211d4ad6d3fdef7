//! Compliant constraints.

mod carrier;
mod chain;
mod contact;
mod elimination;
mod energy;
mod flow;
mod model;
mod motion;
mod plant;
mod slope;
mod state;
mod trunk;

pub use plant::SavedCompliant;
pub(crate) use plant::initial;
#[cfg(test)]
mod tests;
