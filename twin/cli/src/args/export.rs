//! Arguments of `twin export`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// Arguments of `twin export`.
#[derive(Clone, Debug, Args)]
pub struct ExportArgs {
    /// Target format
    #[command(subcommand)]
    pub language: ExportCommand,
}

/// Target format of an export.
#[derive(Clone, Debug, Subcommand)]
pub enum ExportCommand {
    /// MJCF, the format of MuJoCo: the robot on flat ground, its drives held at their start
    /// positions
    Mjcf(MjcfArgs),
}

/// Arguments of `twin export mjcf`.
#[derive(Clone, Debug, Args)]
pub struct MjcfArgs {
    /// Name of a robot, or path of a robot file
    pub robot: String,
    /// Coordinates: maximal (segments connected by pin constraints) or minimal (joint angles)
    #[arg(long, value_name = "WHICH", value_parser = ["maximal", "minimal"], default_value = "maximal")]
    pub coordinates: String,
    /// Write to FILE instead of standard output
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}
