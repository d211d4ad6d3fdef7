//! Options of a study of footstep modulation.
#![allow(clippy::doc_markdown, reason = "the text is printed verbatim")]

use std::path::PathBuf;

use clap::Args;
use twinrig_kernel::SimDuration;

use crate::options::CommonOptions;
use crate::options::values::{any_duration, whole_number};

/// Measure the displacement of footsteps after a change of a variable of the controller
///
/// Runs a gait without the change, and again with each of several changes at each of several
/// points of the gait cycle, and compares the footsteps of each leg, by cycle and by number of
/// touch-downs (thesis, section 3.2.5). With several scenarios or plants it also switches
/// saturation of servos and feedback of loads off, and compares all of them in one table.
#[derive(Clone, Debug, Args)]
pub struct ModulationOptions {
    /// Scenario files with a gait; several are compared
    #[arg(value_name = "SCENARIO", default_value = "scenarios/step-change.toml")]
    pub scenarios: Vec<PathBuf>,
    /// Process variable that changes [default: that of the scenario's first change, or
    /// `step_length`]
    #[arg(long, value_name = "VARIABLE")]
    pub variable: Option<String>,
    /// Changes, separated by commas: --by="-5 mm,-10 mm" [default: nine lengths from -2.5 mm to
    /// -40 mm, as in the thesis]
    #[arg(
        long,
        value_name = "CHANGES",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    pub by: Vec<String>,
    /// Time from which the gait is in its limit cycle; the run without the change lasts 20 s longer
    /// [default: that of the scenario's first change, or 8 s]
    #[arg(long, value_name = "TIME", value_parser = any_duration)]
    pub after: Option<SimDuration>,
    /// Points of the gait cycle at which the variable changes
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = whole_number)]
    pub points: usize,
    /// Footsteps of each leg after the change
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = whole_number)]
    pub steps: usize,
    /// Repeat the study without saturation of servos and without feedback of loads; without it, if
    /// there are several scenarios or plants
    #[arg(long)]
    pub factors: bool,
    /// Plants, settings, engine and folder.
    #[command(flatten)]
    pub common: CommonOptions,
}
