//! `twin cell compare`: filters over drawn cells.

use serde::Serialize;
use twinrig_campaign::sweep::ShareInterval;
use twinrig_estimate::Calibration;
use twinrig_experiment::{BenchRecorder, BenchRun, LoadRecorder, SteadyPart};
use twinrig_kernel::SimDuration;
use twinrig_report::number::{fixed, percent_range};
use twinrig_report::table::{Column, Table};
use twinrig_rig::parts::tactile::{NamedCalibrations, filters};
use twinrig_rig::registry::Registry;
use twinrig_scenario::Setting;
use twinrig_tactile::{LoadFilter, Stage};

use super::calibrate::constants;
use super::report::{CellReport, settings};
use crate::args::CellCompareArgs;
use crate::error::TwinError;

/// Added to the seeds of identifications, so that no cell is judged on the noise that it was
/// calibrated with.
const IDENTIFICATION: u64 = 1000;
/// Time after the begin of a steady part that does not count, while the filters settle: with the
/// second that the part leaves out, 2.5 s, as in the expectations of scenarios/bench.toml.
const SETTLING: SimDuration = SimDuration::from_millis(1500);
/// Confidence of the intervals.
const CONFIDENCE: f64 = 0.95;

/// Which constants filters have.
const SOURCES: [&str; 2] = ["own", "common"];

/// Errors of a filter in one cell.
#[derive(Clone, Debug, Serialize)]
pub(super) struct CellError {
    cell: u64,
    filter: String,
    calibration: &'static str,
    /// Root mean square of each steady part \[N\]; none without a calibration.
    error_n: Vec<f64>,
    /// Why the cell has no calibration.
    reason: Option<String>,
}

/// Share of the cells in which a filter meets the limit.
#[derive(Clone, Debug, Serialize)]
pub(super) struct FilterShare {
    filter: String,
    calibration: &'static str,
    met: usize,
    cells: usize,
    interval: ShareInterval,
    /// Median over the cells of the error at each frequency \[N\].
    median_n: Vec<f64>,
    /// Greatest error of a cell at each frequency \[N\].
    greatest_n: Vec<f64>,
}

/// Result of a comparison.
#[derive(Clone, Debug, Serialize)]
pub(super) struct CellComparison {
    scenario: String,
    identification: String,
    limit_n: f64,
    /// Frequencies of the steady parts \[Hz\].
    hz: Vec<f64>,
    shares: Vec<FilterShare>,
    rows: Vec<CellError>,
}

/// Compares the filters of a scenario.
pub(super) fn compare(
    registry: &Registry,
    args: &CellCompareArgs,
) -> Result<CellComparison, TwinError> {
    let design = BenchRecorder::new(registry, &args.identify, &[])?;
    let common = constants(
        &args.identify,
        &design.recorded(design.input().seed.wrapping_add(IDENTIFICATION))?,
    )?;
    let (mut hz, mut rows) = (Vec::new(), Vec::new());
    for cell in 1..=args.cells as u64 {
        let numbered = Setting {
            origin: "twin cell compare".to_owned(),
            key: "plant.cell".to_owned(),
            value: cell.to_string(),
        };
        let bench = BenchRecorder::new(registry, &args.identify, std::slice::from_ref(&numbered))?;
        let seed = bench.input().seed.wrapping_add(IDENTIFICATION + cell);
        // An identification may fail for a cell, which then does not meet the limit.
        let own = constants(&args.identify, &bench.recorded(seed)?);
        let mut settings = settings(&args.set);
        settings.push(numbered);
        let bench = BenchRecorder::new(registry, &args.scenario, &settings)?;
        let seed = bench.input().seed.wrapping_add(cell);
        let mut built = [Vec::new(), Vec::new()];
        let run = bench.samples(seed, |context| {
            let of = |it: &Calibration| filters(context, NamedCalibrations::Replaced(it));
            built[0] = own.as_ref().map_or(Ok(Vec::new()), of)?;
            built[1] = of(&common)?;
            Ok(())
        })?;
        hz = run.steady.iter().map(|part| part.hz).collect();
        if let Err(error) = &own {
            rows.extend(built[1].iter().map(|filter| CellError {
                cell,
                filter: filter.name().to_owned(),
                calibration: SOURCES[0],
                error_n: Vec::new(),
                reason: Some(error.to_string()),
            }));
        }
        for (filters, calibration) in built.into_iter().zip(SOURCES) {
            rows.extend(filters.into_iter().map(|mut filter| CellError {
                cell,
                filter: filter.name().to_owned(),
                calibration,
                error_n: errors(&mut filter, &run),
                reason: None,
            }));
        }
    }
    Ok(CellComparison {
        scenario: args.scenario.display().to_string(),
        identification: args.identify.display().to_string(),
        limit_n: args.limit,
        shares: shares(&rows, hz.len(), args.limit),
        hz,
        rows,
    })
}

