//! Command-line arguments. The doc comments are the `--help` texts.
#![allow(clippy::doc_markdown, reason = "the text is printed verbatim")]

mod accept;
mod cell;
mod colour;
mod completions;
mod doctor;
mod draw;
mod examples;
mod export;
mod fit;
mod import;
mod list;
mod new;
mod optimize;
mod page;
mod plan;
mod report;
mod study;
mod sweep;
mod thesis;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use twinrig_experiment::options::values::{any_duration, duration, key_value, length, share};
use twinrig_kernel::SimDuration;

use crate::version::VERSION;

pub use accept::AcceptArgs;
pub use cell::{
    CellArgs, CellCalibrateArgs, CellCommand, CellCompareArgs, CellPredictArgs, ElectrodeName,
};
pub use colour::Colour;
pub use completions::{CompletionsArgs, ManArgs};
pub use doctor::DoctorArgs;
pub use draw::DrawArgs;
pub use examples::{ExamplesArgs, ExamplesCommand, ExamplesCopyArgs};
pub use export::{ExportArgs, ExportCommand, FmuArgs, MjcfArgs, RecordedArgs, UrdfArgs};
pub use fit::FitArgs;
pub use import::{ImportArgs, ImportCommand, ImportFileArgs, ImportLogArgs};
pub use list::ListArgs;
pub use new::{NewArgs, NewKind};
pub use optimize::OptimizeArgs;
pub use page::PagesOf;
pub use plan::PlanArgs;
pub use report::ReportArgs;
pub use study::StudyArgs;
pub use sweep::SweepArgs;
pub use thesis::{FlipMoves, ThesisArgs};

/// Co-simulates a legged robot, its controller and its I/O in virtual time and judges the run.
#[derive(Debug, Parser)]
#[command(name = "twin", version, long_version = VERSION, about)]
#[command(after_help = "Exit code: 0 all expectations hold, 1 an expectation fails, 2 error.")]
pub struct Cli {
    /// Colours of the output; auto: on terminals, unless NO_COLOR is set
    #[arg(long, global = true, value_name = "WHEN", default_value = "auto")]
    pub color: Colour,
    /// Command to execute.
    #[command(subcommand)]
    pub command: Command,
}

/// Command of the program.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run scenarios and evaluate their expectations
    Run(RunArgs),
    /// Show the simulated parts of a scenario, and those left out with the reason; find the
    /// cheapest sufficient plant
    Plan(PlanArgs),
    /// Validate scenarios without running them
    Check(CheckArgs),
    /// Make a controller, driver or plant (a crate), a scenario or a robot (a file) to begin with
    New(NewArgs),
    /// List the parts of this build; of a robot also what follows from its file
    List(ListArgs),
    /// Find the first sample in which two recordings differ, or the first footstep with --events
    Diff(DiffArgs),
    /// Write the page of a recording: robot, gait, expectations, signals and buses over time
    ///
    /// One HTML file that makes no request. The run is repeated with all signals where that is
    /// possible. Two recordings are shown side by side, aligned by their footsteps.
    Report(ReportArgs),
    /// Take recordings as the baseline of later runs (`twin run --against`), and print what moved
    ///
    /// Prints each footstep and signal beyond the tolerances, old and new, with the difference by
    /// which the runs part. The folder has the tolerances in baseline.toml.
    Accept(AcceptArgs),
    /// Repeat the run of a recording and check that the results are identical
    Replay(ReplayArgs),
    /// Watch and steer a run: pause, step, seek back, change process variables, branch
    ///
    /// Serves a page, and a WebSocket for Foxglove and its relatives. A change in the past of the
    /// run begins a branch, which is written as a scenario with a [[change]] for each act: `twin
    /// run` of it is the same run, bit for bit. Needs a build with the feature `live`.
    Live(LiveArgs),
    /// Emulate boards and plant in real time, with one pseudo-terminal (PTY) per bus, or a server
    ///
    /// Any program can open the PTY as a serial port, for example `twin run` with --port. With
    /// --listen, programs and other machines connect by TCP.
    Serve(ServeArgs),
    /// List the serial ports of this machine
    Devices(DevicesArgs),
    /// Check this machine: what the program needs for runs, real boards, real time and builds
    ///
    /// Exit code: 0 what this build needs is there, 1 something it needs is broken: a robot file,
    /// or MuJoCo's library. Notices, and problems of what only some work needs, do not count.
    Doctor(DoctorArgs),
    /// Measure plants (accuracy, speed, stability), filters of loads, and gaits
    Study(StudyArgs),
    /// Run a scenario at many points, and assert shares of the runs
    Sweep(SweepArgs),
    /// Search the settings of a scenario with the best value of an expectation
    Optimize(OptimizeArgs),
    /// Fit parameters of a twin to recordings, with their intervals
    ///
    /// The twin plays the commands of each recording at their own times, and its outputs are
    /// compared with the recorded signals at theirs. Prints the parameters with intervals of 95 %,
    /// the directions that the recordings cannot tell, and the residuals; writes them to a folder,
    /// with an overlay that robots and benches include.
    Fit(FitArgs),
    /// Draw a robot as SVG: a leg with its dimensions, extended and bent; side and top view
    Draw(DrawArgs),
    /// Write a robot or a scenario in the format of another program
    Export(ExportArgs),
    /// Make a robot file of a robot, or a recording of a log, in the format of another program
    Import(ImportArgs),
    /// Design cells of tactile sensors by the models of the thesis, calibrate and compare them
    Cell(CellArgs),
    /// Compare the printed figures of the thesis with ours
    ///
    /// Determines ours by scenarios, studies and closed forms. A verdict follows from both, and
    /// from what was free to differ: reproduced, consistent, recomputed, contradicted, misprint, or
    /// not run where the thesis does not print the data. Exit code: 0 all verdicts are those of the
    /// documentation, 1 one differs or nothing was observed.
    Thesis(ThesisArgs),
    /// List the scenarios that this program contains, and copy them to a folder
    Examples(ExamplesArgs),
    /// Print the JSON schema of the scenarios of this build, for editors
    ///
    /// The first line of a scenario references the schema file, relative to the folder of the
    /// scenario: "#:schema scenario.schema.json". The schema contains the process variables of the
    /// controllers for all robots found, or for the robots given with --robot.
    Schema(SchemaArgs),
    /// Print the completions of a shell
    ///
    /// bash: twin completions bash > ~/.local/share/bash-completion/completions/twin
    Completions(CompletionsArgs),
    /// Print the manual page, or write the pages of all commands
    Man(ManArgs),
}

