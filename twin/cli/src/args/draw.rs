//! Arguments of `twin draw`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `twin draw`.
#[derive(Clone, Debug, Args)]
pub struct DrawArgs {
    /// Name of a robot, or path of a robot file
    pub robot: String,
    /// Write to FILE instead of ROBOT.svg in the present folder; - writes to standard output
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}
