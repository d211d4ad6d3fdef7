//! Arguments of `twin study radius`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;
use twinrig_document::parse_quantity;
use twinrig_kernel::Unit;

use super::key_value;

/// Least and greatest precision.
const PRECISION: [f64; 2] = [1e-6, 0.5];

/// Precision without another one.
pub(crate) const DEFAULT_PRECISION: f64 = 0.01;

/// Options of a study of radii.
#[derive(Clone, Debug, Args)]
pub struct RadiusOptions {
    /// Scenario file
    #[arg(value_name = "SCENARIO")]
    pub scenario: PathBuf,
    /// Disturb the scenario by this; may be repeated [default: all that apply, unless there is an
    /// --along]
    #[arg(long, value_name = "NAME")]
    pub axis: Vec<String>,
    /// Disturb this key or process variable of the scenario, from its value there or from VALUE;
    /// may be repeated, each with its --to
    #[arg(long, value_name = "KEY[=VALUE]")]
    pub along: Vec<String>,
    /// Value of the key with the greatest disturbance
    #[arg(
        long,
        value_name = "VALUE",
        requires = "along",
        allow_hyphen_values = true
    )]
    pub to: Vec<String>,
    /// Distance of the values between which an expectation fails, as a share of the size of the
    /// disturbance
    #[arg(long, value_name = "SHARE", default_value_t = DEFAULT_PRECISION, value_parser = precision)]
    pub precision: f64,
    /// Study on this plant instead of the scenario's own
    #[arg(long, value_name = "MODEL")]
    pub plant: Option<String>,
    /// Set a key of the scenario: duration="10 s"
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Number of runs at the same time, without influence on the results
    /// [default: number of processors]
    #[arg(long, value_name = "N")]
    pub jobs: Option<NonZeroUsize>,
    /// Folder for the HTML page, the CSV, the JSON and the Markdown file, and for the rows from
    /// which a study continues
    #[arg(long, value_name = "DIR", default_value = "studies")]
    pub out: PathBuf,
    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
}

fn precision(text: &str) -> Result<f64, String> {
    let share = parse_quantity(text, Unit::One).map_err(|error| error.to_string())?;
    let [least, greatest] = PRECISION;
    if (least..=greatest).contains(&share) {
        Ok(share)
    } else {
        Err(format!("it must be from {least} to {greatest}"))
    }
}
