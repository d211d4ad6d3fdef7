//! Radius: the least disturbance at which an expectation fails.
//!
//! A [`DisturbanceAxis`] is one or several keys of a scenario and the values that they take as a
//! disturbance grows. An [`AxisSearch`] proposes sizes of the disturbance and takes the outcomes of
//! their runs; each run serves all expectations. It tests a grid of sizes first, then bisects
//! between the first failure of each expectation and the size below at which it holds, and then
//! tests sizes in the gaps below. An [`AxisResult`] is a function of the outcomes.

mod axis;
mod result;
mod search;

pub use axis::{AxisGrid, AxisValues, DisturbanceAxis, KeyChange, KeyRule};
pub use result::{AxisEnd, AxisResult, ExpectationRadius, RadiusResult, RadiusState};
pub use search::{AxisSearch, Observation, RunOutcome, TestedSize};
