//! Studies of plants: precision, the error of each method against its run time ([`precision`]), and
//! stability, the largest stable and accurate step of each method ([`stability`]). Plants are
//! accessed through [`twinrig_runtime::Plant`] only and are built by a [`PlantFactory`]. A variant
//! that cannot be built, fails, panics or exceeds its time budget is a row of the study with the
//! reason. A third study ([`coupling()`]) runs complete rigs, boards included, and compares the
//! coupling of plant and boards on a communication grid with exact coupling. A fourth one
//! ([`estimate()`]) identifies the cells of a load sensor from recorded samples, and tunes and
//! validates its filters. A fifth one
//! ([`modulation()`]) measures the displacement of footsteps after a change of a variable of the
//! controller, a sixth one ([`transition()`]) classifies gaits over time and dates their
//! transitions, a seventh one ([`feedback()`]) compares a controller on true loads with the same
//! one on loads that are measured or estimated. An eighth one ([`robustness()`]) runs scenarios
//! from perturbed starts, and gives the distribution of the margins of their expectations and the
//! growth of the distance between trajectories. A search ([`sufficient()`]) finds the cheapest
//! plant and setting that answer a scenario. Two studies of one build give the same results except
//! for run times, unless the budget truncates one of them.
//!
//! ```
//! use twinrig_experiment::{PrecisionPlan, Study, StudyError, PlantFactory, precision};
//!
//! fn coarse(factory: &dyn PlantFactory) -> Result<Study, StudyError> {
//!     let plan = PrecisionPlan { budget_s: 10.0, ..PrecisionPlan::default() };
//!     let study = precision(factory, &plan, &mut ())?;
//!     for order in study.orders() {
//!         println!("{} {}: order {:.1}", order.plant, order.method, order.order);
//!     }
//!     Ok(study)
//! }
//! ```
//!
//! Limits: no scenario parsing, no knowledge of a robot or of a particular plant, no file output.
//! The wall clock is read for run times and budgets only.

mod budget;
mod coupling;
mod csv;
mod differing;
pub mod ensemble;
pub mod error;
mod estimate;
mod feedback;
mod figure;
mod fit;
mod gait;
mod gait_map;
mod machine;
mod modulation;
pub mod optimization;
pub mod options;
mod outliers;
#[cfg(test)]
mod page_parts;
mod panics;
mod parallel;
mod plants;
mod progress;
mod radius;
mod reproduction;
mod robustness;
mod runs;
pub mod shell;
mod stopwatch;
mod studies;
mod sufficient;
pub mod sweep;
mod transition;
mod worker;

pub use coupling::{
    CouplingInput, CouplingKind, CouplingMethod, CouplingOrder, CouplingPlan, CouplingRow,
    CouplingStudy, RigFactory, RigVariant, coupling,
};
pub use ensemble::{execute, with_ensemble};
pub use error::{Error, StudyError};
pub use estimate::recorder::{BenchRecorder, BenchRun};
pub use estimate::{
    CalibrationRun, EstimateCurve, EstimateInput, EstimatePlan, EstimatePoint, EstimateStudy,
    FilterKind, FilterRow, Identification, LoadRecorder, LoadRun, LoadSample, LoopPoint,
    PrintedFigure, Residuals, SearchSize, SteadyPart, TunedFilter, Verdict, VoltageCurve,
    VoltagePoint, calibrate, calibration_text, estimate, samples_fingerprint,
};
pub use feedback::latency::{LoadDelay, SampledSignal};
pub use feedback::{
    ControlStep, FeedbackCase, FeedbackInput, FeedbackPlan, FeedbackResult, FeedbackRun,
    FeedbackStudy, LegLoad, StepSlope, feedback,
};
pub use gait::run::{FootContact, GaitRun, MeasuredCycle, MotionSample, PhaseSample};
pub use gait_map::{GaitMap, GaitMapInput, GaitPoint};
pub use machine::Machine;
pub use modulation::ModulationOptions;
pub use modulation::{
    CaseResult, Counting, Displacement, DisplacementCell, DisplacementTable, IdealSlope,
    LinearModel, ModelForm, Modulation, ModulationCase, ModulationInput, ModulationPlan,
    ModulationRun, ModulationStudy, VariableChange,
};
pub use optimization::execute::optimize;
pub use optimization::optimization_page;
pub use optimization::outcome::{OptimizationOutcome, OptimizationProgress, OptimizationRequest};
pub use options::request::{StudyContext, StudyFrame, StudyReport, StudyRequest};
pub use parallel::Ran;
pub use plants::builder::StudyBuilder;
pub use plants::commands::{CommandRecorder, CommandTape, Commands};
pub use plants::contact::{ContactResiduals, GaitContact, RestContact};
pub use plants::dominance::{Comparison, Competitor, Dominance};
pub use plants::ensemble::{Ensemble, Interval, QuantityInterval};
pub use plants::ensemble_difference::EnsembleDifference;
pub use plants::error_control::ErrorControlTrend;
pub use plants::factor::Factor;
pub use plants::factory::{PlantFactory, StudyInput};
pub use plants::floors::Floor;
pub use plants::footsteps::{Footstep, WALK};
pub use plants::precision::precision;
pub use plants::precision_plan::PrecisionPlan;
pub use plants::reference_note::{CheckNote, ReferenceNote};
pub use plants::row::{CLOCKED, Row, RowKind, Series, Status, VariantKey};
pub use plants::stability::stability;
pub use plants::stability_plan::StabilityPlan;
pub use plants::stiffness::StiffnessTrend;
pub use plants::study::{Order, Study, StudyKind};
pub use plants::thesis::{FIGURES, ModelClass, ThesisFigure};
pub use plants::tolerance::ToleranceSlope;
pub use plants::transport::{Cost, STROLL, Transport};
pub use progress::ProgressObserver;
pub use radius::{radius_markdown, radius_page, radius_summary};
pub use robustness::{
    Divergence, EnsembleRun, Growth, GrowthRate, MemberRun, RobustnessCase, RobustnessPlan,
    RobustnessResult, RobustnessStudy, Trajectory,
};
pub use stopwatch::RunStopwatch;
pub use studies::StudyCommand;
pub use sufficient::omission::OmissionProof;
pub use sufficient::runs::SufficiencyBuilder;
pub use sufficient::{
    Candidate, CandidateFactory, CandidateReference, CandidateRow, CandidateRun, CandidateStatus,
    Deviation, MarginOutcome, ReferenceMargin, ReferenceRuns, Rule, RunFailure, START_PERTURBATION,
    Sufficiency, SufficiencyPlan, perturb_start, sufficient,
};
pub use sweep::execute::{SweepEvent, SweepOutcome, SweepProgress, SweepRequest, sweep};
pub use sweep::{share_sentence, sweep_page};
pub use transition::TransitionOptions;
pub use transition::{
    ClassAgreement, GaitCycle, GaitPattern, Hysteresis, MIXED, STANDING, Transition,
    TransitionCase, TransitionInput, TransitionPlan, TransitionResult, TransitionStudy, Way,
    transition,
};
pub use worker::{JobError, WorkerJob};
