//! Execution of sweeps.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use twinrig_campaign::engine::EngineStatus;
use twinrig_campaign::sweep::{
    Partition, ResultRow, RowStore, RowSummaries, RowSummary, RowVerdict, SweepCounts, SweepResult,
    SweepVerdict,
};
use twinrig_document::Warning;
use twinrig_rig::registry::Registry;
use twinrig_rig::run::interrupt;
use twinrig_scenario::Setting;

use crate::error::Error;
use crate::options::run::EngineArgs;
use crate::runs::job::SweepJob;
use crate::runs::missing::{StoredRuns, TaskEvent, Workers};
use crate::runs::recordings::RecordingList;
use crate::sweep::files;
use crate::sweep::plan::SweepPlan;
use crate::sweep::rows::SweepRows;

/// Rows of a sweep on disk, and summaries in memory.
type SweepStore = RowStore<Arc<RowSummary>>;

/// Folder of the store in the folder of the results.
const STORE: &str = "rows";

/// A sweep to be done.
#[derive(Clone, Debug)]
pub struct SweepRequest {
    /// Scenario file.
    pub scenario: PathBuf,
    /// Specification file.
    pub spec: PathBuf,
    /// Settings of all runs.
    pub settings: Vec<Setting>,
    /// Engine of the runs.
    pub engine: EngineArgs,
    /// Part of the points that is run.
    pub partition: Partition,
    /// Folder for store and results.
    pub out: PathBuf,
    /// Folder for a recording of each run, on the machine of the run; none: no recordings.
    pub record: Option<PathBuf>,
}

/// State of a running sweep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SweepProgress {
    /// Points of the partition.
    pub of: usize,
    /// Points that were in the store before.
    pub stored: usize,
    /// Runs that have ended.
    pub ran: usize,
    /// Runs among all these that fail or have an error.
    pub failed: usize,
    /// Workers of the engine.
    pub workers: EngineStatus,
}

/// Event of a sweep for its observer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SweepEvent<'e> {
    /// A warning about the specification, before the runs.
    Warning(&'e str),
    /// State, before the runs and from time to time.
    Progress(SweepProgress),
}

/// A sweep that has ended.
#[derive(Debug)]
pub struct SweepOutcome {
    /// Result; a function of specification, scenario and build.
    pub result: SweepResult,
    /// Its complete rows, which are on disk.
    pub rows: SweepRows,
    /// Files of the result; none while points are missing.
    pub files: Vec<PathBuf>,
    /// Warnings about the scenario.
    pub warnings: Vec<Warning>,
    /// Notes about the store.
    pub notes: Vec<String>,
    /// Runs of this call, and rows of earlier ones.
    pub progress: SweepProgress,
    /// Wall time of the runs \[s\].
    pub wall_s: f64,
}