impl Command {
    /// Returns whether the command simulates, which takes long in a debug build.
    pub fn simulates(&self) -> bool {
        match self {
            Self::Run(_)
            | Self::Replay(_)
            | Self::Report(_)
            | Self::Live(_)
            | Self::Serve(_)
            | Self::Study(_)
            | Self::Sweep(_)
            | Self::Optimize(_)
            | Self::Fit(_)
            | Self::Thesis(_) => true,
            Self::Plan(args) => args.sufficient,
            Self::Accept(_)
            | Self::Check(_)
            | Self::New(_)
            | Self::List(_)
            | Self::Diff(_)
            | Self::Devices(_)
            | Self::Doctor(_)
            | Self::Draw(_)
            | Self::Export(_)
            | Self::Import(_)
            | Self::Cell(_)
            | Self::Examples(_)
            | Self::Schema(_)
            | Self::Completions(_)
            | Self::Man(_) => false,
        }
    }

    /// Returns whether the command prints JSON instead of text.
    pub fn json(&self) -> bool {
        match self {
            Self::Run(args) => args.json,
            Self::Plan(args) => args.json,
            Self::Check(args) => args.json,
            Self::List(args) => args.json,
            Self::Diff(args) => args.json,
            Self::Accept(args) => args.json,
            Self::Replay(args) => args.json,
            Self::Report(args) => args.json,
            Self::Live(args) => args.json,
            Self::Devices(args) => args.json,
            Self::Cell(args) => args.json(),
            Self::Sweep(args) => args.json,
            Self::Optimize(args) => args.json,
            Self::Fit(args) => args.json,
            Self::Study(args) => args.study.request().frame().json,
            Self::Thesis(args) => args.json,
            Self::Doctor(args) => args.json,
            Self::Examples(args) => args.json,
            Self::Import(args) => args.json(),
            Self::New(_)
            | Self::Serve(_)
            | Self::Export(_)
            | Self::Schema(_)
            | Self::Draw(_)
            | Self::Completions(_)
            | Self::Man(_) => false,
        }
    }
}

/// Settings that override keys of a scenario file.
#[derive(Clone, Debug, Default, Args)]
pub struct Settings {
    /// Set a key of the scenario: plant.step="0.5 ms", seed=2
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Run with this plant; short for --set plant.model=MODEL
    #[arg(long, value_name = "MODEL")]
    pub plant: Option<String>,
}

