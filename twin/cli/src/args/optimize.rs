//! Arguments of `twin optimize`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;
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
    /// Engine of the runs, without influence on the results: `local`, the threads of this program,
    /// or `ray`, the workers of a Ray cluster (Python package only)
    #[arg(long, value_name = "ENGINE", default_value = "local")]
    pub engine: String,
    /// Ray cluster: `auto`, the one that this machine belongs to, or HOST:PORT
    /// [default: a Ray of its own on this machine, or the one in RAY_ADDRESS]
    #[arg(long, value_name = "ADDRESS")]
    pub address: Option<String>,
    /// Number of runs at the same time, without influence on the results
    /// [default: number of processors, or of the cluster's CPUs]
    #[arg(long, value_name = "N")]
    pub jobs: Option<NonZeroUsize>,
    /// Folder for the results and the rows, from which an optimisation continues
    /// [default: optimizations/ and the name of the search space's FILE]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print a JSON object instead of a table
    #[arg(long)]
    pub json: bool,
}
