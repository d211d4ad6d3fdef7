//! Execution of sweeps.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::time::Instant;

use twinrig_campaign::engine::{Engine, EngineStatus};
use twinrig_campaign::sweep::{
    Partition, ResultRow, RowKey, RowStore, RowVerdict, SweepCounts, SweepResult, SweepVerdict,
};
use twinrig_document::Warning;
use twinrig_rig::registry::Registry;
use twinrig_rig::run::interrupt;
use twinrig_scenario::Setting;

use crate::error::Error;
use crate::options::run::EngineArgs;
use crate::runs::job::PointResult;
use crate::runs::plan::RunPlan;
use crate::runs::tasks::{RunTasks, TaskEvent, engine};
use crate::sweep::files;
use crate::sweep::plan::SweepPlan;
use crate::sweep::recordings::RecordingList;

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
#[derive(Clone, Debug)]
pub struct SweepOutcome {
    /// Result; a function of specification, scenario and build.
    pub result: SweepResult,
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
    let engine = engine(registry, &request.engine.engine)?;
    let plan = SweepPlan::new(
        registry,
        &request.scenario,
        &request.spec,
        &request.settings,
        request.record.is_some(),
    )?;
    if let Some(warning) = plan.spec.warning() {
        observer(SweepEvent::Warning(&warning));
    }
    let keys: BTreeSet<RowKey> = plan.runs.points.iter().map(|point| point.key).collect();
    let mut store = RowStore::open(&request.out.join(STORE), request.partition, keys)?;
    #[expect(clippy::disallowed_methods, reason = "the rate of a sweep is reported")]
    let started = Instant::now();
    let progress = run_missing(&plan, request, engine, &mut store, observer)?;
    let wall_s = started.elapsed().as_secs_f64();
    // Other partitions may have been completed meanwhile.
    store.read_others()?;
    let result = result(&plan, request.partition, &store);
    let files = if result.counts.missing == 0 {
        files::write(&result, request.partition, &request.out)?
    } else {
        Vec::new()
    };
    Ok(SweepOutcome {
        result,
        files,
        notes: store.warnings().to_vec(),
        warnings: plan.runs.warnings,
        progress,
        wall_s,
    })
}

/// Runs the points of the partition that the store does not have; equal points are run once.
fn run_missing(
    plan: &SweepPlan<'_>,
    request: &SweepRequest,
    engine: &dyn Engine,
    store: &mut RowStore,
    observer: &mut dyn FnMut(SweepEvent<'_>),
) -> Result<SweepProgress, Error> {
    let (mut missing, progress) = MissingPoints::of(&plan.runs, request.partition, store);
    let points = std::mem::take(&mut missing.tasks);
    let mut collector = Collector {
        runs: &plan.runs,
        missing,
        store,
        recordings: RecordingList::new(&request.out, request.partition),
        progress,
    };
    observer(SweepEvent::Progress(collector.progress));
    let tasks = RunTasks {
        runs: &plan.runs,
        engine,
        options: &request.engine.options(),
        record: request.record.as_deref(),
    };
    let ran = tasks.run(&points, &mut |event| {
        let collected = collector.collect(event);
        observer(SweepEvent::Progress(collector.progress));
        collected
    });
    collector.progress.workers = ran?;
    Ok(collector.progress)
}

/// Points to be run.
struct MissingPoints {
    /// Their indices, one for each key.
    tasks: Vec<usize>,
    /// Number of points with each of the keys.
    equal: BTreeMap<RowKey, usize>,
}

impl MissingPoints {
    /// Returns the points of a partition that the store does not have, and the state before them.
    fn of(plan: &RunPlan<'_>, partition: Partition, store: &RowStore) -> (Self, SweepProgress) {
        let mut progress = SweepProgress::default();
        let (mut tasks, mut equal) = (Vec::new(), BTreeMap::new());
        for (index, point) in plan.points.iter().enumerate() {
            if !partition.contains(index) {
                continue;
            }
            progress.of += 1;
            if let Some(row) = store.get(&point.key) {
                progress.stored += 1;
                progress.failed += usize::from(row.verdict != RowVerdict::Pass);
            } else {
                let count = equal.entry(point.key).or_insert(0);
                if *count == 0 {
                    tasks.push(index);
                }
                *count += 1;
            }
        }
        (Self { tasks, equal }, progress)
    }
}

/// Keeps the results of the tasks.
struct Collector<'c> {
    runs: &'c RunPlan<'c>,
    missing: MissingPoints,
    store: &'c mut RowStore,
    recordings: RecordingList,
    progress: SweepProgress,
}

impl Collector<'_> {
    fn collect(&mut self, event: TaskEvent) -> Result<(), Error> {
        match event {
            TaskEvent::Status(status) => self.progress.workers = status,
            TaskEvent::Done { point, result } => self.keep(point, result)?,
        }
        Ok(())
    }

    fn keep(&mut self, task: usize, result: PointResult) -> Result<(), Error> {
        let key = self.runs.points[task].key;
        let count = self.missing.equal.get(&key).copied().unwrap_or(1);
        self.progress.ran += count;
        if result.row.verdict != RowVerdict::Pass {
            self.progress.failed += count;
        }
        if let Some(place) = &result.recording {
            self.recordings.append(key, place)?;
        }
        Ok(self.store.append(key, result.row)?)
    }
}

/// Returns the result of the rows in the store.
fn result(plan: &SweepPlan<'_>, partition: Partition, store: &RowStore) -> SweepResult {
    let points = plan.runs.points.iter().enumerate();
    let rows = points.filter_map(|(index, point)| {
        Some(ResultRow {
            index,
            name: plan.runs.name(index),
            point: point.values.clone(),
            key: point.key,
            command: plan.runs.command(index),
            row: store.get(&point.key)?.clone(),
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
        dimensions: plan.dimensions(),
        verdict: SweepVerdict::Partial,
        counts: SweepCounts::default(),
        shares: Vec::new(),
        hash: None,
        share_warning: None,
        rows: rows.collect(),
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