/// Arguments of `twin run`.
#[derive(Clone, Debug, Default, Args)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "independent switches of a command line"
)]
pub struct RunArgs {
    /// Scenario files
    #[arg(required = true, value_name = "SCENARIO")]
    pub scenarios: Vec<PathBuf>,
    /// Set a key of the scenario: plant.step="0.5 ms", seed=2
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Run with this plant; short for --set plant.model=MODEL. If repeated, run each plant and
    /// compare each with the first, footstep by footstep
    #[arg(long, value_name = "MODEL", value_delimiter = ',')]
    pub plant: Vec<String>,
    /// Start the other plants at TIME from the state of the first plant, so that differences
    /// accumulated before TIME do not count. From there on the plants are compared; the
    /// expectations are evaluated for the first plant only
    #[arg(long, value_name = "TIME", value_parser = any_duration, conflicts_with = "port")]
    pub from: Option<SimDuration>,
    /// Seed of all random streams; short for --set seed=N
    #[arg(long, value_name = "N")]
    pub seed: Option<String>,
    /// Judge the expectations over N seeds; short for --set 'ensemble={runs=N,vary="seed"}'
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..=10_000), conflicts_with = "port")]
    pub seeds: Option<u64>,
    /// Judge the expectations over values drawn from the distribution that `twin fit` has written
    /// to FILE; short for --set 'ensemble={runs=200,fit="FILE"}'
    #[arg(long, value_name = "FILE", conflicts_with_all = ["seeds", "port"])]
    pub uncertain: Option<PathBuf>,
    /// Add the numerical error of each measured value, by runs at finer tolerances and steps. A
    /// verdict whose margin is less than three errors is undecided: exit code 1
    #[arg(long, conflicts_with_all = ["port", "from"])]
    pub error_bars: bool,
    /// Duration of the run; short for --set duration=DURATION
    #[arg(long, value_name = "DURATION")]
    pub duration: Option<String>,
    /// End the run at TIME; what begins or is judged later is left out. Short for --set
    /// until=TIME
    #[arg(long, value_name = "TIME")]
    pub until: Option<String>,
    /// End the command after DURATION of wall-clock time, as Ctrl-C does. The result then depends
    /// on the machine
    #[arg(long, value_name = "DURATION", value_parser = duration)]
    pub budget: Option<SimDuration>,
    /// Run in real time on the hardware at DEVICE instead of emulated boards and plant; one --port
    /// per bus. DEVICE is a path, /dev/ttyUSB0, or the address of a server: tcp://HOST:PORT, raw
    /// bytes, or rfc2217://HOST:PORT, which also sets the baud rate
    #[arg(long, value_name = "BUS=DEVICE", value_parser = key_value)]
    pub port: Vec<(String, String)>,
    /// Folder for recordings
    #[arg(long, value_name = "DIR", default_value = "recordings")]
    pub out: PathBuf,
    /// Do not write recordings
    #[arg(long, conflicts_with = "out")]
    pub no_record: bool,
    /// Compare each run with the recording of its name in DIR, which `twin accept` keeps there; a
    /// difference beyond the tolerances in DIR/baseline.toml is a failure. The name has seed, plant
    /// and settings. Not with --no-record or --port
    #[arg(long, value_name = "DIR", conflicts_with_all = ["no_record", "port"])]
    pub against: Option<PathBuf>,
    /// Write the page of each run beside its recording, as `twin report` does; with =failed, of
    /// those that do not pass. Not with --no-record
    #[arg(long, value_name = "OF", num_args = 0..=1, require_equals = true, default_missing_value = "all", conflicts_with = "no_record")]
    pub report: Option<PagesOf>,
    /// Fail where there is a warning, or a bus with errors, late answers, or boards that miss
    /// points
    #[arg(long)]
    pub strict: bool,
    /// Print one JSON object per scenario instead of a table
    #[arg(long)]
    pub json: bool,
    /// Also write the verdicts to FILE as JUnit XML
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
}

/// Arguments of `twin live`.
#[derive(Clone, Debug, Args)]
pub struct LiveArgs {
    /// Scenario file
    pub scenario: PathBuf,
    #[command(flatten)]
    pub settings: Settings,
    /// Address to listen at; another one than loopback lets other machines steer the run
    #[arg(long, value_name = "HOST", default_value = "127.0.0.1")]
    pub listen: String,
    /// Port of the WebSocket; 0: any that is free
    #[arg(long, value_name = "PORT", default_value_t = 8765)]
    pub socket: u16,
    /// Port of the page; 0: any that is free
    #[arg(long, value_name = "PORT", default_value_t = 8766)]
    pub page: u16,
    /// Run in real time on the hardware at DEVICE instead of emulated boards and plant; one --port
    /// per bus. DEVICE is a path, /dev/ttyUSB0, or the address of a server: tcp://HOST:PORT, raw
    /// bytes, or rfc2217://HOST:PORT, which also sets the baud rate
    #[arg(long, value_name = "BUS=DEVICE", value_parser = key_value, conflicts_with_all = ["speed", "paused", "memory"])]
    pub port: Vec<(String, String)>,
    /// Simulated time over wall-clock time; 0: as fast as possible
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = speed)]
    pub speed: f64,
    /// Begin with time standing still
    #[arg(long)]
    pub paused: bool,
    /// Memory for saved states [MiB]: with less, going back simulates more again
    #[arg(long, value_name = "MIB", default_value_t = 64, value_parser = clap::value_parser!(u16).range(1..))]
    pub memory: u16,
    /// Folder for the scenarios of branches, and for the recording of a run on hardware
    #[arg(long, value_name = "DIR", default_value = "live")]
    pub out: PathBuf,
    /// Print the addresses as a JSON object, and the report of a run on hardware as another one
    #[arg(long)]
    pub json: bool,
}

