//! Arguments of `twin report`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `twin report`.
#[derive(Clone, Debug, Args)]
pub struct ReportArgs {
    /// Recordings: one, or two to compare, aligned by their footsteps
    #[arg(required = true, num_args = 1..=2, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// Page to write; by default beside the first recording, with the ending html
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}
