//! Arguments of `twin import`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// Arguments of `twin import`.
#[derive(Clone, Debug, Args)]
pub struct ImportArgs {
    /// Source format
    #[command(subcommand)]
    pub language: ImportCommand,
}

impl ImportArgs {
    /// Returns whether the command prints JSON instead of text.
    pub fn json(&self) -> bool {
        match &self.language {
            ImportCommand::Log(args) => args.json,
            ImportCommand::Urdf(_) | ImportCommand::Mjcf(_) => false,
        }
    }
}

/// Source format of an import.
#[derive(Clone, Debug, Subcommand)]
pub enum ImportCommand {
    /// Make a robot file of a URDF, the robot description of ROS
    ///
    /// The robot must be a quadruped with legs of two or three segments. Masses, lengths, limits
    /// and drives are taken from the file; springs, friction and the like, which it does not have,
    /// are marked as ASSUMED.
    Urdf(ImportFileArgs),
    /// Make a robot file of an MJCF, the format of MuJoCo, in one file
    ///
    /// As from a URDF. Masses are those of `inertial` or of simple shapes; tendons, equalities and
    /// contacts are not read.
    Mjcf(ImportFileArgs),
    /// Make recordings of logs of other programs: JSON, CSV, MCAP, bags of ROS 2
    ///
    /// A mapping says which columns or fields become which signals, and in which units they are.
    /// Times are those of the log; nothing is resampled. Gaps and repeated values are reported, and
    /// everything else that is missing is an error.
    Log(ImportLogArgs),
}

/// Arguments of an import from one file.
#[derive(Clone, Debug, Args)]
pub struct ImportFileArgs {
    /// File to read
    pub file: PathBuf,
    /// Name of the robot instead of that in the file
    #[arg(long, value_name = "NAME")]
    pub name: Option<String>,
    /// Write to OUT instead of robots/NAME.toml (without --name robots/FILE.toml); `-` for standard
    /// output
    #[arg(long, value_name = "OUT")]
    pub out: Option<PathBuf>,
}

/// Arguments of an import of logs.
#[derive(Clone, Debug, Args)]
pub struct ImportLogArgs {
    /// Logs: files, also compressed by gzip, or folders of rosbag2
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Mapping: the path of a file, or the name of one in the folder `mappings` or in the program
    #[arg(long, value_name = "MAPPING")]
    pub mapping: Option<String>,
    /// Write to this folder instead of `recordings`, or for one log to this file
    #[arg(long, value_name = "PATH")]
    pub out: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}
