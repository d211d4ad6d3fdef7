//! The command line. Its doc comments are the help that `--help` prints.
#![allow(clippy::doc_markdown, reason = "it is printed as it stands")]

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use twinrig_document::{parse_duration, parse_quantity};
use twinrig_kernel::{SimDuration, Unit};

/// Runs a legged robot, its controller and its I/O together in virtual time, and judges the run.
#[derive(Debug, Parser)]
#[command(name = "twin", version, about, disable_help_subcommand = true)]
#[command(after_help = "Exit code: 0 all expectations hold, 1 one fails, 2 something is wrong.")]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run scenarios and say whether their expectations hold
    Run(RunArgs),
    /// Say what is in the scene of a scenario, and what is left out and why; run nothing
    Plan(PlanArgs),
    /// Say whether scenarios are sound; run nothing
    Check(CheckArgs),
    /// List the plants, controllers and robots of this build
    List(ListArgs),
    /// Find the first sample in which two recordings differ, or with --events the first footstep
    Diff(DiffArgs),
    /// Run a recording again and say whether everything happens as it did
    Replay(ReplayArgs),
    /// Emulate boards and plant in real time, each bus at a PTY
    ///
    /// A program opens it like a serial port: `twin run` with --port, or any other.
    Serve(ServeArgs),
    /// List the serial ports of this machine
    Devices(DevicesArgs),
    /// Find out how precise, how fast and how stable plants are
    Study(StudyArgs),
    /// Write a robot in the language of another program
    Export(ExportArgs),
    /// Print the JSON schema of the scenarios of this build, for editors
    ///
    /// A scenario names the file that it was written to in its first line, seen from its own folder: "#:schema
    /// scenario.schema.json". Process variables are those that controllers have on the robots that are in reach, or on
    /// those that are named.
    Schema(SchemaArgs),
}

impl Command {
    /// Whether it prints an object for a program, and no text for a person.
    pub fn json(&self) -> bool {
        match self {
            Self::Run(args) => args.json,
            Self::Plan(args) => args.json,
            Self::Check(args) => args.json,
            Self::List(args) => args.json,
            Self::Diff(args) => args.json,
            Self::Replay(args) => args.json,
            Self::Devices(args) => args.json,
            Self::Study(StudyArgs {
                study:
                    StudyCommand::Precision(options)
                    | StudyCommand::Stability(options)
                    | StudyCommand::Coupling(options),
            }) => options.json,
            Self::Serve(_) | Self::Export(_) | Self::Schema(_) => false,
        }
    }
}

/// What is set on top of a scenario file.
#[derive(Clone, Debug, Default, Args)]
pub struct Settings {
    /// Set a key of the scenario: plant.step="0.5 ms"
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Run with this plant; short for --set plant.model=MODEL
    #[arg(long, value_name = "MODEL")]
    pub plant: Option<String>,
}

/// `twin run`
#[derive(Clone, Debug, Default, Args)]
pub struct RunArgs {
    /// Scenario files
    #[arg(required = true, value_name = "SCENARIO")]
    pub scenarios: Vec<PathBuf>,
    /// Set a key of the scenario: plant.step="0.5 ms"
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Run with this plant; short for --set plant.model=MODEL. Given several times, run with each and compare each with the
    /// first, footstep by footstep
    #[arg(long, value_name = "MODEL")]
    pub plant: Vec<String>,
    /// Run with the first plant to here, and put the others where it is then: they differ from it by themselves and not by
    /// what came before. What they do from there is compared and not judged
    #[arg(long, value_name = "TIME", value_parser = any_duration, conflicts_with = "port")]
    pub from: Option<SimDuration>,
    /// Talk in real time to hardware at DEVICE instead of the emulated boards of a bus and the plant; once for each bus
    #[arg(long, value_name = "BUS=DEVICE", value_parser = key_value)]
    pub port: Vec<(String, String)>,
    /// Folder for recordings
    #[arg(long, value_name = "DIR", default_value = "recordings")]
    pub out: PathBuf,
    /// Record nothing
    #[arg(long, conflicts_with = "out")]
    pub no_record: bool,
    /// Print one JSON object a scenario, and no table
    #[arg(long)]
    pub json: bool,
    /// Write the verdicts to FILE, too, in the XML of JUnit
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
}

