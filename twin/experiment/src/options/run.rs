//! Options of runs that an engine does.
#![allow(clippy::doc_markdown, reason = "the text is printed verbatim")]

use std::num::NonZeroUsize;

use clap::Args;
use twinrig_campaign::engine::{EngineOptions, LocalEngine};
use twinrig_campaign::sweep::Partition;

/// Engine of runs.
#[derive(Clone, Debug, Args)]
pub struct EngineArgs {
    /// Engine of the runs, without influence on the results: `local`, the threads of this program,
    /// or `ray`, the workers of a Ray cluster (Python package only)
    #[arg(long, value_name = "ENGINE", default_value = LocalEngine::NAME)]
    pub engine: String,
    /// Ray cluster: `auto`, the one that this machine belongs to, or HOST:PORT
    /// [default: a Ray of its own on this machine, or the one in RAY_ADDRESS]
    #[arg(long, value_name = "ADDRESS")]
    pub address: Option<String>,
    /// Number of runs at the same time, without influence on the results
    /// [default: number of processors, or of the cluster's CPUs]
    #[arg(long, value_name = "N")]
    pub jobs: Option<NonZeroUsize>,
}

impl Default for EngineArgs {
    /// The threads of this program, one for each processor.
    fn default() -> Self {
        Self {
            engine: LocalEngine::NAME.to_owned(),
            address: None,
            jobs: None,
        }
    }
}

impl EngineArgs {
    /// Returns the settings of the engine.
    pub fn options(&self) -> EngineOptions {
        EngineOptions {
            jobs: self.jobs,
            address: self.address.clone(),
        }
    }
}

/// Engine of the runs of a study, and the share of this process.
#[derive(Clone, Debug, Args)]
pub struct RunOptions {
    /// Engine.
    #[command(flatten)]
    pub engine: EngineArgs,
    /// Do every n-th run only, beginning with the i-th, on one of n machines with a common folder;
    /// the last one has the result
    #[arg(long, value_name = "I/N", default_value = "1/1")]
    pub partition: Partition,
}

impl Default for RunOptions {
    /// All runs, on the threads of this program.
    fn default() -> Self {
        Self {
            engine: EngineArgs::default(),
            partition: Partition::WHOLE,
        }
    }
}
