//! Arguments of `twin thesis`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use twinrig_experiment::options::values::key_value;

/// Arguments of `twin thesis`.
#[derive(Clone, Debug, Args)]
pub struct ThesisArgs {
    /// Item: fig-2-9, table-4-5, speeds; without it, all that take less than a minute
    #[arg(value_name = "ITEM")]
    pub item: Option<String>,
    /// Run all items, also those that take longer
    #[arg(long, conflicts_with = "item")]
    pub all: bool,
    /// List the items
    #[arg(long, conflicts_with_all = ["item", "all", "set"])]
    pub list: bool,
    /// Set a key of all scenarios of ITEM: override.leg.aslp.diagonal.stiffness="2200 N/m"
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value, requires = "item")]
    pub set: Vec<(String, String)>,
    /// Move every number that the items read, one at a time, and show which verdicts flip: assumed
    /// and fitted ones by 10 %, others by 2 %. `least` repeats the least recorded move of each
    /// figure
    #[arg(
        long,
        value_name = "MOVES",
        value_enum,
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "all",
        conflicts_with_all = ["set", "list"]
    )]
    pub flips: Option<FlipMoves>,
    /// Folder of the scenarios
    #[arg(long, value_name = "DIR", default_value = "scenarios")]
    pub scenarios: PathBuf,
    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
}

/// Moves of `twin thesis --flips`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FlipMoves {
    /// Of every number, both ways
    All,
    /// The least recorded move of each figure
    Least,
}
