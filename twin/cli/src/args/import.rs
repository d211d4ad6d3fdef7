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
