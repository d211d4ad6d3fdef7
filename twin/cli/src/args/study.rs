//! Arguments of `twin study`.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use twinrig_kernel::SimDuration;

use super::gait_study::{FeedbackOptions, ModulationOptions, TransitionOptions};
use super::radius::RadiusOptions;
use super::robustness::RobustnessOptions;
use super::values::{FactorValues, factor_values};
use super::{duration, key_value, seconds, whole_number, whole_number_or_none};

/// Arguments of `twin study`.
#[derive(Clone, Debug, Args)]
pub struct StudyArgs {
    /// Kind of study
    #[command(subcommand)]
    pub study: StudyCommand,
}

/// Kind of study.
#[derive(Clone, Debug, Subcommand)]
pub enum StudyCommand {
    /// Measure the error of each plant, method and step against its computation time
    ///
    /// Integrates the scene with every plant and method over a range of steps or tolerances, and
    /// compares the foot positions with a reference: the best method at its finest setting,
    /// verified by a second method. Commands of a controller are recorded once and replayed to all
    /// plants. Runs that fail or exceed the budget are reported as such.
    Precision(PrecisionOptions),
    /// Find the largest stable step of each plant and method, and the limiting parameters
    ///
    /// Searches for the longest step at which the motion stays bounded while stiffness, masses,
    /// damping, gain, friction or restitution of the robot and its ground are varied one at a time.
    /// A stability limit at which the foot positions are inaccurate is marked as wrong.
    Stability(StabilityOptions),
    /// Measure the error and the saved computation time of coupling plant and boards on a fixed
    /// grid
    ///
    /// Runs the complete rig, including controller, drivers and boards, with exact coupling and
    /// with fixed-step coupling at various grid steps, and compares foot and trunk positions with
    /// exact coupling at a fine plant step, which is verified by a step twice as long.
    #[command(mut_arg("scenario", |scenario| scenario.default_value("scenarios/oncilla-clocks.toml")))]
    Coupling(StudyOptions),
    /// Identify the cells of a load sensor, tune its filters and validate them
    ///
    /// Runs a bench with a tactile bus three times, with successive seeds, while the frequency of
    /// the load changes. The first run identifies both cells, the second tunes the covariances of
    /// the filters by particle swarms, the third validates them. Prints the tuned filters for a
    /// scenario.
    #[command(mut_arg("scenario", |scenario| scenario.default_value("scenarios/thesis/fig-4-11.toml")))]
    Estimate(EstimateOptions),
    /// Measure the displacement of footsteps after a change of a variable of the controller
    ///
    /// Runs a gait without the change, and again with each of several changes at each of several
    /// points of the gait cycle, and compares the footsteps of each leg, by cycle and by number of
    /// touch-downs (thesis, section 3.2.5). With several scenarios or plants it also switches
    /// saturation of servos and feedback of loads off, and compares all of them in one table.
    Modulation(ModulationOptions),
    /// Classify the gait over time while a variable of the controller changes in steps
    ///
    /// Runs a scenario, compares the phases of the touch-downs of each cycle with the patterns of
    /// gaits, and dates the transitions between gaits that last, with the value of the variable, on
    /// the way up and on the way down (thesis, section 3.3.2.3).
    Transition(TransitionOptions),
    /// Compare a gait on the true loads of its legs with the same gait on measured or estimated
    /// ones
    ///
    /// Runs the scenarios side by side: speed, duty factors, difference of the phases from those of
    /// the first scenario, displacement of footsteps after a change of the step length, error and
    /// delay of the load that the controller takes. A run with the commands of the first one is
    /// void.
    Loads(FeedbackOptions),
    /// Find the least disturbance at which each expectation of a scenario fails
    ///
    /// Runs the scenario with growing disturbances along several axes: latency, jitter and clocks
    /// of the buses, friction, stiffness, payload, a push, noise of sensors, or any key. Between
    /// the last value with which an expectation holds and the first with which it fails, it
    /// bisects. Values below are tested, too: an expectation that fails and holds again beyond is
    /// reported as not monotone. The same command continues an interrupted study.
    Radius(RadiusOptions),
    /// Measure how far the expectations of scenarios are from failing, over perturbed starts
    ///
    /// Runs each scenario from its own start and from starts that are perturbed by one unit in the
    /// last place up to 1e-6: for each expectation the distribution of its margin, the share of the
    /// runs in which it holds, and the least perturbation that changes its verdict; the growth rate
    /// of the distance between trajectories, and the time from which on one does not predict the
    /// other. Also writes the tables as Markdown.
    Robustness(RobustnessOptions),
}

impl StudyCommand {
    /// Returns whether the study prints JSON instead of text.
    pub fn json(&self) -> bool {
        match self {
            Self::Precision(PrecisionOptions { study, .. })
            | Self::Estimate(EstimateOptions { study, .. })
            | Self::Stability(StabilityOptions { study, .. })
            | Self::Coupling(study) => study.json,
            Self::Modulation(options) => options.json,
            Self::Transition(options) => options.json,
            Self::Loads(options) => options.json,
            Self::Radius(options) => options.json,
            Self::Robustness(options) => options.json,
        }
    }
}

/// Options of a study of load filters.
#[derive(Clone, Debug, Args)]
pub struct EstimateOptions {
    /// Options of every study.
    #[command(flatten)]
    pub study: StudyOptions,
    /// Particles of a swarm; F2 has three swarms, the other filters one
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = whole_number)]
    pub particles: usize,
    /// Iterations of each swarm
    #[arg(long, value_name = "N", default_value_t = 25, value_parser = whole_number_or_none)]
    pub iterations: usize,
}

/// Options of a study of precision.
#[derive(Clone, Debug, Args)]
pub struct PrecisionOptions {
    /// Options of every study.
    #[command(flatten)]
    pub study: StudyOptions,
    /// Walks from perturbed starts of each plant, where the scenario walks; 0 for none
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = whole_number_or_none)]
    pub ensemble: usize,
}

/// Options of a study of stability.
#[derive(Clone, Debug, Args)]
pub struct StabilityOptions {
    /// Options of every study.
    #[command(flatten)]
    pub study: StudyOptions,
    /// Vary this factor alone: stiffness, mass, damping, gain, friction, restitution, compliance,
    /// compliance-damping, longest-step, speed (multiples of the robot's, or values in SI units),
    /// or cells of the table of forces
    #[arg(long, value_name = "FACTOR=VALUES", value_parser = factor_values)]
    pub factor: Option<FactorValues>,
}

/// Options common to all studies.
#[derive(Clone, Debug, Args)]
pub struct StudyOptions {
    /// Scenario file
    #[arg(value_name = "SCENARIO", default_value = "scenarios/passive-legs.toml")]
    pub scenario: PathBuf,
    /// Study this plant; may be repeated; without it, all plants of this build
    #[arg(long, value_name = "MODEL", value_delimiter = ',')]
    pub plant: Vec<String>,
    /// Set a key of the scenario: duration="300 ms"
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Simulated time: "300 ms" [default: precision the first 300 ms, stability 2 s, coupling 1 s,
    /// estimate the scenario]
    #[arg(long, value_name = "DURATION", value_parser = duration)]
    pub duration: Option<SimDuration>,
    /// Approximate limit of the computation time; rows truncated by it are reported
    #[arg(long, value_name = "DURATION", default_value = "200 s", value_parser = seconds)]
    pub budget: f64,
    /// Folder for the HTML page, the CSV and the JSON file
    #[arg(long, value_name = "DIR", default_value = "studies")]
    pub out: PathBuf,
    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
}
