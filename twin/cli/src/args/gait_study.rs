//! Arguments of studies of gaits.

use std::path::PathBuf;

use clap::Args;
use twinrig_kernel::SimDuration;

use super::{any_duration, deviation, duration, key_value, plateau, whole_number};

/// One gait on true, measured and estimated loads.
const FEEDBACK: [&str; 3] = [
    "scenarios/tegotae-trot.toml",
    "scenarios/tegotae-force.toml",
    "scenarios/tegotae-tactile.toml",
];

/// Options of a study of footstep modulation.
#[derive(Clone, Debug, Args)]
pub struct ModulationOptions {
    /// Scenario files with a gait; several are compared
    #[arg(value_name = "SCENARIO", default_value = "scenarios/step-change.toml")]
    pub scenarios: Vec<PathBuf>,
    /// Study on this plant; may be repeated; without it, on the scenario's own
    #[arg(long, value_name = "MODEL", value_delimiter = ',')]
    pub plant: Vec<String>,
    /// Set a key of the scenarios: controller.frequency="3 Hz"
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Process variable that changes [default: that of the scenario's first change, or
    /// `step_length`]
    #[arg(long, value_name = "VARIABLE")]
    pub variable: Option<String>,
    /// Changes, separated by commas: --by="-5 mm,-10 mm" [default: nine lengths from -2.5 mm to
    /// -40 mm, as in the thesis]
    #[arg(
        long,
        value_name = "CHANGES",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    pub by: Vec<String>,
    /// Time from which the gait is in its limit cycle; the run without the change lasts 20 s longer
    /// [default: that of the scenario's first change, or 8 s]
    #[arg(long, value_name = "TIME", value_parser = any_duration)]
    pub after: Option<SimDuration>,
    /// Points of the gait cycle at which the variable changes
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = whole_number)]
    pub points: usize,
    /// Footsteps of each leg after the change
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = whole_number)]
    pub steps: usize,
    /// Repeat the study without saturation of servos and without feedback of loads; without it, if
    /// there are several scenarios or plants
    #[arg(long)]
    pub factors: bool,
    /// Folder for the HTML page, the CSV and the JSON file
    #[arg(long, value_name = "DIR", default_value = "studies")]
    pub out: PathBuf,
    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
}

/// Options of a study of load feedback.
#[derive(Clone, Debug, Args)]
pub struct FeedbackOptions {
    /// Scenario files with one gait on loads of several sources; the first is the reference
    #[arg(value_name = "SCENARIO", default_values = FEEDBACK)]
    pub scenarios: Vec<PathBuf>,
    /// Study on this plant; may be repeated; without it, on the scenario's own
    #[arg(long, value_name = "MODEL", value_delimiter = ',')]
    pub plant: Vec<String>,
    /// Set a key of the scenarios: controller.feedback="0.3 rad/(N·s)"
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Repeat the first scenario with a filter of the load, with these time constants, separated by
    /// commas: 5ms,10ms
    #[arg(long, value_name = "DURATIONS", value_delimiter = ',', value_parser = duration)]
    pub lag: Vec<SimDuration>,
    /// Time from which speed, footsteps and loads count
    #[arg(long, value_name = "TIME", default_value = "5s", value_parser = any_duration)]
    pub after: SimDuration,
    /// Time from the start over which phases are compared with those of the reference
    #[arg(long, value_name = "TIME", default_value = "5s", value_parser = duration)]
    pub phases: SimDuration,
    /// Changes of the step length, separated by commas
    #[arg(
        long,
        value_name = "CHANGES",
        value_delimiter = ',',
        allow_hyphen_values = true,
        default_value = "-5 mm,-10 mm,-20 mm"
    )]
    pub by: Vec<String>,
    /// Points of the gait cycle at which the step length changes
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = whole_number)]
    pub points: usize,
    /// Footsteps of each leg after the change
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = whole_number)]
    pub steps: usize,
    /// Folder for the HTML page, the CSV and the JSON file
    #[arg(long, value_name = "DIR", default_value = "studies")]
    pub out: PathBuf,
    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
}

/// Options of a study of gait transitions.
#[derive(Clone, Debug, Args)]
pub struct TransitionOptions {
    /// Scenario file in which a variable of the controller changes in steps
    #[arg(value_name = "SCENARIO")]
    pub scenario: PathBuf,
    /// Study on this plant; may be repeated; without it, on the scenario's own
    #[arg(long, value_name = "MODEL", value_delimiter = ',')]
    pub plant: Vec<String>,
    /// Set a key of the scenario: controller.step_length="8 cm"
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Process variable whose changes are related to the gaits [default: that of the scenario's
    /// first change]
    #[arg(long, value_name = "VARIABLE")]
    pub variable: Option<String>,
    /// Repeat the run with plateaus of these lengths, separated by commas: 5s,10s,20s. All times of
    /// changes, and the duration, are scaled [default: the scenario's own]
    #[arg(long, value_name = "DURATIONS", value_delimiter = ',', value_parser = plateau)]
    pub plateau: Vec<SimDuration>,
    /// Greatest deviation of a leg from the pattern of a gait, as a share of the cycle
    #[arg(long, value_name = "SHARE", default_value = "0.1", value_parser = deviation)]
    pub tolerance: f64,
    /// Cycles in a row after which a gait is established
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = whole_number)]
    pub cycles: usize,
    /// Folder for the HTML page, the CSV and the JSON file
    #[arg(long, value_name = "DIR", default_value = "studies")]
    pub out: PathBuf,
    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
}
