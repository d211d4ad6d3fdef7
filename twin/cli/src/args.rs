//! The command line. Its doc comments are the help that `--help` prints.
#![allow(clippy::doc_markdown)]

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

/// Runs a legged robot, its controller and its I/O together in virtual time, and judges the run.
#[derive(Debug, Parser)]
#[command(name = "twin", version, about, disable_help_subcommand = true)]
#[command(after_help = "Exit code: 0 all expectations hold, 1 one fails, 2 something is wrong.")]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run scenarios and say whether their expectations hold
    Run(RunArgs),
    /// Say what is in the scene of a scenario, and what is left out and why; run nothing
    Plan(PlanArgs),
    /// Say whether scenarios are sound; run nothing
    Check(CheckArgs),
    /// List the plants, controllers and robots of this build
    List(ListArgs),
    /// Find the first sample in which two recordings differ
    Diff(DiffArgs),
    /// Run a recording again and say whether everything happens as it did
    Replay(ReplayArgs),
}

/// What is set on top of a scenario file.
#[derive(Clone, Debug, Default, Args)]
pub struct Settings {
    /// Set a key of the scenario: plant.step="0.5 ms"
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Run with this plant; short for --set plant.model=MODEL
    #[arg(long, value_name = "MODEL")]
    pub plant: Option<String>,
}

/// `twin run`
#[derive(Clone, Debug, Default, Args)]
pub struct RunArgs {
    /// Scenario files
    #[arg(required = true, value_name = "SCENARIO")]
    pub scenarios: Vec<PathBuf>,
    #[command(flatten)]
    pub settings: Settings,
    /// Talk to hardware at DEVICE instead of the emulated boards of a bus
    #[arg(long, value_name = "BUS=DEVICE", value_parser = key_value)]
    pub port: Vec<(String, String)>,
    /// Folder for recordings
    #[arg(long, value_name = "DIR", default_value = "recordings")]
    pub out: PathBuf,
    /// Record nothing
    #[arg(long, conflicts_with = "out")]
    pub no_record: bool,
    /// Print one JSON object a scenario, and no table
    #[arg(long)]
    pub json: bool,
    /// Write the verdicts to FILE, too, in the XML of JUnit
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
}

/// `twin plan`
#[derive(Clone, Debug, Args)]
pub struct PlanArgs {
    /// Scenario file
    pub scenario: PathBuf,
    #[command(flatten)]
    pub settings: Settings,
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}

/// `twin check`
#[derive(Clone, Debug, Args)]
pub struct CheckArgs {
    /// Scenario files
    #[arg(required = true, value_name = "SCENARIO")]
    pub scenarios: Vec<PathBuf>,
    #[command(flatten)]
    pub settings: Settings,
    /// Print one JSON object a scenario
    #[arg(long)]
    pub json: bool,
}

/// `twin list`
#[derive(Clone, Debug, Args)]
pub struct ListArgs {
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}

/// `twin diff`
#[derive(Clone, Debug, Args)]
pub struct DiffArgs {
    /// A recording
    pub a: PathBuf,
    /// Another
    pub b: PathBuf,
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}

/// `twin replay`
#[derive(Clone, Debug, Args)]
pub struct ReplayArgs {
    /// A recording
    pub recording: PathBuf,
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}

fn key_value(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => {
            Ok((key.trim().to_owned(), value.trim().to_owned()))
        }
        _ => Err("there is no `=` behind a key".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_sound() {
        Cli::command().debug_assert();
    }

    #[test]
    fn a_setting_is_split_at_its_first_sign() {
        let parsed = key_value("plant.step = a=b").unwrap();
        assert_eq!(parsed, ("plant.step".to_owned(), "a=b".to_owned()));
        assert!(key_value("plant.step").is_err() && key_value("=1").is_err());
    }
}
