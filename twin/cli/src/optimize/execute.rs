//! Execution of optimisations.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

use twinrig_campaign::engine::{EngineOptions, EngineStatus};
use twinrig_campaign::optimization::{
    EvaluationCounts, OptimizationResult, OptimizationVerdict, OptimizedDimension, SearchSpace,
};
use twinrig_campaign::sweep::{Partition, RowLog};
use twinrig_document::{Document, Warning};
use twinrig_scenario::Setting;

use super::files;
use super::plan::OptimizationPlan;
use super::running::{Running, evaluations};
use crate::error::TwinError;
use crate::sweep::tasks::engine;
use twinrig_rig::registry::Registry;

/// Folder of the rows in the folder of the results.
const ROWS: &str = "rows";

/// An optimisation to be done.
#[derive(Clone, Debug)]
pub struct OptimizationRequest {
    /// Scenario file.
    pub scenario: PathBuf,
    /// File of the search space.
    pub space: PathBuf,
    /// Settings of all runs.
    pub settings: Vec<Setting>,
    /// Points of a generation, in place of those of the search space.
    pub particles: Option<usize>,
    /// Iterations, likewise.
    pub iterations: Option<usize>,
    /// Seed of the search, likewise.
    pub seed: Option<u64>,
    /// Name of the engine that does the runs: `local`, or one of the registry.
    pub engine: String,
    /// Its settings.
    pub options: EngineOptions,
    /// Folder for rows and results.
    pub out: PathBuf,
}

/// State of a running optimisation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OptimizationProgress {
    /// Number of the generation, from 0.
    pub generation: usize,
    /// Number of the last generation.
    pub of: usize,
    /// Evaluations of the generations before.
    pub evaluations: usize,
    /// Runs of this generation.
    pub points: usize,
    /// Runs of this generation that are done.
    pub done: usize,
    /// Runs that have ended; other evaluations are of earlier calls, or of equal points.
    pub ran: usize,
    /// Objective of the best point so far, with its unit.
    pub best: Option<(f64, String)>,
    /// Workers of the engine.
    pub workers: EngineStatus,
}

/// An optimisation that has ended.
#[derive(Clone, Debug)]
pub struct OptimizationOutcome {
    /// Result; a function of scenario, search space and build.
    pub result: OptimizationResult,
    /// Files of the result; none of an interrupted optimisation.
    pub files: Vec<PathBuf>,
    /// Warnings about the scenario.
    pub warnings: Vec<Warning>,
    /// Notes about the rows on disk.
    pub notes: Vec<String>,
    /// Runs of this call.
    pub ran: usize,
    /// Workers of the engine.
    pub workers: EngineStatus,
    /// Wall time of the runs \[s\].
    pub wall_s: f64,
}

/// Runs an optimisation: asks the search for generations, has an engine run those of their points
/// that the rows on disk lack, and writes the files of the result when the search has ended. An
/// interrupt ends it; a later call repeats the search with the rows on disk, and continues it.
///
/// # Errors
/// [`TwinError`] if the optimisation cannot start, or its files cannot be written. A run with an
/// error is a point of great cost.
pub fn optimize(
    registry: &Registry,
    request: &OptimizationRequest,
    observer: &mut dyn FnMut(&OptimizationProgress),
) -> Result<OptimizationOutcome, TwinError> {
    let engine = engine(registry, &request.engine)?;
    let space = space(request)?;
    let plan = OptimizationPlan::new(registry, &request.scenario, space, &request.settings)?;
    files::refuse_foreign(&plan, &request.out)?;
    let mut known = BTreeMap::new();
    let rules = plan.rules.clone();
    let (log, opened) = RowLog::open(
        &request.out.join(ROWS),
        Partition::WHOLE,
        &mut |key, row| {
            known
                .entry(key)
                .or_insert_with(|| evaluations(&rules, &row));
        },
    )?;
    let lines = opened.torn.iter().chain(&opened.damaged);
    let notes = lines.map(ToString::to_string).collect();
    let mut running = Running {
        result: new_result(&plan)?,
        plan,
        log,
        known,
        engine,
        options: &request.options,
        progress: OptimizationProgress::default(),
    };
    #[expect(
        clippy::disallowed_methods,
        reason = "the rate of an optimisation is reported"
    )]
    let started = Instant::now();
    let is_interrupted = !running.search(observer)?;
    let wall_s = started.elapsed().as_secs_f64();
    let Running {
        plan,
        log,
        result,
        progress,
        ..
    } = running;
    let mut result = result.judged(is_interrupted);
    let files = if result.verdict == OptimizationVerdict::Interrupted {
        Vec::new()
    } else {
        if let Some(best) = &mut result.best {
            best.row = log.find(best.key)?;
        }
        if let Some(first) = result.first_error() {
            let row = log.find(first.key)?;
            result.error = row.and_then(|row| row.error);
        }
        if let Some(first) = result.first_without_value() {
            let row = log.find(first.key)?;
            let why = row.and_then(|row| Some(row.expectation(&result.objective)?.detail.clone()));
            result.unobserved = why;
        }
        files::write(&plan, &result, &request.out)?
    };
    Ok(OptimizationOutcome {
        result,
        files,
        warnings: plan.runs.warnings,
        notes,
        ran: progress.ran,
        workers: progress.workers,
        wall_s,
    })
}

/// Reads the search space, with the numbers of the request in place of its own.
fn space(request: &OptimizationRequest) -> Result<SearchSpace, TwinError> {
    let mut space = SearchSpace::read(&Document::read(&request.space)?)?;
    space.particles = request.particles.or(space.particles);
    space.iterations = request.iterations.unwrap_or(space.iterations);
    space.seed = request.seed.unwrap_or(space.seed);
    // An error before the first run.
    space.search()?;
    Ok(space)
}

fn new_result(plan: &OptimizationPlan<'_>) -> Result<OptimizationResult, TwinError> {
    let OptimizationPlan { space, runs, .. } = plan;
    // The usual number of the method, where none is given.
    let first = space.search()?.ask()?;
    let dimensions = runs.keys.iter().zip(&space.dimensions);
    Ok(OptimizationResult {
        name: space.name.clone(),
        verdict: OptimizationVerdict::Interrupted,
        space: space.file.clone(),
        scenario: runs.scenario.clone(),
        file: runs.file.clone(),
        build: runs.build.to_string(),
        settings: runs.base_pairs(),
        method: space.method,
        particles: first.map_or(0, |points| points.len()),
        iterations: space.iterations,
        restarts: space.restarts,
        seed: space.seed,
        objective: space.objective.value.clone(),
        unit: plan.unit.clone(),
        direction: space.direction,
        constraints: plan.constraint_names(),
        dimensions: dimensions
            .map(|(key, dimension)| OptimizedDimension::new(key, dimension))
            .collect(),
        cases: runs
            .cases
            .iter()
            .filter_map(|case| case.name.clone())
            .collect(),
        counts: EvaluationCounts::default(),
        duration_s: plan.duration_s,
        saved: None,
        best: None,
        error: None,
        unobserved: None,
        history: Vec::new(),
        hash: String::new(),
        points: Vec::new(),
    })
}
