//! Compliant constraints.

mod abduction;
mod carrier;
mod contact;
mod elimination;
mod energy;
mod equations;
mod model;
mod motion;
mod slope;
mod state;
mod trunk;

pub(crate) use equations::initial;
#[cfg(test)]
mod tests;
