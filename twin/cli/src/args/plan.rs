//! Arguments of `twin plan`.

use std::path::PathBuf;

use clap::Args;
use twinrig_experiment::options::values::{key_value, seconds, whole_number};

/// Arguments of `twin plan`.
#[derive(Clone, Debug, Args)]
pub struct PlanArgs {
    /// Scenario file
    pub scenario: PathBuf,
    /// Set a key of the scenario: plant.step="0.5 ms", seed=2
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Plan with this plant; short for --set plant.model=MODEL. With --sufficient: consider this
    /// plant only; may be repeated
    #[arg(long, value_name = "MODEL", value_delimiter = ',')]
    pub plant: Vec<String>,
    /// Search the plant, constraints, method and step that give the margin of every expectation
    /// with an error below a tenth of it, in the least time; runs the scenario many times
    #[arg(long)]
    pub sufficient: bool,
    /// Number of starts of each candidate, perturbed but for the first; 1 where the trunk is held
    #[arg(
        long,
        value_name = "N",
        default_value_t = 5,
        value_parser = whole_number,
        requires = "sufficient"
    )]
    pub ensemble: usize,
    /// Approximate limit of the computation time of the search
    #[arg(
        long,
        value_name = "DURATION",
        default_value = "200 s",
        value_parser = seconds,
        requires = "sufficient"
    )]
    pub budget: f64,
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}
