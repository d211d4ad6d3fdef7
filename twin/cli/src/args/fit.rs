//! Arguments of `twin fit`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;

use super::Settings;

/// Arguments of `twin fit`.
#[derive(Clone, Debug, Args)]
pub struct FitArgs {
    /// Recordings, of runs or imported with `twin import log`
    #[arg(required = true)]
    pub recordings: Vec<PathBuf>,
    /// Search space: scenario of the twin, parameters with their ranges, signals to compare
    #[arg(long, value_name = "FILE")]
    pub space: PathBuf,
    #[command(flatten)]
    pub settings: Settings,
    /// Predict this recording with the fitted parameters; may be repeated
    #[arg(long, value_name = "RECORDING")]
    pub validate: Vec<PathBuf>,
    /// Leave each recording out in turn, and predict it with the parameters of the others
    #[arg(long)]
    pub cross_validate: bool,
    /// Intervals of the profile likelihood, too: all others are fitted again for each bound
    #[arg(long)]
    pub profile: bool,
    /// Threads, without influence on the result [default: number of processors]
    #[arg(long, value_name = "N")]
    pub jobs: Option<NonZeroUsize>,
    /// Folder for the results [default: fits/ and the name of the search space's FILE]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print a JSON object instead of tables
    #[arg(long)]
    pub json: bool,
}
