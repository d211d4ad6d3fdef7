//! Execution of sweeps.

use std::collections::{BTreeMap, BTreeSet};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::Instant;

use twinrig_campaign::sweep::{
    Partition, ResultRow, RowKey, RowStore, RowVerdict, StoreError, SweepCounts, SweepResult,
    SweepRow, SweepVerdict, run_points,
};
use twinrig_document::Warning;
use twinrig_scenario::Setting;

use crate::assembly::Assembly;
use crate::assembly::registry::Registry;
use crate::error::{TwinError, guarded};
use crate::run::execute::{Execution, execute};
use crate::run::interrupt;
use crate::sweep::plan::SweepPlan;
use crate::sweep::{files, row};

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
    /// Number of runs at the same time.
    pub jobs: NonZeroUsize,
    /// Part of the points that is run.
    pub partition: Partition,
    /// Folder for store and results.
    pub out: PathBuf,
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

/// Runs a sweep: reads its files once, runs the points that the store does not have on `jobs`
/// threads, and writes the files of the result when all points are done. An interrupt ends it; a
/// later call continues it.
///
/// # Errors
/// [`TwinError`] if the sweep cannot start, or its files cannot be written. A run with an error is
/// a row of the result.
pub fn sweep(
    registry: &Registry,
    request: &SweepRequest,
    observer: &mut dyn FnMut(SweepEvent<'_>),
) -> Result<SweepOutcome, TwinError> {
    let plan = SweepPlan::new(
        registry,
        &request.scenario,
        &request.spec,
        &request.settings,
    )?;
    if let Some(warning) = plan.spec.warning() {
        observer(SweepEvent::Warning(&warning));
    }
    let keys: BTreeSet<RowKey> = plan.points.iter().map(|point| point.key).collect();
    let mut store = RowStore::open(&request.out.join(STORE), request.partition, keys)?;
    #[expect(clippy::disallowed_methods, reason = "the rate of a sweep is reported")]
    let started = Instant::now();
    let progress = run_missing(&plan, request, &mut store, observer)?;
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
        warnings: plan.warnings,
        progress,
        wall_s,
    })
}

/// Runs the points of the partition that the store does not have; equal points are run once.
fn run_missing(
    plan: &SweepPlan<'_>,
    request: &SweepRequest,
    store: &mut RowStore,
    observer: &mut dyn FnMut(SweepEvent<'_>),
) -> Result<SweepProgress, TwinError> {
    let mut progress = SweepProgress::default();
    let mut missing: Vec<usize> = Vec::new();
    // Number of points with each of the keys to be run.
    let mut equal: BTreeMap<RowKey, usize> = BTreeMap::new();
    for (index, point) in plan.points.iter().enumerate() {
        if !request.partition.contains(index) {
            continue;
        }
        progress.of += 1;
        if let Some(row) = store.get(&point.key) {
            progress.stored += 1;
            progress.failed += usize::from(row.verdict != RowVerdict::Pass);
        } else {
            let count = equal.entry(point.key).or_insert(0);
            if *count == 0 {
                missing.push(index);
            }
            *count += 1;
        }
    }
    observer(SweepEvent::Progress(progress));
    let mut failed: Option<StoreError> = None;
    run_points(
        &missing,
        request.jobs,
        &|index| run_point(plan, index),
        &mut |row| {
            if let Some((index, row)) = row {
                let key = plan.points[index].key;
                let count = equal.get(&key).copied().unwrap_or(1);
                progress.ran += count;
                progress.failed += if row.verdict == RowVerdict::Pass {
                    0
                } else {
                    count
                };
                if let Err(error) = store.append(key, row) {
                    failed.get_or_insert(error);
                }
            }
            observer(SweepEvent::Progress(progress));
            // Acknowledges an interrupt, upon which the threads end.
            !interrupt::is_requested() && failed.is_none()
        },
    )?;
    failed.map_or(Ok(progress), |error| Err(error.into()))
}

/// Runs a point; none if it was interrupted.
fn run_point(plan: &SweepPlan<'_>, index: usize) -> Option<SweepRow> {
    let run = guarded(&plan.file, || {
        let (sources, settings) = plan.run_of(index);
        let assembly = Assembly::new(plan.registry, sources, &settings)?;
        execute(&assembly, &Execution::default())
    });
    match run {
        Ok(report) if report.error.is_some() && interrupt::is_requested() => None,
        Ok(report) => Some(row::of_report(report)),
        Err(error) => Some(SweepRow::of_error(error.to_string())),
    }
}

/// Returns the result of the rows in the store.
fn result(plan: &SweepPlan<'_>, partition: Partition, store: &RowStore) -> SweepResult {
    let points = plan.points.iter().enumerate();
    let rows = points.filter_map(|(index, point)| {
        Some(ResultRow {
            index,
            name: plan.name(index),
            point: point.values.clone(),
            key: point.key,
            command: plan.command(index),
            row: store.get(&point.key)?.clone(),
        })
    });
    SweepResult {
        name: plan.spec.name.clone(),
        spec: plan.spec.file.clone(),
        scenario: plan.scenario.clone(),
        file: plan.file.clone(),
        build: plan.build.clone(),
        settings: plan.base(),
        design: plan.spec.design,
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
