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
mod commands;
mod contact;
mod coupling;
mod criteria;
mod csv;
mod differences;
mod differing;
mod dominance;
#[cfg(test)]
mod dominance_tests;
mod ensemble;
mod ensemble_difference;
mod error;
mod error_control;
mod estimate;
mod events;
mod factory;
mod feedback;
mod fit;
mod floors;
mod footsteps;
mod frame;
mod gait_run;
mod headline;
mod latency;
mod machine;
mod models;
mod modulation;
mod outliers;
#[cfg(test)]
mod page_parts;
#[cfg(test)]
mod page_tests;
mod panics;
mod parallel;
mod plant_run;
mod precision;
mod precision_job;
mod precision_plan;
mod progress;
mod radius;
mod reference;
mod reference_note;
mod references;
mod reproduction;
mod robustness;
mod row;
mod search;
mod stability;
mod stability_job;
mod stability_plan;
mod stencil;
mod stiffness;
mod stopwatch;
mod study;
mod sufficient;
mod sweep;
mod thesis;
mod tolerance;
mod trace;
mod transition;
mod transport;
mod trial;
mod view;

pub use commands::{CommandRecorder, CommandTape, Commands};
pub use contact::{ContactResiduals, GaitContact, RestContact};
pub use coupling::{
    CouplingInput, CouplingKind, CouplingMethod, CouplingOrder, CouplingPlan, CouplingRow,
    CouplingStudy, RigFactory, RigVariant, coupling,
};
pub use csv::csv;
pub use dominance::{Comparison, Competitor, Dominance};
pub use ensemble::{Ensemble, Interval, QuantityInterval};
pub use ensemble_difference::EnsembleDifference;
pub use error::StudyError;
pub use error_control::ErrorControlTrend;
pub use estimate::{
    CalibrationRun, EstimateCurve, EstimateInput, EstimatePlan, EstimatePoint, EstimateStudy,
    FilterKind, FilterRow, Identification, LoadRecorder, LoadRun, LoadSample, LoopPoint,
    PrintedFigure, Residuals, SearchSize, SteadyPart, TunedFilter, Verdict, VoltageCurve,
    VoltagePoint, calibrate, calibration_text, estimate, samples_fingerprint,
};
pub use factory::{PlantFactory, StudyInput};
pub use feedback::{
    ControlStep, FeedbackCase, FeedbackInput, FeedbackPlan, FeedbackResult, FeedbackRun,
    FeedbackRunner, FeedbackStudy, LegLoad, StepSlope, feedback,
};
pub use floors::Floor;
pub use footsteps::{Footstep, WALK};
pub use gait_run::{FootContact, GaitRun, MeasuredCycle, MotionSample, PhaseSample};
pub use latency::{LoadDelay, SampledSignal};
pub use machine::Machine;
pub use modulation::{
    CaseResult, Counting, Displacement, DisplacementCell, DisplacementTable, IdealSlope,
    LinearModel, ModelForm, ModulationCase, ModulationInput, ModulationPlan, ModulationRunner,
    ModulationStudy, VariableChange, modulation,
};
pub use parallel::{Ran, run_all_on};
pub use precision::precision;
pub use precision_plan::PrecisionPlan;
pub use progress::ProgressObserver;
pub use radius::{radius_markdown, radius_page, radius_summary};
pub use reference_note::{CheckNote, ReferenceNote};
pub use robustness::{
    Divergence, EnsembleRun, Growth, GrowthRate, MemberRun, RobustnessCase, RobustnessPlan,
    RobustnessResult, RobustnessRunner, RobustnessStudy, Trajectory, robustness,
};
pub use row::{CLOCKED, Row, RowKind, Series, Status, VariantKey};
pub use stability::stability;
pub use stability_plan::StabilityPlan;
pub use stiffness::StiffnessTrend;
pub use stopwatch::RunStopwatch;
pub use study::{Order, Study, StudyKind};
pub use sufficient::{
    Candidate, CandidateFactory, CandidateReference, CandidateRow, CandidateRun, CandidateStatus,
    Deviation, MarginOutcome, ReferenceMargin, ReferenceRuns, Rule, RunFailure, START_PERTURBATION,
    Sufficiency, SufficiencyPlan, perturb_start, sufficient,
};
pub use sweep::Factor;
pub use thesis::{FIGURES, ModelClass, ThesisFigure};
pub use tolerance::ToleranceSlope;
pub use transition::{
    ClassAgreement, GaitCycle, GaitPattern, Hysteresis, MIXED, STANDING, Transition,
    TransitionCase, TransitionInput, TransitionPlan, TransitionResult, TransitionRunner,
    TransitionStudy, Way, transition,
};
pub use transport::{Cost, STROLL, Transport};
pub use view::{best_cases, best_point, evaluation_class, optimization_page, sweep_page};
