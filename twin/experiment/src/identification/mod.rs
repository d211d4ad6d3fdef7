//! Identification of parameters from recordings (`twin fit`): the twin plays the commands of each
//! recording at their own times, and its outputs are compared with the recorded signals at theirs.
//! CMA-ES searches a start, and least squares ends there.

mod data;
mod execute;
mod figures;
mod minima;
mod model;
mod outcome;
mod profiles;
mod searches;
mod twin;
mod view;

pub use execute::{FitRequest, fit};
pub use minima::FitProgress;
pub use outcome::{FitOutcome, FittedParameter, HeldOut, RecordingResidual, UnknownDirection};
pub use view::fit_page;