/// `twin serve`
#[derive(Clone, Debug, Args)]
pub struct ServeArgs {
    /// Scenario file
    pub scenario: PathBuf,
    #[command(flatten)]
    pub settings: Settings,
    /// Make the port of a bus known as PATH, too
    #[arg(long, value_name = "BUS=PATH", value_parser = key_value)]
    pub pty: Vec<(String, String)>,
    /// Hold the robot in its start so long after the first byte, for boards to be configured and calibrated
    #[arg(long, value_name = "DURATION", value_parser = any_duration, default_value = "400 ms")]
    pub hold: SimDuration,
    /// Go on when the program at the port hangs up, and wait for the next one
    #[arg(long)]
    pub keep: bool,
    /// Put the twin before all programs without a real-time priority, and those with one below this, 1 to 99: others do not
    /// delay it then, but one that is slower than real time keeps the machine from everything else
    #[arg(long, value_parser = clap::value_parser!(u8).range(1..=99))]
    pub priority: Option<u8>,
}

/// `twin devices`
#[derive(Clone, Debug, Args)]
pub struct DevicesArgs {
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}

/// `twin plan`
#[derive(Clone, Debug, Args)]
pub struct PlanArgs {
    /// Scenario file
    pub scenario: PathBuf,
    #[command(flatten)]
    pub settings: Settings,
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}

/// `twin check`
#[derive(Clone, Debug, Args)]
pub struct CheckArgs {
    /// Scenario files
    #[arg(required = true, value_name = "SCENARIO")]
    pub scenarios: Vec<PathBuf>,
    #[command(flatten)]
    pub settings: Settings,
    /// Take warnings for errors
    #[arg(long)]
    pub strict: bool,
    /// Print one JSON object a scenario
    #[arg(long)]
    pub json: bool,
}

/// `twin list`
#[derive(Clone, Debug, Args)]
pub struct ListArgs {
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}

/// `twin diff`
#[derive(Clone, Debug, Args)]
pub struct DiffArgs {
    /// A recording
    pub a: PathBuf,
    /// Another
    pub b: PathBuf,
    /// Compare footstep by footstep what is not meant to be the same bit for bit: which differs first, by how much in time and
    /// place, and how signals drift apart. Exit code 0 if every footstep is the same within --time and --place
    #[arg(long)]
    pub events: bool,
    /// Footsteps are the same if touch-down and lift-off are no farther apart
    #[arg(long, value_name = "TIME", value_parser = any_duration, default_value = "5 ms", requires = "events")]
    pub time: SimDuration,
    /// Footsteps are the same if their places are no farther apart
    #[arg(long, value_name = "LENGTH", value_parser = length, default_value = "5 mm", requires = "events")]
    pub place: f64,
    /// Signals count, too, if they differ by more than this share of their range; 1 % where there are no footsteps
    #[arg(long, value_name = "SHARE", value_parser = share, requires = "events")]
    pub share: Option<f64>,
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}

/// `twin replay`
#[derive(Clone, Debug, Args)]
pub struct ReplayArgs {
    /// A recording
    pub recording: PathBuf,
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}

/// `twin export`
#[derive(Clone, Debug, Args)]
pub struct ExportArgs {
    /// Which language
    #[command(subcommand)]
    pub language: ExportCommand,
}

/// Which language.
#[derive(Clone, Debug, Subcommand)]
pub enum ExportCommand {
    /// MuJoCo's: the robot on flat ground, its drives held where they start
    Mjcf(MjcfArgs),
}

