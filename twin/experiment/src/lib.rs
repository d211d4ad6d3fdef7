//! Many runs of scenarios. [`sweep()`] runs a scenario at many points, [`optimize`] searches its
//! settings, [`with_ensemble`] perturbs its start. [`StudyCommand`] lists the studies; each has a
//! folder with its options, results and pages. Studies of plants ([`precision`], [`stability`])
//! access them through [`twinrig_runtime::Plant`] only and build them by a [`PlantFactory`]. A part
//! that cannot be built, fails, panics or exceeds its time budget is a row of the study with the
//! reason. Two studies of one build give the same results except for run times, unless the budget
//! truncates one of them.
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
//! # Modules
//!
//! `runs` has the runs that an engine does, with rows on disk; `sweep`, `optimization` and `radius`
//! are on top of it. `ensemble` has the runs of a scenario with the key `ensemble`, `error_bars`
//! those at finer settings. Each study has a folder: its options, its request (from options to a
//! report), its cases, the analysis, `results` (JSON and CSV) and `view` (summary and page). The
//! smallest one is `gait_map`. `plants` has precision and stability, `gait` the runs of gaits. A
//! new study is such a folder, a line in `studies.rs`, a section in `docs/studies.md` and its name
//! in `docs/program.md`; runs that do not differ by settings alone also take a line in `worker.rs`.
//!
//! Limits: no knowledge of a particular plant, no terminal; the options of a study are those of the
//! command line. The wall clock is read for run times, budgets and progress only.

mod budget;
mod coupling;
mod csv;
mod differing;
pub mod ensemble;
pub mod error;
mod error_bars;
mod estimate;
mod feedback;
mod figure;
mod fit;
mod gait;
mod gait_map;
mod identification;
mod incidents;
mod machine;
mod measured;
mod modulation;
pub mod optimization;
pub mod options;
mod outliers;
#[cfg(test)]
mod page_parts;
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
mod timing;
mod transition;
mod worker;

pub use coupling::{
    CouplingInput, CouplingKind, CouplingMethod, CouplingOrder, CouplingPlan, CouplingRow,
    CouplingStudy, RigFactory, RigVariant, coupling,
};
pub use ensemble::{check_ensemble, execute, with_ensemble};
pub use error::{Error, FitError, StudyError};
pub use error_bars::with_error_bars;
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
pub use identification::{
    FitOutcome, FitProgress, FitRequest, FittedParameter, HeldOut, RecordingResidual,
    UnknownDirection, fit, fit_page,
};
pub use machine::Machine;
pub use measured::{Measuring, PartStore, Start, Starts};
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
pub use parallel::RunResult;
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
pub use plants::footsteps::{Footstep, GAIT_DURATION};
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
pub use plants::transport::{Cost, TRANSPORT_DURATION, Transport};
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
pub use sweep::rows::SweepRows;
pub use sweep::{share_sentence, sweep_page};
pub use timing::{TimingOptions, TimingPoint, TimingStudy};
pub use transition::TransitionOptions;
pub use transition::{
    ClassAgreement, GaitCycle, GaitPattern, Hysteresis, MIXED, RampDirection, STANDING, Transition,
    TransitionCase, TransitionInput, TransitionPlan, TransitionResult, TransitionStudy, transition,
};
pub use worker::{JobError, WorkerJob};
