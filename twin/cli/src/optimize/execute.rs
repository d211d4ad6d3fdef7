//! Execution of optimisations.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::time::Instant;

use twinrig_campaign::engine::{Engine, EngineOptions, EngineStatus};
use twinrig_campaign::optimization::{
    EvaluatedPoint, Evaluation, EvaluationCounts, OptimizationResult, OptimizationVerdict,
    OptimizedDimension, RunClass, SearchSpace,
};
use twinrig_campaign::sweep::{Partition, RowKey, RowLog};
use twinrig_document::{Document, Warning};
use twinrig_scenario::Setting;

use super::files;
use super::plan::OptimizationPlan;
use crate::assembly::registry::Registry;
use crate::error::TwinError;
use crate::run::interrupt;
use crate::sweep::tasks::{RunTasks, TaskEvent, engine};

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
    /// Points of this generation.
    pub points: usize,
    /// Points of this generation that are done.
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
    let mut known = BTreeMap::new();
    let rule = plan.rule.clone();
    let (log, opened) = RowLog::open(
        &request.out.join(ROWS),
        Partition::WHOLE,
        &mut |key, row| {
            known.entry(key).or_insert_with(|| rule.evaluate(&row));
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
    let OptimizationPlan {
        space, runs, rule, ..
    } = plan;
    // The usual number of the method, where none is given.
    let first = space.search()?.ask()?;
    let dimensions = runs.keys.iter().zip(&space.dimensions);
    let constraints = rule.constraints.iter();
    Ok(OptimizationResult {
        name: space.name.clone(),
        verdict: OptimizationVerdict::Interrupted,
        space: space.file.clone(),
        scenario: runs.scenario.clone(),
        file: runs.file.clone(),
        build: runs.build.to_string(),
        settings: runs.base(),
        method: space.method,
        particles: first.map_or(0, |points| points.len()),
        iterations: space.iterations,
        restarts: space.restarts,
        seed: space.seed,
        objective: rule.objective.name.clone(),
        unit: plan.unit.clone(),
        direction: space.direction,
        constraints: constraints.map(|it| it.name.clone()).collect(),
        dimensions: dimensions
            .map(|(key, dimension)| OptimizedDimension::new(key, dimension))
            .collect(),
        counts: EvaluationCounts::default(),
        duration_s: plan.duration_s,
        saved: None,
        best: None,
        error: None,
        history: Vec::new(),
        hash: String::new(),
        points: Vec::new(),
    })
}

/// A running optimisation.
struct Running<'r> {
    plan: OptimizationPlan<'r>,
    log: RowLog,
    /// Evaluations of the rows on disk.
    known: BTreeMap<RowKey, Evaluation>,
    engine: &'r dyn Engine,
    options: &'r EngineOptions,
    result: OptimizationResult,
    progress: OptimizationProgress,
}

impl Running<'_> {
    /// Searches to the end; returns false if an interrupt ended the search.
    fn search(
        &mut self,
        observer: &mut dyn FnMut(&OptimizationProgress),
    ) -> Result<bool, TwinError> {
        let mut search = self.plan.space.search()?;
        self.progress.of = self.plan.space.iterations;
        while let Some(shares) = search.ask()? {
            self.plan.runs.points.clear();
            for shares in &shares {
                let values = self.plan.space.point(shares);
                self.plan.runs.add_point(values, &mut |_| {})?;
            }
            if !self.run_missing(observer)? {
                return Ok(false);
            }
            let points: Vec<EvaluatedPoint> = self.evaluated();
            let costs: Vec<f64> = points.iter().map(|it| it.evaluation.cost).collect();
            search.tell(&costs)?;
            self.add(points);
            if interrupt::is_requested() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Runs the points of this generation that are not known, equal ones once; returns false if an
    /// interrupt left some of them.
    fn run_missing(
        &mut self,
        observer: &mut dyn FnMut(&OptimizationProgress),
    ) -> Result<bool, TwinError> {
        let Self {
            plan,
            log,
            known,
            progress,
            ..
        } = self;
        let points = &plan.runs.points;
        let mut keys = BTreeSet::new();
        let missing: Vec<usize> = (0..points.len())
            .filter(|&index| !known.contains_key(&points[index].key))
            .filter(|&index| keys.insert(points[index].key))
            .collect();
        progress.points = points.len();
        progress.done = points.len() - missing.len();
        observer(progress);
        if missing.is_empty() {
            return Ok(true);
        }
        let tasks = RunTasks {
            runs: &plan.runs,
            engine: self.engine,
            options: self.options,
            record: None,
        };
        let mut collect = |event| {
            match event {
                TaskEvent::Status(status) => progress.workers = status,
                TaskEvent::Done { point, result } => {
                    let key = points[point].key;
                    log.append(key, &result.row)?;
                    known.insert(key, plan.rule.evaluate(&result.row));
                    progress.ran += 1;
                    progress.done += 1;
                }
            }
            observer(progress);
            Ok(())
        };
        let workers = tasks.run(&missing, &mut collect)?;
        progress.workers = workers;
        Ok(points.iter().all(|point| known.contains_key(&point.key)))
    }

    /// Returns the points of this generation, all of which are known.
    fn evaluated(&self) -> Vec<EvaluatedPoint> {
        let points = self.plan.runs.points.iter();
        points
            .filter_map(|point| {
                let numbers = point.values.iter().filter_map(|value| value.number);
                Some(EvaluatedPoint {
                    generation: self.progress.generation,
                    numbers: numbers.collect(),
                    key: point.key,
                    evaluation: *self.known.get(&point.key)?,
                })
            })
            .collect()
    }

    /// Adds a generation to the result.
    fn add(&mut self, points: Vec<EvaluatedPoint>) {
        self.progress.evaluations += points.len();
        self.progress.generation += 1;
        if let Some(index) = self.result.add_generation(points) {
            let values = self.plan.runs.points[index].values.clone();
            let command = self.plan.runs.command_of(&values);
            self.result.set_best(values, index, command);
        }
        let best = self.result.best.as_ref().map(|best| best.evaluation);
        let best = best.filter(|best| best.class == RunClass::Feasible);
        self.progress.best = best
            .and_then(|best| best.objective)
            .map(|value| (value, self.result.unit.clone()));
    }
}
