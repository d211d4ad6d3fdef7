//! Study of the timing of a servo bus: rate and age of the positions by number of servos, latency
//! timer, baud rate and read pattern.

mod options;
mod results;
mod view;

pub use options::TimingOptions;
pub use results::{TimingPoint, TimingStudy};
