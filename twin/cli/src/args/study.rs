//! Arguments of `twin study`.

use clap::Args;
use twinrig_experiment::StudyCommand;

/// Arguments of `twin study`.
#[derive(Clone, Debug, Args)]
pub struct StudyArgs {
    /// Kind of study
    #[command(subcommand)]
    pub study: StudyCommand,
}
