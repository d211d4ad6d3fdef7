//! Options of a study of robustness.
#![allow(clippy::doc_markdown, reason = "the text is printed verbatim")]

use std::path::PathBuf;

use clap::Args;

use crate::options::CommonOptions;
use crate::options::values::{runs_of_ensemble, tolerance};

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
    /// Plants, settings, engine and folder.
    #[command(flatten)]
    pub common: CommonOptions,
}
