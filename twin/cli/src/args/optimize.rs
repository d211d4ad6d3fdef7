//! Arguments of `twin optimize`.

use std::path::PathBuf;

use clap::Args;
use twinrig_experiment::options::run::EngineArgs;
use twinrig_experiment::options::values::{whole_number, whole_number_or_none};

use super::Settings;

/// Arguments of `twin optimize`.
#[derive(Clone, Debug, Args)]
pub struct OptimizeArgs {
    /// Scenario file
    pub scenario: PathBuf,
    /// Search space: dimensions, objective and method
    #[arg(long, value_name = "FILE")]
    pub space: PathBuf,
    #[command(flatten)]
    pub settings: Settings,
    /// Points of a generation, in place of `particles` of the search space
    #[arg(long, value_name = "N", value_parser = whole_number)]
    pub particles: Option<usize>,
    /// Generations after the first one, in place of `iterations` of the search space
    #[arg(long, value_name = "N", value_parser = whole_number_or_none)]
    pub iterations: Option<usize>,
    /// Seed of the search, in place of `seed` of the search space
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    #[command(flatten)]
    pub engine: EngineArgs,
    /// Folder for the results and the rows, from which an optimisation continues
    /// [default: optimizations/ and the name of the search space's FILE]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print a JSON object instead of a table
    #[arg(long)]
    pub json: bool,
}
