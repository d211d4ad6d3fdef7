//! Runs of the search of the cheapest sufficient twin: the whole scenario, with controller, buses
//! and boards.

use std::io::Sink;
use std::path::{Path, PathBuf};

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_rig::assembly::Assembly;
use twinrig_rig::error::{Error as RigError, guarded};
use twinrig_rig::registry::Registry;
use twinrig_rig::report::{Line, Report};
use twinrig_rig::run::course::{self, Course, Stopped};
use twinrig_rig::run::execution::Execution;
use twinrig_rig::run::interrupt;
use twinrig_rig::run::judging;
use twinrig_rig::run::observers::{RunObserver, RunObservers, RunProgress};
use twinrig_rig::run::recording::recorder_to;
use twinrig_scenario::{Base, Claim, Expectation, Outcome, Scenario, Setting};

use crate::error::{Error, first_line};
use crate::sufficient::candidates::Candidates;
use crate::{
    Candidate, CandidateFactory, CandidateReference, CandidateRun, MarginOutcome, RunFailure,
    RunStopwatch, perturb_start,
};

/// Parts of a run between looks at the clock.
const PARTS: u64 = 50;

/// Settings that choose a candidate, as messages name their origin.
const ORIGIN: &str = "--set";

/// Builds and runs the candidates of a scenario.
pub struct SufficiencyBuilder<'r> {
    registry: &'r Registry,
    path: PathBuf,
    settings: Vec<Setting>,
    candidates: Candidates,
    /// Expectations about the simulated system, those of the reference's plant.
    expectations: Vec<Expectation>,
    base: Base,
    duration: SimDuration,
}

/// How a run of the scenario differs from `twin run`.
pub(crate) struct RunOptions<'o> {
    /// Number of the start; 0 is the scenario's.
    pub(crate) start: usize,
    /// Limit of the computation time \[s\].
    pub(crate) limit_s: f64,
    /// Whether to record what the scene records; the bytes are discarded.
    pub(crate) is_recorded: bool,
    /// Observer of the samples.
    pub(crate) observer: Option<&'o mut dyn RunObserver>,
}

/// Returns whether the expectation is about the computation and not about the simulated system: it
/// has the same bound for every method, but no common value.
fn is_of_computation(expectation: &Expectation) -> bool {
    matches!(
        expectation.claim,
        Claim::EnergyResidual(_) | Claim::Cost(..)
    )
}

fn is_about(expectation: &Expectation, plant: &str) -> bool {
    let plants = &expectation.plants;
    plants.is_empty() || plants.iter().any(|named| named == plant)
}

impl<'r> SufficiencyBuilder<'r> {
    /// Reads the scenario at `path` with `settings`; the search is restricted to the plants called
    /// `plants`, if there are any.
    ///
    /// # Errors
    /// Errors of the scenario, or of a plant selected by name.
    pub fn new(
        registry: &'r Registry,
        path: &Path,
        settings: &[Setting],
        plants: &[String],
    ) -> Result<Self, Error> {
        let own = Assembly::builder(registry).settings(settings).file(path)?;
        let candidates = Candidates::of(registry, path, settings, plants, &own)?;
        let scenario = own.scenario();
        let reference = candidates.references.first();
        let plant = reference.map_or(&candidates.own.plant, |it| &it.reference.plant);
        let all = scenario
            .expectations
            .iter()
            .chain(&scenario.of_other_plants);
        let judged = all.filter(|it| !is_of_computation(it) && is_about(it, &plant.name));
        let expectations: Vec<Expectation> = judged.cloned().collect();
        if expectations.is_empty() {
            return Err(Error::NoSufficiency {
                file: scenario.file.clone(),
                why: format!("it expects nothing of the simulated system on {plant}"),
                help: "add an [[expect]] with a bound".to_owned(),
            });
        }
        Ok(Self {
            registry,
            path: path.to_owned(),
            settings: settings.to_vec(),
            base: scenario.plant.base,
            duration: scenario.duration,
            candidates,
            expectations,
        })
    }

    /// Returns plants and methods that are no candidates, each with the reason.
    pub fn left_out(&self) -> &[String] {
        &self.candidates.left_out
    }

    /// Returns the names of the plants without masses in the segments of their legs.
    pub fn massless(&self) -> &[String] {
        &self.candidates.massless
    }

    /// Reads the scenario with a candidate and `also` on top.
    ///
    /// # Errors
    /// The scenario cannot have these settings.
    pub(crate) fn assembly(
        &self,
        candidate: &Candidate,
        also: &[Setting],
    ) -> Result<Assembly<'r>, RigError> {
        let chosen = candidate.settings.iter().map(|[key, value]| Setting {
            origin: ORIGIN.to_owned(),
            key: key.clone(),
            value: value.clone(),
        });
        let settings = self.settings.iter().cloned().chain(chosen);
        let settings: Vec<Setting> = settings.chain(also.iter().cloned()).collect();
        guarded(&self.path.display().to_string(), || {
            Assembly::builder(self.registry)
                .settings(&settings)
                .file(&self.path)
        })
    }

    /// Reads the scenario with a candidate, judged by the expectations of the reference's plant.
    fn judged(&self, candidate: &Candidate) -> Result<Assembly<'r>, RigError> {
        let assembly = self.assembly(candidate, &[])?;
        let scenario = assembly.scenario();
        let of_computation = scenario.expectations.iter();
        let of_computation = of_computation.filter(|it| is_of_computation(it)).cloned();
        let judged = Scenario {
            expectations: self
                .expectations
                .iter()
                .cloned()
                .chain(of_computation)
                .collect(),
            of_other_plants: Vec::new(),
            ..scenario.clone()
        };
        assembly.with_scenario(&judged, &[])
    }
}

