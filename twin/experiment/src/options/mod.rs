//! Options that studies have in common.
#![allow(clippy::doc_markdown, reason = "the text is printed verbatim")]

pub mod request;
pub mod run;
pub mod values;

use std::path::PathBuf;

use clap::Args;
use twinrig_kernel::SimDuration;

use request::StudyFrame;
use run::RunOptions;
use values::{duration, key_value, seconds};

/// Options common to studies of gaits.
#[derive(Clone, Debug, Default, Args)]
pub struct CommonOptions {
    /// Study on this plant; may be repeated; without it, on the scenario's own
    #[arg(long, value_name = "MODEL", value_delimiter = ',')]
    pub plant: Vec<String>,
    /// Set a key of the scenario: controller.frequency="3 Hz"
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Engine of the runs.
    #[command(flatten)]
    pub runs: RunOptions,
    /// Folder for the HTML page, the CSV and the JSON file, and for the rows from which a study
    /// continues
    #[arg(long, value_name = "DIR", default_value = "studies")]
    pub out: PathBuf,
    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
}

impl CommonOptions {
    /// Returns the options that all studies have.
    pub(crate) fn frame<'s>(
        &'s self,
        name: &'static str,
        scenarios: &'s [PathBuf],
    ) -> StudyFrame<'s> {
        StudyFrame {
            name,
            scenarios,
            plants: &self.plant,
            set: &self.set,
            out: &self.out,
            json: self.json,
        }
    }
}

/// Options common to studies of plants and boards.
#[derive(Clone, Debug, Args)]
pub struct StudyOptions {
    /// Scenario file
    #[arg(value_name = "SCENARIO", default_value = "scenarios/passive-legs.toml")]
    pub scenario: PathBuf,
    /// Study this plant; may be repeated; without it, all plants of this build
    #[arg(long, value_name = "MODEL", value_delimiter = ',')]
    pub plant: Vec<String>,
    /// Set a key of the scenario: duration="300 ms"
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Simulated time: "300 ms" [default: precision the first 300 ms, stability 2 s, coupling 1 s,
    /// estimate the scenario]
    #[arg(long, value_name = "DURATION", value_parser = duration)]
    pub duration: Option<SimDuration>,
    /// Approximate limit of the computation time of all starts; rows truncated by it are reported
    #[arg(long, value_name = "DURATION", default_value = "200 s", value_parser = seconds)]
    pub budget: f64,
    /// Folder for the HTML page, the CSV and the JSON file, and for the rows from which a study
    /// continues
    #[arg(long, value_name = "DIR", default_value = "studies")]
    pub out: PathBuf,
    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
}

impl StudyOptions {
    /// Returns the options that all studies have.
    pub(crate) fn frame(&self, name: &'static str) -> StudyFrame<'_> {
        StudyFrame {
            name,
            scenarios: std::slice::from_ref(&self.scenario),
            plants: &self.plant,
            set: &self.set,
            out: &self.out,
            json: self.json,
        }
    }

    /// Returns the path of the scenario, for messages.
    pub(crate) fn file(&self) -> String {
        self.scenario.display().to_string()
    }
}
