//! Arguments of `twin cell`.

use std::path::PathBuf;

use clap::{ArgAction, Args, Subcommand, ValueEnum};
use twinrig_document::parse_quantity;
use twinrig_experiment::options::values::{key_value, whole_number};
use twinrig_kernel::Unit;

/// Arguments of `twin cell`.
#[derive(Clone, Debug, Args)]
pub struct CellArgs {
    /// What to do
    #[command(subcommand)]
    pub command: CellCommand,
}

/// Function of `twin cell`.
#[derive(Clone, Debug, Subcommand)]
pub enum CellCommand {
    /// Print tables 4.4 and 4.5 of the thesis, the latter beside figures recomputed from the former
    ///
    /// Responses of the 16 cells to coded factors, aliases of the design, coefficients and analysis
    /// of variance by least squares, and what backward elimination at 10 % selects.
    Fit(CellFitArgs),
    /// Predict sensitivity, base conductance, saturation load and amplifier output of a cell
    ///
    /// By the models of table 4.5, with 95 % prediction intervals. A design outside the tested
    /// range is predicted all the same, and reported.
    Predict(CellPredictArgs),
    /// Identify the cells of a sensor on a bench and write their constants for filters
    ///
    /// Runs a bench with a tactile bus while the frequency of the load changes, fits both cells to
    /// the forces of the reference cell, and writes the constants with the name, the seed and the
    /// fingerprint of the run. Filters of scenarios name the file: `calibration = "NAME"`.
    Calibrate(CellCalibrateArgs),
    /// Compare the filters of a scenario over drawn cells, by their own calibration and by a common
    /// one
    ///
    /// For each cell, one run of another scenario identifies it, with another seed, and one run of
    /// the scenario gives the samples to all its filters: with the constants of that cell, and with
    /// those of the design. Prints the share of the cells whose error meets a limit at each
    /// frequency, with its 95 % interval.
    Compare(CellCompareArgs),
}

/// Arguments of `twin cell calibrate`.
#[derive(Clone, Debug, Args)]
pub struct CellCalibrateArgs {
    /// Scenario of the identification
    #[arg(
        value_name = "SCENARIO",
        default_value = "scenarios/thesis/fig-4-11.toml"
    )]
    pub scenario: PathBuf,
    /// Set a key of the scenario: plant.cell=1, seed=2
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// File of the calibration; without it, standard output
    #[arg(long, short, value_name = "FILE")]
    pub output: Option<PathBuf>,
}

/// Arguments of `twin cell compare`.
#[derive(Clone, Debug, Args)]
pub struct CellCompareArgs {
    /// Scenario with the filters, each with a calibration
    #[arg(value_name = "SCENARIO", default_value = "scenarios/bench.toml")]
    pub scenario: PathBuf,
    /// Scenario of the identification
    #[arg(
        long,
        value_name = "SCENARIO",
        default_value = "scenarios/thesis/fig-4-11.toml"
    )]
    pub identify: PathBuf,
    /// Number of cells: 1 to N
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = whole_number)]
    pub cells: usize,
    /// Greatest error that meets the demand, root mean square
    #[arg(long, value_name = "FORCE", value_parser = force, default_value = "200 mN")]
    pub limit: f64,
    /// Set a key of the scenario
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `twin cell fit`.
#[derive(Clone, Debug, Args)]
pub struct CellFitArgs {
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `twin cell predict`.
#[derive(Clone, Debug, Args)]
pub struct CellPredictArgs {
    /// Shape of the electrodes: strips at two sides (A) or interleaved strips (B)
    #[arg(long = "type", value_name = "TYPE", ignore_case = true)]
    pub electrode: ElectrodeName,
    /// Number of layers of the foil
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub layers: u32,
    /// Whether conductive glue holds the electrodes
    #[arg(long, value_name = "yes|no", action = ArgAction::Set, value_parser = yes)]
    pub glue: bool,
    /// Length, between the main conductors: "20 mm"
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    pub length: f64,
    /// Width, along the main conductors: "25 mm"
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    pub width: f64,
    /// Feedback resistor of the amplifier
    #[arg(long, value_name = "RESISTANCE", value_parser = resistance, default_value = "75 kΩ")]
    pub feedback: f64,
    /// Reference voltage of the amplifier
    #[arg(long, value_name = "VOLTAGE", value_parser = voltage, default_value = "250 mV")]
    pub reference: f64,
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}

/// Shape of the electrodes.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum ElectrodeName {
    /// Type A
    #[value(name = "A")]
    A,
    /// Type B
    #[value(name = "B")]
    B,
}

impl CellArgs {
    /// Returns whether JSON is printed.
    pub fn json(&self) -> bool {
        match &self.command {
            CellCommand::Fit(args) => args.json,
            CellCommand::Predict(args) => args.json,
            CellCommand::Calibrate(_) => false,
            CellCommand::Compare(args) => args.json,
        }
    }
}

fn yes(text: &str) -> Result<bool, String> {
    match text {
        "yes" => Ok(true),
        "no" => Ok(false),
        _ => Err("`yes` or `no` is required".to_owned()),
    }
}

fn length(text: &str) -> Result<f64, String> {
    positive(text, Unit::Meter)
}

fn resistance(text: &str) -> Result<f64, String> {
    positive(text, Unit::Ohm)
}

fn voltage(text: &str) -> Result<f64, String> {
    positive(text, Unit::Volt)
}

fn force(text: &str) -> Result<f64, String> {
    positive(text, Unit::Newton)
}

fn positive(text: &str, unit: Unit) -> Result<f64, String> {
    let value = parse_quantity(text, unit).map_err(|error| error.to_string())?;
    if value <= 0.0 {
        return Err("it must be positive".to_owned());
    }
    Ok(value)
}