/// Runs a scenario, and the reference run if an expectation requires one. Also returns the
/// computation time of the run \[s\].
///
/// # Errors
/// The reason why there is no complete run.
pub(crate) fn run(
    assembly: &Assembly<'_>,
    options: RunOptions<'_>,
) -> Result<(Report, f64), RunFailure> {
    let refused =
        |error: &dyn std::fmt::Display| RunFailure::Refused(first_line(&error.to_string()));
    let execution = Execution::default();
    let end = assembly.end();
    let reference = judging::reference(assembly, end, None).map_err(|error| refused(&error))?;
    let mut unperturbed = None;
    let rig = assembly.rig_around(|mut plant| {
        unperturbed = perturb_start(&mut *plant, options.start).err();
        plant
    });
    let mut rig = rig.map_err(|error| refused(&error))?;
    if let Some(why) = unperturbed {
        return Err(RunFailure::Failed(format!(
            "its start cannot be perturbed: {why}"
        )));
    }
    let mut judge = judging::judge(assembly, &rig);
    if let Some(reference) = reference {
        judge = judge.with_reference(&reference);
    }
    let recorder = options
        .is_recorded
        .then(|| recorder_to(assembly, &rig, std::io::sink()));
    let recorder = recorder.transpose();
    let recorder = recorder.map_err(|error| RunFailure::Failed(error.to_string()))?;
    let observers: RunObservers<'_, Sink> = RunObservers::new(judge, recorder);
    let mut observers = observers.with_caller(options.observer, &rig);
    let progress = RunProgress {
        title: &assembly.scenario().name,
        now: SimTime::ZERO,
        end,
    };
    let stopwatch = RunStopwatch::start();
    let mut ran = Ok(SimTime::ZERO);
    for part in 1..=PARTS {
        let nanos = u128::from(end.as_nanos()) * u128::from(part) / u128::from(PARTS);
        let until = SimTime::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX));
        ran = course::run(assembly, &mut rig, &mut observers, &progress, until);
        if stopwatch.elapsed_s() > options.limit_s && !interrupt::is_requested() {
            return Err(RunFailure::OverLimit);
        }
        match ran {
            // Boards may still be initialised.
            Err(Stopped::NotOpen(_)) if part < PARTS => {}
            Err(_) => break,
            Ok(reached) if reached < until => break,
            Ok(_) => {}
        }
    }
    let run_s = stopwatch.elapsed_s();
    let course = Course::of(&rig, run_s, ran);
    let report = judging::report(assembly, &execution, observers, course);
    match &report.error {
        Some(_) if interrupt::is_requested() => Err(RunFailure::Interrupted),
        Some(error) => Err(RunFailure::Failed(first_line(error))),
        None => Ok((report, run_s)),
    }
}

fn margin_outcome(Line { outcome, .. }: Line) -> MarginOutcome {
    let holds = outcome.holds();
    let Outcome {
        name, unit, margin, ..
    } = outcome;
    MarginOutcome {
        name,
        unit: unit.symbol().to_owned(),
        holds,
        margin,
    }
}

impl CandidateFactory for SufficiencyBuilder<'_> {
    fn own(&self) -> &Candidate {
        &self.candidates.own
    }

    fn refinements(&self) -> &[Vec<Candidate>] {
        &self.candidates.refinements
    }

    fn references(&self) -> &[CandidateReference] {
        &self.candidates.references
    }

    fn simulated_s(&self) -> f64 {
        self.duration.as_secs_f64()
    }

    /// A trunk that is held cannot be perturbed.
    fn starts_differ(&self) -> bool {
        self.base != Base::Fixed
    }

    fn run(
        &self,
        candidate: &Candidate,
        start: usize,
        limit_s: f64,
    ) -> Result<CandidateRun, RunFailure> {
        let assembly = self.judged(candidate);
        let assembly = assembly.map_err(|error| match error {
            RigError::Panic { source, .. } => RunFailure::Failed(source.to_string()),
            error => RunFailure::Refused(first_line(&error.to_string())),
        })?;
        let options = RunOptions {
            start,
            limit_s,
            is_recorded: false,
            observer: None,
        };
        let (report, run_s) = run(&assembly, options)?;
        let mut outcomes: Vec<MarginOutcome> = report
            .expectations
            .into_iter()
            .map(margin_outcome)
            .collect();
        let of_computation = outcomes.split_off(self.expectations.len().min(outcomes.len()));
        let work = report.work.unwrap_or_default();
        Ok(CandidateRun {
            outcomes,
            of_computation,
            run_s,
            simulated_s: report.simulated_s.unwrap_or_default(),
            work: work.named().iter().map(|(_, count)| count).sum(),
        })
    }
}
