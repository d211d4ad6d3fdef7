//! Arguments of `twin sweep`.

use std::path::PathBuf;

use clap::Args;
use twinrig_campaign::sweep::Partition;
use twinrig_experiment::options::run::EngineArgs;

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
    #[command(flatten)]
    pub engine: EngineArgs,
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
