//! Option `--report`.

use clap::ValueEnum;
use twinrig_rig::report::Status;

/// Runs of which `twin run` writes a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PagesOf {
    /// Every run.
    All,
    /// Runs that do not pass.
    Failed,
}

impl PagesOf {
    /// Returns whether a run with this verdict has a page.
    pub fn includes(self, verdict: Status) -> bool {
        self == Self::All || verdict != Status::Pass
    }
}
