//! Arguments of `twin export`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::Settings;

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
    /// URDF, the robot description of ROS: the tree of links and joints with masses, inertia and
    /// limits
    ///
    /// URDF has trees only. The parallel rod of each leg is replaced by an ankle that mimics the
    /// knee, as the closed pantograph does; springs, stops and cable are comments.
    Urdf(UrdfArgs),
    /// FMU for co-simulation by FMI: the plant of a scenario, or its whole rig
    ///
    /// The FMU contains the library libtwinrig_fmu.so, the scenario and its robot, and needs
    /// neither this program nor the files from which it was made.
    Fmu(FmuArgs),
    /// CSV, tables of text: the signals of a recording, a file for each of its groups of signals
    Csv(RecordedArgs),
    /// NPZ, the archive of NumPy: the signals of a recording as arrays GROUP/SIGNAL, with the times
    /// GROUP/time
    Npz(RecordedArgs),
}

/// Arguments of `twin export csv` and `twin export npz`.
#[derive(Clone, Debug, Args)]
pub struct RecordedArgs {
    /// Recording
    pub recording: PathBuf,
    /// Write to this folder (CSV) or file (NPZ) instead of NAME-GROUP.csv or NAME.npz in the
    /// present folder, with the name of the recording
    #[arg(long, value_name = "PATH")]
    pub out: Option<PathBuf>,
}

/// Arguments of `twin export fmu`.
#[derive(Clone, Debug, Args)]
pub struct FmuArgs {
    /// Scenario file
    pub scenario: PathBuf,
    /// Part of the scenario: the plant alone, whose inputs are its commands, or the whole rig with
    /// controller, driver, wire and boards, whose inputs are the process variables of the
    /// controller
    #[arg(long, value_name = "PART", value_parser = ["plant", "rig"], default_value = "plant")]
    pub part: String,
    /// Version of FMI
    #[arg(long, value_name = "VERSION", value_parser = ["2", "3"], default_value = "2")]
    pub fmi: String,
    #[command(flatten)]
    pub settings: Settings,
    /// Write to FILE instead of NAME.fmu in the present folder, with the name of the scenario file
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Library of FMUs, instead of libtwinrig_fmu.so beside this program
    #[arg(long, value_name = "FILE")]
    pub library: Option<PathBuf>,
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

/// Arguments of `twin export urdf`.
#[derive(Clone, Debug, Args)]
pub struct UrdfArgs {
    /// Name of a robot, or path of a robot file
    pub robot: String,
    /// Write to FILE instead of standard output
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}
