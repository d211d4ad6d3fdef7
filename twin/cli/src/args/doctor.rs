//! Arguments of `twin doctor`.

use clap::Args;

/// Arguments of `twin doctor`.
#[derive(Clone, Debug, Args)]
pub struct DoctorArgs {
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}