/// Returns the root mean square of the error of a filter in each steady part \[N\].
fn errors(filter: &mut LoadFilter, run: &BenchRun) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); run.steady.len()];
    for (sample, frequency) in &run.samples {
        if let (Some(hz), true) = (frequency, filter.has_frequency()) {
            filter.begin_transfer(sample.at, &[*hz]);
        }
        filter.handle_sample(sample);
        let (estimate, reference) = (filter.outputs()[0], sample.reference);
        let at_ns = sample.at.as_nanos();
        let counts =
            |part: &SteadyPart| at_ns >= part.from_ns + SETTLING.as_nanos() && at_ns < part.to_ns;
        if let Some(index) = run.steady.iter().position(counts) {
            let error = estimate - reference;
            sums[index].0 += error * error;
            sums[index].1 += 1.0;
        }
    }
    let root = |(square, count): (f64, f64)| (square / count.max(1.0)).sqrt();
    sums.into_iter().map(root).collect()
}

/// Returns the shares in the order of the filters, for each source of constants.
fn shares(rows: &[CellError], parts: usize, limit: f64) -> Vec<FilterShare> {
    let mut kinds: Vec<(&'static str, &str)> = Vec::new();
    for row in rows {
        let kind = (row.calibration, row.filter.as_str());
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    let share = |(calibration, filter): (&'static str, &str)| {
        let of = |row: &&CellError| row.calibration == calibration && row.filter == filter;
        let meets = |row: &&CellError| {
            row.reason.is_none() && row.error_n.iter().all(|error| *error <= limit)
        };
        let cells = rows.iter().filter(of).count();
        let met = rows.iter().filter(of).filter(meets).count();
        let sorted = |part: usize| {
            let found = rows.iter().filter(of);
            let mut found: Vec<f64> = found
                .map(|row| row.error_n.get(part).copied().unwrap_or(f64::INFINITY))
                .collect();
            found.sort_by(f64::total_cmp);
            found
        };
        FilterShare {
            filter: filter.to_owned(),
            calibration,
            met,
            cells,
            interval: ShareInterval::wilson(met, cells, CONFIDENCE),
            median_n: (0..parts).map(|part| sorted(part)[cells / 2]).collect(),
            greatest_n: (0..parts).map(|part| sorted(part)[cells - 1]).collect(),
        }
    };
    kinds.into_iter().map(share).collect()
}

impl CellReport for CellComparison {
    fn lines(&self) -> Vec<String> {
        let mut table = Table::new([
            Column::label("calibration"),
            Column::label("filter"),
            Column::number("cells"),
            Column::number("95 % interval"),
            Column::number("median error"),
            Column::number("greatest error"),
        ]);
        let list = |errors: &[f64]| {
            let errors: Vec<String> = errors.iter().map(|it| fixed(*it, 3)).collect();
            format!("{} N", errors.join(", "))
        };
        for share in &self.shares {
            let interval = share.interval;
            table.row([
                share.calibration.into(),
                share.filter.as_str().into(),
                format!("{} of {}", share.met, share.cells).into(),
                percent_range([interval.low, interval.high]).into(),
                list(&share.median_n).into(),
                list(&share.greatest_n).into(),
            ]);
        }
        let hz: Vec<String> = self.hz.iter().map(|hz| format!("{hz} Hz")).collect();
        let mut lines = vec![
            format!(
                "cells whose error is at most {} N at {}, each",
                self.limit_n,
                hz.join(" and ")
            ),
            String::new(),
        ];
        lines.extend(table.grid().lines(2));
        lines
    }
}
