//! Arguments of `twin thesis`.

use std::path::PathBuf;

use clap::Args;

use super::key_value;

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
    /// Folder of the scenarios
    #[arg(long, value_name = "DIR", default_value = "scenarios")]
    pub scenarios: PathBuf,
    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
}