/// Parses a factor of time.
fn speed(text: &str) -> Result<f64, String> {
    let speed: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if (0.0..=1000.0).contains(&speed) {
        return Ok(speed);
    }
    Err("not from 0 to 1000".to_owned())
}

/// Arguments of `twin serve`.
#[derive(Clone, Debug, Args)]
pub struct ServeArgs {
    /// Scenario file
    pub scenario: PathBuf,
    #[command(flatten)]
    pub settings: Settings,
    /// Create a symbolic link PATH to the PTY of a bus
    #[arg(long, value_name = "BUS=PATH", value_parser = key_value)]
    pub pty: Vec<(String, String)>,
    /// Serve a bus over a network instead, to one client at a time: sbcp=tcp://4000, raw bytes, or
    /// sbcp=rfc2217://4000, with settings of the port. tcp://HOST:PORT listens at an address other
    /// than loopback, by which other machines reach the boards; port 0: any that is free
    #[arg(long, value_name = "BUS=ADDRESS", value_parser = key_value)]
    pub listen: Vec<(String, String)>,
    /// Time after the first received byte for which the robot is held in its start pose, so that
    /// boards can be configured and calibrated
    #[arg(long, value_name = "DURATION", value_parser = any_duration, default_value = "400 ms")]
    pub hold: SimDuration,
    /// Keep running when the program closes the port, and wait for the next connection
    #[arg(long)]
    pub keep: bool,
    /// Real-time scheduling priority, 1 to 99: programs of lower or no real-time priority cannot
    /// delay the twin. A twin that is slower than real time then starves all other programs
    #[arg(long, value_parser = clap::value_parser!(u8).range(1..=99))]
    pub priority: Option<u8>,
}

/// Arguments of `twin devices`.
#[derive(Clone, Debug, Args)]
pub struct DevicesArgs {
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `twin check`.
#[derive(Clone, Debug, Args)]
pub struct CheckArgs {
    /// Scenario files
    #[arg(required = true, value_name = "SCENARIO")]
    pub scenarios: Vec<PathBuf>,
    #[command(flatten)]
    pub settings: Settings,
    /// Treat warnings as errors
    #[arg(long)]
    pub strict: bool,
    /// Print one JSON object per scenario
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `twin diff`.
#[derive(Clone, Debug, Args)]
pub struct DiffArgs {
    /// First recording
    pub a: PathBuf,
    /// Second recording
    pub b: PathBuf,
    /// Compare footstep by footstep instead of bit by bit: the first differing footstep,
    /// differences in time and position, and the divergence of signals. Exit code 0 if all
    /// footsteps agree within --time and --place
    #[arg(long)]
    pub events: bool,
    /// Tolerance for the times of touch-down and lift-off
    #[arg(long, value_name = "TIME", value_parser = any_duration, default_value = "5 ms", requires = "events")]
    pub time: SimDuration,
    /// Tolerance for the positions of footsteps
    #[arg(long, value_name = "LENGTH", value_parser = length, default_value = "5 mm", requires = "events")]
    pub place: f64,
    /// Tolerance for signals, as a share of their range; without it signals are judged only if
    /// there are no footsteps, with 1 %
    #[arg(long, value_name = "SHARE", value_parser = share, requires = "events")]
    pub share: Option<f64>,
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `twin replay`.
#[derive(Clone, Debug, Args)]
pub struct ReplayArgs {
    /// Recording
    pub recording: PathBuf,
    /// Print a JSON object
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `twin schema`.
#[derive(Clone, Debug, Args)]
pub struct SchemaArgs {
    /// Name of a robot, or path of a robot file, for which the schema contains process variables;
    /// may be repeated
    #[arg(long, value_name = "ROBOT")]
    pub robot: Vec<String>,
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn command_line_definition_is_consistent() {
        Cli::command().debug_assert();
    }
}
