//! Compliant constraints.

mod carrier;
mod chain;
mod contact;
mod elimination;
mod energy;
mod flow;
mod model;
mod motion;
mod slope;
mod state;
mod trunk;
#[cfg(test)]
mod tests;
