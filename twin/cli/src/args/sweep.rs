//! Arguments of `twin sweep`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;
use twinrig_campaign::sweep::Partition;

use super::Settings;

/// Arguments of `twin sweep`.
#[derive(Clone, Debug, Args)]
pub struct SweepArgs {
    /// Scenario file
    pub scenario: PathBuf,
    /// Specification of the sweep: dimensions, design and asserted shares
    pub spec: PathBuf,
    #[command(flatten)]
    pub settings: Settings,
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
    /// Run every n-th point only, beginning with the i-th, on one of n machines
    #[arg(long, value_name = "I/N", default_value = "1/1")]
    pub partition: Partition,
    /// Folder for the results and the store of rows, from which a sweep continues
    /// [default: sweeps/ and the name of the SPEC file]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Record each run into DIR on the machine where it runs; OUT/recordings.csv lists them
    #[arg(long, value_name = "DIR")]
    pub record: Option<PathBuf>,
    /// Print a JSON object instead of a table
    #[arg(long)]
    pub json: bool,
    /// Also write the verdicts of shares and runs to FILE as JUnit XML
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
}
