//! Options of a study of robustness.
#![allow(clippy::doc_markdown, reason = "the text is printed verbatim")]

use std::path::PathBuf;

use clap::Args;

use crate::options::run::RunOptions;
use crate::options::values::{key_value, runs_of_ensemble, tolerance};

/// Measure how far the expectations of scenarios are from failing, over perturbed starts
///
/// Runs each scenario from its own start and from starts that are perturbed by one unit in the
/// last place up to 1e-6: for each expectation the distribution of its margin, the share of the
/// runs in which it holds, and the least perturbation that changes its verdict; the growth rate
/// of the distance between trajectories, and the time from which on one does not predict the
/// other. Also writes the tables as Markdown.
#[derive(Clone, Debug, Args)]
pub struct RobustnessOptions {
    /// Scenario files
    #[arg(value_name = "SCENARIO", required = true)]
    pub scenarios: Vec<PathBuf>,
    /// Runs of each scenario: one from its own start, the others from perturbed ones
    #[arg(long, value_name = "N", default_value_t = 32, value_parser = runs_of_ensemble)]
    pub ensemble: usize,
    /// Distance of two trajectories beyond which one does not predict the other; of plants that
    /// observe angles only, for a radius of 1 m
    #[arg(long, value_name = "LENGTH", default_value = "1 mm", value_parser = tolerance)]
    pub tolerance: f64,
    /// Find the radii of each scenario as well, as `twin study radius` does
    #[arg(long)]
    pub radius: bool,
    /// Engine of the runs.
    #[command(flatten)]
    pub runs: RunOptions,
    /// Study on this plant; may be repeated; without it, on the scenario's own
    #[arg(long, value_name = "MODEL", value_delimiter = ',')]
    pub plant: Vec<String>,
    /// Set a key of the scenarios: controller.frequency="3 Hz"
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Folder for the HTML page, the CSV, the JSON and the Markdown file, and for the rows from
    /// which a study continues
    #[arg(long, value_name = "DIR", default_value = "studies")]
    pub out: PathBuf,
    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
}