/// Runs a sweep: reads its files once, has an engine run the points that the store does not have,
/// and writes the files of the result when all points are done. An interrupt ends it; a later call
/// continues it.
///
/// # Errors
/// [`Error`] if the sweep cannot start, or its files cannot be written. A run with an error is
/// a row of the result.
pub fn sweep(
    registry: &Registry,
    request: &SweepRequest,
    observer: &mut dyn FnMut(SweepEvent<'_>),
) -> Result<SweepOutcome, Error> {
    let mut workers = Workers::new(registry, &request.engine)?;
    let mut plan = SweepPlan::new(
        registry,
        &request.scenario,
        &request.spec,
        &request.settings,
        request.record.is_some(),
    )?;
    if let Some(warning) = plan.spec.warning() {
        observer(SweepEvent::Warning(&warning));
    }
    let keys = plan.runs.points.iter().map(|point| point.key).collect();
    let mut summaries = RowSummaries::default();
    let mut store = RowStore::open(
        &request.out.join(STORE),
        request.partition,
        Some(keys),
        move |row| Arc::new(summaries.summary(row)),
    )?;
    workers.recordings = Some(RecordingList::new(&request.out, request.partition));
    #[expect(clippy::disallowed_methods, reason = "the rate of a sweep is reported")]
    let started = Instant::now();
    let progress = run_missing(&plan, request, &mut workers, &mut store, observer)?;
    let wall_s = started.elapsed().as_secs_f64();
    let mut rows = SweepRows::new(&plan.runs, store.reader());
    let mut result = result(&mut plan, request.partition, &store);
    let notes = store.warnings().to_vec();
    result.failures = rows.failures(&result)?;
    let files = if result.counts.missing == 0 {
        files::write(&result, &mut rows, request.partition, &request.out)?
    } else {
        Vec::new()
    };
    Ok(SweepOutcome {
        result,
        rows,
        files,
        notes,
        warnings: plan.runs.warnings,
        progress,
        wall_s,
    })
}

/// Runs the points of the partition that the store does not have; equal points are run once.
fn run_missing(
    plan: &SweepPlan<'_>,
    request: &SweepRequest,
    workers: &mut Workers<'_>,
    store: &mut SweepStore,
    observer: &mut dyn FnMut(SweepEvent<'_>),
) -> Result<SweepProgress, Error> {
    let job = SweepJob {
        runs: &plan.runs,
        record: request.record.as_deref(),
    };
    let points = || (0..plan.runs.points.len()).filter(|&index| request.partition.contains(index));
    let mut progress = SweepProgress::default();
    // Number of missing points of each key.
    let mut equal = BTreeMap::new();
    for index in points() {
        progress.of += 1;
        if let Some(row) = store.get(&job.key(index)) {
            progress.stored += 1;
            progress.failed += usize::from(row.verdict != RowVerdict::Pass);
        } else {
            *equal.entry(job.key(index)).or_insert(0) += 1;
        }
    }
    equal.retain(|_, count| *count > 1);
    observer(SweepEvent::Progress(progress));
    let missing = job.missing(points(), store);
    let ended = workers.run(&job, &missing, store, &mut |event| {
        match event {
            TaskEvent::Status(status) => progress.workers = status,
            TaskEvent::Done { run, value } => {
                let count = equal.get(&job.key(run)).copied().unwrap_or(1);
                progress.ran += count;
                if value.verdict != RowVerdict::Pass {
                    progress.failed += count;
                }
            }
        }
        observer(SweepEvent::Progress(progress));
        true
    })?;
    progress.workers = ended.workers;
    Ok(progress)
}

/// Returns the result of the rows in the store. The plan has no points afterwards.
fn result(plan: &mut SweepPlan<'_>, partition: Partition, store: &SweepStore) -> SweepResult {
    let dimensions = plan.dimensions();
    let points = std::mem::take(&mut plan.runs.points).into_iter();
    let rows = points.enumerate().filter_map(|(index, point)| {
        Some(ResultRow {
            index,
            point: point.values,
            key: point.key,
            place: store.place(&point.key)?,
            summary: Arc::clone(store.get(&point.key)?),
        })
    });
    SweepResult {
        name: plan.spec.name.clone(),
        spec: plan.spec.file.clone(),
        scenario: plan.runs.scenario.clone(),
        file: plan.runs.file.clone(),
        build: plan.runs.build.to_string(),
        settings: plan.runs.base_pairs(),
        design: plan.spec.design,
        trajectory_points: plan.spec.trajectory_points(),
        measures: plan
            .spec
            .measures
            .iter()
            .map(|name| name.value.clone())
            .collect(),
        partition,
        dimensions,
        verdict: SweepVerdict::Partial,
        counts: SweepCounts::default(),
        shares: Vec::new(),
        hash: None,
        share_warning: None,
        rows: rows.collect(),
        failures: Vec::new(),
    }
    .judged(&plan.spec, interrupt::is_requested())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A robot that stands, which a run has to do from 60 ms on.
    const STAND: &str = "robot = 'cheetah-cub'\nduration = '100 ms'\n[plant]\nmodel = 'massless'\n\
        [controller]\nkind = 'stand'\nperiod = '2 ms'\n[[expect]]\nname = 'stands'\n\
        body = { height = { min = '1 cm', max = '1 m' } }\n[[expect]]\nname = 'flies'\n\
        body = { height = { min = '1 m' } }\nafter = '60 ms'\n";
    /// Three points, of which two are equal.
    const SEEDS: &str = "design = 'random'\npoints = 3\n[[dimension]]\nkey = 'seed'\n\
        from = 1\nto = 2\n";

    #[test]
    fn progress_counts_equal_points_and_their_failures() {
        let folder = std::env::temp_dir().join(format!("twinrig-sweep-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let file = |name: &str, text: &str| {
            let path = folder.join(name);
            std::fs::write(&path, text).unwrap();
            path
        };
        let request = SweepRequest {
            scenario: file("stand.toml", STAND),
            spec: file("spec.toml", SEEDS),
            settings: Vec::new(),
            engine: EngineArgs::default(),
            partition: Partition::WHOLE,
            out: folder.clone(),
            record: None,
        };
        let registry = Registry::standard();
        for (stored, ran) in [(0, 3), (3, 0)] {
            let found = sweep(&registry, &request, &mut |_| ()).unwrap().progress;
            let counts = [found.of, found.stored, found.ran, found.failed];
            assert_eq!(counts, [3, stored, ran, 3]);
        }
        std::fs::remove_dir_all(folder).unwrap();
    }
}
