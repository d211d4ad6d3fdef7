//! Options of a study of load feedback.
#![allow(clippy::doc_markdown, reason = "the text is printed verbatim")]

use std::path::PathBuf;

use clap::Args;
use twinrig_kernel::SimDuration;

use crate::options::CommonOptions;
use crate::options::values::{any_duration, duration, whole_number};

/// One gait on true, measured and estimated loads.
const FEEDBACK: [&str; 3] = [
    "scenarios/tegotae-trot.toml",
    "scenarios/tegotae-force.toml",
    "scenarios/tegotae-tactile.toml",
];

/// Compare a gait on the true loads of its legs with the same gait on measured or estimated
/// ones
///
/// Runs the scenarios side by side: speed, duty factors, difference of the phases from those of
/// the first scenario, displacement of footsteps after a change of the step length, error and
/// delay of the load that the controller takes. A run with the commands of the first one is
/// void.
#[derive(Clone, Debug, Args)]
pub struct FeedbackOptions {
    /// Scenario files with one gait on loads of several sources; the first is the reference
    #[arg(value_name = "SCENARIO", default_values = FEEDBACK)]
    pub scenarios: Vec<PathBuf>,
    /// Repeat the first scenario with a filter of the load, with these time constants, separated by
    /// commas: 5ms,10ms
    #[arg(long, value_name = "DURATIONS", value_delimiter = ',', value_parser = duration)]
    pub lag: Vec<SimDuration>,
    /// Time from which speed, footsteps and loads count
    #[arg(long, value_name = "TIME", default_value = "5s", value_parser = any_duration)]
    pub after: SimDuration,
    /// Time from the start over which phases are compared with those of the reference
    #[arg(long, value_name = "TIME", default_value = "5s", value_parser = duration)]
    pub phases: SimDuration,
    /// Changes of the step length, separated by commas
    #[arg(
        long,
        value_name = "CHANGES",
        value_delimiter = ',',
        allow_hyphen_values = true,
        default_value = "-5 mm,-10 mm,-20 mm"
    )]
    pub by: Vec<String>,
    /// Points of the gait cycle at which the step length changes
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = whole_number)]
    pub points: usize,
    /// Footsteps of each leg after the change
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = whole_number)]
    pub steps: usize,
    /// Plants, settings, engine and folder.
    #[command(flatten)]
    pub common: CommonOptions,
}
