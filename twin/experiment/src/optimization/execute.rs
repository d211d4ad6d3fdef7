//! Execution of optimisations.

use std::time::Instant;

use twinrig_campaign::optimization::{
    EvaluationCounts, OptimizationResult, OptimizationVerdict, OptimizedDimension, SearchSpace,
};
use twinrig_campaign::sweep::{Partition, RowStore};
use twinrig_document::Document;
use twinrig_rig::registry::Registry;

use super::files;
use super::outcome::{OptimizationOutcome, OptimizationProgress, OptimizationRequest};
use super::plan::OptimizationPlan;
use super::running::{Running, evaluations};
use crate::error::Error;
use crate::runs::missing::Workers;

/// Folder of the rows in the folder of the results.
const ROWS: &str = "rows";

/// Runs an optimisation: asks the search for generations, has an engine run those of their points
/// that the rows on disk lack, and writes the files of the result when the search has ended. An
/// interrupt ends it; a later call repeats the search with the rows on disk, and continues it.
///
/// # Errors
/// [`Error`] if the optimisation cannot start, or its files cannot be written. A run with an
/// error is a point of great cost.
pub fn optimize(
    registry: &Registry,
    request: &OptimizationRequest,
    observer: &mut dyn FnMut(&OptimizationProgress),
) -> Result<OptimizationOutcome, Error> {
    let workers = Workers::new(registry, &request.engine)?;
    let space = space(request)?;
    let plan = OptimizationPlan::new(registry, &request.scenario, space, &request.settings)?;
    files::refuse_foreign(&plan, &request.out)?;
    let rules = plan.rules.clone();
    let store = RowStore::open(
        &request.out.join(ROWS),
        Partition::WHOLE,
        None,
        move |row| evaluations(&rules, &row),
    )?;
    let mut running = Running {
        result: new_result(&plan)?,
        plan,
        store,
        workers,
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
        store,
        result,
        progress,
        ..
    } = running;
    let mut result = result.judged(is_interrupted);
    let files = if result.verdict == OptimizationVerdict::Interrupted {
        Vec::new()
    } else {
        if let Some(best) = &mut result.best {
            best.row = store.row(best.key)?;
        }
        if let Some(first) = result.first_error() {
            let row = store.row(first.key)?;
            result.error = row.and_then(|row| row.error);
        }
        if let Some(first) = result.first_without_value() {
            let row = store.row(first.key)?;
            let why = row.and_then(|row| Some(row.expectation(&result.objective)?.detail.clone()));
            result.unobserved = why;
        }
        files::write(&plan, &result, &request.out)?
    };
    Ok(OptimizationOutcome {
        result,
        files,
        warnings: plan.runs.warnings,
        notes: store.warnings().to_vec(),
        ran: progress.ran,
        workers: progress.workers,
        wall_s,
    })
}

/// Reads the search space, with the numbers of the request in place of its own.
fn space(request: &OptimizationRequest) -> Result<SearchSpace, Error> {
    let mut space = SearchSpace::read(&Document::read(&request.space)?)?;
    space.particles = request.particles.or(space.particles);
    space.iterations = request.iterations.unwrap_or(space.iterations);
    space.seed = request.seed.unwrap_or(space.seed);
    // An error before the first run.
    space.search()?;
    Ok(space)
}

fn new_result(plan: &OptimizationPlan<'_>) -> Result<OptimizationResult, Error> {
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
