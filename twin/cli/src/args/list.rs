//! Arguments of `twin list`.

use clap::Args;

/// Arguments of `twin list`.
#[derive(Clone, Debug, Args)]
pub struct ListArgs {
    /// Robot whose mass, leg, joints, drives and process variables are listed: a name, or the path
    /// of a robot file. Without it the process variables are those of cheetah-cub
    pub robot: Option<String>,
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}
