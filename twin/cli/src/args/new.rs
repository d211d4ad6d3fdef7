//! Arguments of `twin new`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

/// Arguments of `twin new`.
#[derive(Clone, Debug, Args)]
pub struct NewArgs {
    /// What to make
    pub kind: NewKind,
    /// Its name: small letters, digits, `-` and `_`
    pub name: String,
    /// Folder in which it is made
    #[arg(long = "in", value_name = "DIR", default_value = ".")]
    pub folder: PathBuf,
    /// Robot of the scenario: a name, or the path of a robot file
    #[arg(long, value_name = "ROBOT")]
    pub robot: Option<String>,
    /// Clone of Twinrig that the crate depends on; without it, the one from which this program was
    /// built, if this program or DIR is in it, else the crate of this version
    #[arg(long, value_name = "PATH")]
    pub twinrig: Option<PathBuf>,
}

/// Kind of thing to make.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum NewKind {
    /// Crate with a controller
    Controller,
    /// Crate with a serial device: protocol, driver, emulated device
    Driver,
    /// Crate with a plant: a model of physics of your own
    Plant,
    /// Scenario file in which a robot stands and bends its legs
    Scenario,
    /// Robot file, robots/NAME.toml
    Robot,
}
