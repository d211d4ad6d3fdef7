//! Options of a study of radii.
#![allow(clippy::doc_markdown, reason = "the text is printed verbatim")]

use std::path::PathBuf;

use clap::Args;
use twinrig_document::parse_quantity;
use twinrig_kernel::Unit;

use super::execute::radius;
use crate::error::Error;
use crate::options::request::{StudyContext, StudyFrame, StudyReport, StudyRequest, unique};
use crate::options::run::EngineArgs;
use crate::options::values::key_value;

/// Least and greatest precision.
const PRECISION: [f64; 2] = [1e-6, 0.5];

/// Precision without another one.
pub(crate) const DEFAULT_PRECISION: f64 = 0.01;

/// Find the least disturbance at which each expectation of a scenario fails
///
/// Runs the scenario with growing disturbances along several axes: latency, jitter and clocks
/// of the buses, friction, stiffness, payload, a push, noise of sensors, or any key. Between
/// the last value with which an expectation holds and the first with which it fails, it
/// bisects. Values below are tested, too: an expectation that fails and holds again beyond is
/// reported as not monotone. The same command continues an interrupted study.
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
    /// Engine of the runs.
    #[command(flatten)]
    pub engine: EngineArgs,
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

impl StudyRequest for RadiusOptions {
    fn frame(&self) -> StudyFrame<'_> {
        StudyFrame {
            name: "radius",
            scenarios: std::slice::from_ref(&self.scenario),
            plants: self.plant.as_slice(),
            set: &self.set,
            out: &self.out,
            json: self.json,
        }
    }

    fn check(&self) -> Result<(), Error> {
        unique("--axis", &self.axis)?;
        unique("--along", &self.along)
    }

    fn run(&self, context: StudyContext<'_>) -> Result<StudyReport, Error> {
        let request = self.request(self.frame().stem(), context.settings)?;
        let outcome = radius(context.registry, &request, context.observer)?;
        let file = self.scenario.display().to_string();
        let outcome = outcome.map_err(|source| Error::of_study(&file, source))?;
        Ok(outcome.report())
    }
}