/// `twin export mjcf`
#[derive(Clone, Debug, Args)]
pub struct MjcfArgs {
    /// A robot's name, or the path of its file
    pub robot: String,
    /// Segments that pins hold together, or joint angles
    #[arg(long, value_name = "WHICH", value_parser = ["maximal", "minimal"], default_value = "maximal")]
    pub coordinates: String,
    /// Write to FILE instead of to where commands write
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// `twin schema`
#[derive(Clone, Debug, Args)]
pub struct SchemaArgs {
    /// A robot's name, or the path of its file, whose controllers' process variables the schema has; several may be named
    #[arg(long, value_name = "ROBOT")]
    pub robot: Vec<String>,
}

/// `twin study`
#[derive(Clone, Debug, Args)]
pub struct StudyArgs {
    /// Which study
    #[command(subcommand)]
    pub study: StudyCommand,
}

/// Which study.
#[derive(Clone, Debug, Subcommand)]
pub enum StudyCommand {
    /// Error of each plant, method and step against its run time
    ///
    /// Leads every plant through the scene by each of its methods at each of many steps or tolerances, and compares where the
    /// feet are with the best method at its finest setting, which a second method checks. A controller's commands are
    /// recorded once and played to all. What fails or takes too long is a row that says so.
    Precision(StudyOptions),
    /// Largest stable step of each plant and method, and what limits it
    ///
    /// Searches for the longest step at which the motion stays bounded, while stiffness, masses, damping, gain, friction or
    /// restitution of the robot and its ground are varied, one at a time. A limit at which the feet are not where they
    /// should be is marked as wrong.
    Stability(StudyOptions),
    /// What it costs, and what it saves, if plant and boards meet on a grid
    ///
    /// Runs the whole rig, controller, drivers and boards included, with the plant moved to each of their instants and with
    /// the plant on grids of many steps, and compares where feet and trunk are with exact coupling at a fine step of the
    /// plant, which a step twice as long checks.
    #[command(mut_arg("scenario", |scenario| scenario.default_value("scenarios/oncilla-clocks.toml")))]
    Coupling(StudyOptions),
}

/// What a study is told.
#[derive(Clone, Debug, Args)]
pub struct StudyOptions {
    /// Scenario file
    #[arg(value_name = "SCENARIO", default_value = "scenarios/passive-legs.toml")]
    pub scenario: PathBuf,
    /// Study this plant, and others that are named so; all of this build if none is
    #[arg(long, value_name = "MODEL")]
    pub plant: Vec<String>,
    /// Set a key of the scenario: duration="300 ms"
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Simulate so much: "300 ms" [default: precision the first 300 ms, stability 2 s, coupling 1 s]
    #[arg(long, value_name = "DURATION", value_parser = duration)]
    pub duration: Option<SimDuration>,
    /// Take at most about so many seconds; what is cut for it is shown
    #[arg(long, value_name = "SECONDS", default_value_t = 200.0, value_parser = seconds)]
    pub budget: f64,
    /// Folder for the page, the CSV and the JSON
    #[arg(long, value_name = "DIR", default_value = "studies")]
    pub out: PathBuf,
    /// Print the JSON, and no table
    #[arg(long)]
    pub json: bool,
}

fn any_duration(text: &str) -> Result<SimDuration, String> {
    parse_duration(text).map_err(|error| error.to_string())
}

fn duration(text: &str) -> Result<SimDuration, String> {
    let duration = any_duration(text)?;
    if duration.is_zero() {
        return Err("nothing happens in no time".to_owned());
    }
    Ok(duration)
}

fn length(text: &str) -> Result<f64, String> {
    no_less_than_nothing(text, Unit::Meter)
}

fn share(text: &str) -> Result<f64, String> {
    no_less_than_nothing(text, Unit::One)
}

fn no_less_than_nothing(text: &str, unit: Unit) -> Result<f64, String> {
    let value = parse_quantity(text, unit).map_err(|error| error.to_string())?;
    if value < 0.0 {
        return Err("it must not be negative".to_owned());
    }
    Ok(value)
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(seconds) if seconds > 0.0 && seconds < 1e6 => Ok(seconds),
        _ => Err("it must be a number of seconds above 0 and below 1000000".to_owned()),
    }
}

fn key_value(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => {
            Ok((key.trim().to_owned(), value.trim().to_owned()))
        }
        _ => Err("there is no `=` behind a key".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_sound() {
        Cli::command().debug_assert();
    }

    #[test]
    fn a_setting_is_split_at_its_first_sign() {
        let parsed = key_value("plant.step = a=b").unwrap();
        assert_eq!(parsed, ("plant.step".to_owned(), "a=b".to_owned()));
        assert!(key_value("plant.step").is_err() && key_value("=1").is_err());
    }
}
