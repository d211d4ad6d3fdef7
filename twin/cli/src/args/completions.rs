//! Arguments of `twin completions` and `twin man`.

use std::path::PathBuf;

use clap::Args;
use clap_complete::Shell;

/// Arguments of `twin completions`.
#[derive(Clone, Debug, Args)]
pub struct CompletionsArgs {
    /// Shell
    pub shell: Shell,
}

/// Arguments of `twin man`.
#[derive(Clone, Debug, Args)]
pub struct ManArgs {
    /// Write the pages of all commands to the folder DIR, which is created: twin.1, twin-run.1
    /// and so on
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}
