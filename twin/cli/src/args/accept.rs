//! Arguments of `twin accept`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `twin accept`.
#[derive(Clone, Debug, Args)]
pub struct AcceptArgs {
    /// Folder of the baseline; it is made if there is none
    pub baseline: PathBuf,
    /// Recordings to take; by default those in --from whose names the baseline has
    #[arg(value_name = "RECORDING", conflicts_with = "from")]
    pub recordings: Vec<PathBuf>,
    /// Folder of the recordings to take
    #[arg(long, value_name = "DIR", default_value = "recordings")]
    pub from: PathBuf,
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}
