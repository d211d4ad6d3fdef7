//! Compliant constraints.

mod abduction;
mod body;
mod carrier;
mod contact;
mod elimination;
mod energy;
mod equations;
mod evaluation;
mod forces;
mod limits;
mod model;
mod motion;
mod slope;
mod solution;
mod state;
mod trunk;

pub(crate) use equations::initial;
#[cfg(test)]
mod tests;
