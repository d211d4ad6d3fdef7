//! Compliant constraints.

mod body;
mod energy;
mod equations;
mod mode;
mod model;
mod motion;
mod slope;
mod state;
mod trunk;

pub(crate) use equations::initial;
#[cfg(test)]
mod drops;
#[cfg(test)]
mod tests;
