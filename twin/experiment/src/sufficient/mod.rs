//! Search of the cheapest sufficient twin: the plant, constraints, method and setting that answer
//! every expectation of a scenario with an error below a tenth of its margin, in the least time.
//!
//! The search compares runs of complete scenarios with those of a reference; it knows no plant, no
//! controller and no expectation. A [`CandidateFactory`] executes the runs.

mod candidates;
pub(crate) mod omission;
mod results;
mod rule;
pub(crate) mod runs;
mod search;

use thiserror::Error;
use twinrig_campaign::spread::Magnitude;
use twinrig_report::number::method_setting;
use twinrig_rig::MethodSetting;
use twinrig_rig::PlantId;
use twinrig_rig::start::StartPerturbation;
use twinrig_runtime::Plant;

pub use results::{CandidateRow, CandidateStatus, ReferenceRuns, Sufficiency};
pub use rule::{Deviation, ReferenceMargin, Rule};
pub use search::sufficient;

/// Greatest change of a coordinate at a perturbed start, m or rad.
pub const START_PERTURBATION: f64 = 1e-6;

/// Parameters of the search.
#[derive(Clone, Debug)]
pub struct SufficiencyPlan {
    /// Number of starts; the first is the scenario's, the others are perturbed. At least one.
    pub starts: usize,
    /// Number of runs of a sufficient candidate; the shortest is its time.
    pub repetitions: usize,
    /// Approximate limit of the computation time of all runs \[s\].
    pub budget_s: f64,
}

impl Default for SufficiencyPlan {
    fn default() -> Self {
        Self {
            starts: 5,
            repetitions: 5,
            budget_s: 200.0,
        }
    }
}

/// A choice of plant, constraints, method and setting.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Plant and constraints.
    pub plant: PlantId,
    /// Method; none for the scenario's own.
    pub method: Option<String>,
    /// Setting of the method; none for the scenario's own.
    pub setting: Option<MethodSetting>,
    /// Keys of the scenario and their values in TOML that make the choice.
    pub settings: Vec<[String; 2]>,
}

impl Candidate {
    /// Returns plant, method and setting: `lcp, compliant rk4 tolerance 10⁻⁶`.
    pub fn describe(&self) -> String {
        let method = self.method.as_deref().unwrap_or("as the scenario has it");
        let text = format!("{} {method} {}", self.plant, self.describe_setting());
        text.trim_end().to_owned()
    }

    /// Returns the setting: `tolerance 10⁻⁶`; empty for that of the scenario.
    pub fn describe_setting(&self) -> String {
        let step_s = self.setting.and_then(MethodSetting::step_s);
        method_setting(step_s, self.setting.and_then(MethodSetting::tolerance))
    }
}

/// A reference and the run that verifies it.
#[derive(Clone, Debug, PartialEq)]
pub struct CandidateReference {
    /// Reference.
    pub reference: Candidate,
    /// Run of another method, or of the same at a coarser setting.
    pub check: Candidate,
}

/// Executes scenarios with candidates. The caller, who knows plants and expectations, implements
/// it.
pub trait CandidateFactory {
    /// Returns the scenario's own choice.
    fn own(&self) -> &Candidate;

    /// Returns the settings of each method, the coarsest first; methods that are likely to be cheap
    /// come first.
    fn refinements(&self) -> &[Vec<Candidate>];

    /// Returns references of the most complete model, the finest first: the first that is
    /// affordable is used.
    fn references(&self) -> &[CandidateReference];

    /// Returns the simulated time of a complete run \[s\].
    fn simulated_s(&self) -> f64;

    /// Returns whether a perturbed start differs from the scenario's; if not, one start suffices.
    fn starts_differ(&self) -> bool;

    /// Runs the scenario with a candidate, from the scenario's start (0) or a perturbed one, for at
    /// most `limit_s` of computation \[s\].
    ///
    /// # Errors
    /// The reason why there is no complete run.
    fn run(
        &self,
        candidate: &Candidate,
        start: usize,
        limit_s: f64,
    ) -> Result<CandidateRun, RunFailure>;
}

/// A complete run of a scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct CandidateRun {
    /// Outcomes of the expectations about the simulated system: the same expectations in the same
    /// order for every candidate.
    pub outcomes: Vec<MarginOutcome>,
    /// Outcomes of the expectations about the computation itself, such as the residual of the
    /// energy balance, as far as they apply to the candidate.
    pub of_computation: Vec<MarginOutcome>,
    /// Computation time of the run \[s\].
    pub run_s: f64,
    /// Simulated time \[s\].
    pub simulated_s: f64,
    /// Sum of the work counts of the plant.
    pub work: u64,
}

/// Outcome of an expectation.
#[derive(Clone, Debug, PartialEq)]
pub struct MarginOutcome {
    /// Name of the expectation.
    pub name: String,
    /// Unit of the margin.
    pub unit: String,
    /// Whether it holds.
    pub holds: bool,
    /// Distance to the bound, negative beyond it; none if nothing was observed.
    pub margin: Option<f64>,
}

/// Reason why there is no complete run.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum RunFailure {
    /// The scenario cannot have these settings.
    #[error("{0}")]
    Refused(String),
    /// The run ended prematurely.
    #[error("{0}")]
    Failed(String),
    /// The run took longer than its limit.
    #[error("it exceeded its limit of the computation time")]
    OverLimit,
    /// The user interrupted the run.
    #[error("it was interrupted")]
    Interrupted,
}

/// Perturbs every coordinate of a plant's start by 1e-6 m or rad at most, by the random numbers of
/// the start `start`. Start 0 is not perturbed.
///
/// # Errors
/// The reason why the plant cannot start elsewhere.
pub fn perturb_start(plant: &mut dyn Plant, start: usize) -> Result<(), String> {
    if start == 0 {
        return Ok(());
    }
    let perturbation = StartPerturbation {
        seed: 0,
        member: start,
        magnitude: Magnitude::UpTo(START_PERTURBATION),
    };
    perturbation.apply(plant)
}
