//! Arguments of `twin examples`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// Arguments of `twin examples`.
#[derive(Clone, Debug, Args)]
pub struct ExamplesArgs {
    /// What to do; without it, list
    #[command(subcommand)]
    pub command: Option<ExamplesCommand>,
    /// Print JSON instead of a table
    #[arg(long, global = true)]
    pub json: bool,
}

/// Command of `twin examples`.
#[derive(Clone, Debug, Subcommand)]
pub enum ExamplesCommand {
    /// List the examples: name, robot, plant, simulated time, and what each is about
    List,
    /// Write examples, with their robots and the schema for editors, to a folder
    ///
    /// Existing files are kept: robots and the schema as they are, and where an example with other
    /// contents exists, nothing is written.
    Copy(ExamplesCopyArgs),
}

/// Arguments of `twin examples copy`.
#[derive(Clone, Debug, Args)]
pub struct ExamplesCopyArgs {
    /// Examples
    #[arg(value_name = "NAME", required_unless_present = "all")]
    pub names: Vec<String>,
    /// Write all examples
    #[arg(long, conflicts_with = "names")]
    pub all: bool,
    /// Folder, which is created if missing
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub to: PathBuf,
}
