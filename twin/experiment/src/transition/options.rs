//! Options of a study of gait transitions.
#![allow(clippy::doc_markdown, reason = "the text is printed verbatim")]

use std::path::PathBuf;

use clap::Args;
use twinrig_kernel::SimDuration;

use crate::options::CommonOptions;
use crate::options::values::{deviation, plateau, whole_number};

/// Classify the gait over time while a variable of the controller changes in steps
///
/// Runs a scenario, compares the phases of the touch-downs of each cycle with the patterns of
/// gaits, and dates the transitions between gaits that last, with the value of the variable, on
/// the way up and on the way down (thesis, section 3.3.2.3).
#[derive(Clone, Debug, Args)]
pub struct TransitionOptions {
    /// Scenario file in which a variable of the controller changes in steps
    #[arg(value_name = "SCENARIO")]
    pub scenario: PathBuf,
    /// Process variable whose changes are related to the gaits [default: that of the scenario's
    /// first change]
    #[arg(long, value_name = "VARIABLE")]
    pub variable: Option<String>,
    /// Repeat the run with plateaus of these lengths, separated by commas: 5s,10s,20s. All times of
    /// changes, and the duration, are scaled [default: the scenario's own]
    #[arg(long, value_name = "DURATIONS", value_delimiter = ',', value_parser = plateau)]
    pub plateau: Vec<SimDuration>,
    /// Greatest deviation of a leg from the pattern of a gait, as a share of the cycle
    #[arg(long, value_name = "SHARE", default_value = "0.1", value_parser = deviation)]
    pub tolerance: f64,
    /// Cycles in a row after which a gait is established
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = whole_number)]
    pub cycles: usize,
    /// Plants, settings, engine and folder.
    #[command(flatten)]
    pub common: CommonOptions,
}
