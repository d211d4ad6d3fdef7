//! Requests for optimisations, their progress and outcome.

use std::path::PathBuf;

use twinrig_campaign::engine::EngineStatus;
use twinrig_campaign::optimization::OptimizationResult;
use twinrig_document::Warning;
use twinrig_scenario::Setting;

use crate::options::run::EngineArgs;

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
    /// Engine of the runs.
    pub engine: EngineArgs,
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
