//! Search of the cheapest sufficient candidate: hopeless candidates end after one run, and none
//! runs for longer than the best so far.

use super::results::{CandidateRow, CandidateStatus, ReferenceRuns, Sufficiency};
use super::rule::{Deviation, ReferenceMargin};
use super::{
    Candidate, CandidateFactory, CandidateReference, CandidateRun, MarginOutcome, RunFailure,
    SufficiencyPlan,
};
use crate::error::StudyError;
use crate::progress::ProgressObserver;

/// Share of the budget for reference and check.
const REFERENCE_SHARE: f64 = 0.5;
/// Times within this share of each other are equal: they differ by the noise of the machine.
const NOISE: f64 = 0.05;
/// Relative difference of the errors of two settings below which finer ones are not run: the error
/// is that of the model.
const SAME_ERROR: f64 = 0.01;
/// Multiple of the best time at which a run is given up: a first run takes longer than later ones.
const PATIENCE: f64 = 1.5;

const COARSER_SUFFICES: &str = "a coarser setting of the method is sufficient";
const COARSER_IS_SLOWER: &str = "a coarser setting of the method takes too long";
const NOT_BY_SETTING: &str = "the error does not fall with the setting";
const NO_BUDGET: &str = "the budget is spent";

/// Searches the cheapest candidate that answers every expectation as the reference does.
///
/// # Errors
/// No reference completes the scenario, or the observer or an interrupt stops the search.
pub fn sufficient(
    factory: &dyn CandidateFactory,
    plan: &SufficiencyPlan,
    observer: &mut dyn ProgressObserver,
) -> Result<Sufficiency, StudyError> {
    let starts = if factory.starts_differ() {
        plan.starts.max(1)
    } else {
        1
    };
    let candidates = factory.refinements().iter().map(Vec::len).sum::<usize>();
    let mut search = Search {
        factory,
        plan,
        observer,
        starts,
        spent_s: 0.0,
        part: 0,
        parts: candidates + 2,
    };
    let (reference, margins) = search.reference()?;
    let simulated = Known {
        reference_s: reference.run_s_per_s,
        margins: &margins,
    };
    let mut rows = vec![search.own(&simulated)?];
    for refinement in factory.refinements() {
        search.refinement(refinement, &simulated, &mut rows)?;
    }
    Ok(Sufficiency {
        starts,
        chosen: cheapest(&rows).filter(|&index| {
            let time = rows[index].run_s_per_s;
            time.is_some_and(|time| time <= reference.run_s_per_s)
        }),
        reference,
        rows,
        margins,
        spent_s: search.spent_s,
    })
}

/// Returns the index of the sufficient row of the least time; among equal times the scenario's own,
/// or else that of the least work.
fn cheapest(rows: &[CandidateRow]) -> Option<usize> {
    let least_s = best_s(rows)?;
    let is_equal = |row: &CandidateRow| {
        row.status == CandidateStatus::Sufficient
            && row
                .run_s_per_s
                .is_some_and(|time| time <= least_s * (1.0 + NOISE))
    };
    let equal = rows.iter().enumerate().filter(|(_, row)| is_equal(row));
    let found = equal.min_by_key(|(index, row)| (*index > 0, row.work.unwrap_or(u64::MAX)));
    found.map(|(index, _)| index)
}

/// Returns the least time of the sufficient rows, per simulated second.
fn best_s(rows: &[CandidateRow]) -> Option<f64> {
    let sufficient = rows
        .iter()
        .filter(|row| row.status == CandidateStatus::Sufficient);
    let times = sufficient.filter_map(|row| row.run_s_per_s);
    times.min_by(f64::total_cmp)
}

/// Results of the reference.
struct Known<'k> {
    /// Per simulated second.
    reference_s: f64,
    margins: &'k [ReferenceMargin],
}

struct Search<'a> {
    factory: &'a dyn CandidateFactory,
    plan: &'a SufficiencyPlan,
    observer: &'a mut dyn ProgressObserver,
    starts: usize,
    /// \[s\]
    spent_s: f64,
    part: usize,
    parts: usize,
}

/// Returns the time of a run per simulated second.
fn rate(run: &CandidateRun) -> f64 {
    run.run_s / run.simulated_s.max(f64::MIN_POSITIVE)
}

/// Returns the least time of the runs per simulated second.
fn least_rate(runs: &[CandidateRun]) -> f64 {
    runs.iter().map(rate).fold(f64::INFINITY, f64::min)
}

/// Returns the outcomes of an expectation in all runs.
fn outcomes(runs: &[CandidateRun], index: usize) -> Vec<&MarginOutcome> {
    let found = runs.iter().filter_map(|run| run.outcomes.get(index));
    found.collect()
}

impl Search<'_> {
    fn begin(&mut self, candidate: &Candidate) -> Result<(), StudyError> {
        let description = candidate.describe();
        if !self.observer.at(self.part, self.parts, &description) {
            return Err(self.interrupted());
        }
        self.part += 1;
        Ok(())
    }

    fn interrupted(&self) -> StudyError {
        StudyError::Interrupted {
            done: self.part,
            of: self.parts,
        }
    }

    /// Runs a candidate from one start. The outer error ends the search.
    fn run(
        &mut self,
        candidate: &Candidate,
        start: usize,
        limit_s: f64,
    ) -> Result<Result<CandidateRun, RunFailure>, StudyError> {
        let found = self.factory.run(candidate, start, limit_s);
        match &found {
            Ok(run) => self.spent_s += run.run_s,
            Err(RunFailure::OverLimit) => self.spent_s += limit_s,
            Err(RunFailure::Interrupted) => return Err(self.interrupted()),
            Err(_) => {}
        }
        Ok(found)
    }

    /// Runs a candidate from all starts.
    fn runs(
        &mut self,
        candidate: &Candidate,
        limit_s: f64,
    ) -> Result<Result<Vec<CandidateRun>, RunFailure>, StudyError> {
        let mut runs = Vec::new();
        for start in 0..self.starts {
            match self.run(candidate, start, limit_s)? {
                Ok(run) => runs.push(run),
                Err(failure) => return Ok(Err(failure)),
            }
        }
        Ok(Ok(runs))
    }

    /// Runs the first affordable reference and its check.
    fn reference(&mut self) -> Result<(ReferenceRuns, Vec<ReferenceMargin>), StudyError> {
        let factory = self.factory;
        let limit_s = REFERENCE_SHARE * self.plan.budget_s / (2 * self.starts) as f64;
        let mut why = "there is none".to_owned();
        for CandidateReference { reference, check } in factory.references() {
            self.begin(reference)?;
            self.part -= 1;
            let mut found = Vec::new();
            for candidate in [reference, check] {
                match self.runs(candidate, limit_s)? {
                    Ok(runs) => found.push(runs),
                    Err(failure) => {
                        why = format!("{}: {failure}", candidate.describe());
                        break;
                    }
                }
            }
            let [runs, checks] = &found[..] else { continue };
            let count = runs.first().map_or(0, |run| run.outcomes.len());
            let margin = |n| ReferenceMargin::of(&outcomes(runs, n), &outcomes(checks, n));
            let margins = (0..count).filter_map(margin).collect();
            let of_computation = runs.iter().flat_map(|run| &run.of_computation);
            let mut failed = Vec::new();
            for outcome in of_computation.filter(|outcome| !outcome.holds) {
                if !failed.contains(&outcome.name) {
                    failed.push(outcome.name.clone());
                }
            }
            self.part += 1;
            let reference = ReferenceRuns {
                reference: reference.clone(),
                check: check.clone(),
                run_s_per_s: least_rate(runs),
                failed_of_computation: failed,
            };
            return Ok((reference, margins));
        }
        Err(StudyError::NoReference { why })
    }

    /// Judges the scenario's own choice by complete runs, whose time is the baseline.
    fn own(&mut self, known: &Known<'_>) -> Result<CandidateRow, StudyError> {
        let own = self.factory.own();
        self.begin(own)?;
        let limit_s = self.plan.budget_s;
        let runs = match self.runs(own, limit_s)? {
            Ok(runs) => runs,
            Err(failure) => return Ok(failed(own, &failure)),
        };
        let (deviations, why) = judge(&runs, known, true);
        let (time, work) = self.timed(own, &runs, limit_s)?;
        Ok(row(own, deviations, why, Some(time), work))
    }

    /// Judges the settings of a method from the coarsest to the first that is sufficient.
    fn refinement(
        &mut self,
        refinement: &[Candidate],
        known: &Known<'_>,
        rows: &mut Vec<CandidateRow>,
    ) -> Result<(), StudyError> {
        let mut skipped = None;
        let mut coarser = None;
        for candidate in refinement {
            self.begin(candidate)?;
            if self.spent_s >= self.plan.budget_s {
                skipped = Some(NO_BUDGET);
            }
            if let Some(why) = skipped {
                let status = CandidateStatus::NotRun;
                rows.push(CandidateRow::without_run(candidate, status, why));
                continue;
            }
            let row = self.candidate(candidate, known, best_s(rows))?;
            skipped = match row.status {
                CandidateStatus::Sufficient => Some(COARSER_SUFFICES),
                CandidateStatus::Slower => Some(COARSER_IS_SLOWER),
                CandidateStatus::Insufficient if is_of_model(&row, coarser.as_ref()) => {
                    Some(NOT_BY_SETTING)
                }
                _ => None,
            };
            coarser = Some(row.clone());
            rows.push(row);
        }
        Ok(())
    }

    fn candidate(
        &mut self,
        candidate: &Candidate,
        known: &Known<'_>,
        best_s: Option<f64>,
    ) -> Result<CandidateRow, StudyError> {
        let simulated_s = self.factory.simulated_s();
        let bound_s = best_s.map_or(known.reference_s, |best| best.min(known.reference_s));
        let limit_s = PATIENCE * bound_s * simulated_s;
        let mut runs = Vec::new();
        for start in 0..self.starts {
            match self.run(candidate, start, limit_s)? {
                Ok(run) => runs.push(run),
                Err(failure) => return Ok(failed(candidate, &failure)),
            }
            let is_complete = runs.len() == self.starts;
            let (deviations, why) = judge(&runs, known, is_complete);
            if is_complete || why.is_some() {
                let is_sufficient = why.is_none();
                let (time, work) = if is_sufficient {
                    let (time, work) = self.timed(candidate, &runs, limit_s)?;
                    (Some(time), work)
                } else {
                    (None, runs.first().map(|run| run.work))
                };
                return Ok(row(candidate, deviations, why, time, work));
            }
        }
        Err(self.interrupted())
    }

    /// Returns the least time of repeated runs from the scenario's start, per simulated second, and
    /// the work of one of them.
    fn timed(
        &mut self,
        candidate: &Candidate,
        runs: &[CandidateRun],
        limit_s: f64,
    ) -> Result<(f64, Option<u64>), StudyError> {
        let mut least = runs.first().map_or(f64::INFINITY, rate);
        for _ in 1..self.plan.repetitions {
            if self.spent_s >= self.plan.budget_s {
                break;
            }
            if let Ok(run) = self.run(candidate, 0, limit_s)? {
                least = least.min(rate(&run));
            }
        }
        Ok((least, runs.first().map(|run| run.work)))
    }
}

/// Returns whether the errors against a candidate are those of a coarser setting.
fn is_of_model(row: &CandidateRow, coarser: Option<&CandidateRow>) -> bool {
    let refused = |row: &CandidateRow| {
        let refused = row.deviations.iter().filter(|one| one.why.is_some());
        let errors = refused.map(|one| Some((one.name.clone(), one.error?)));
        errors.collect::<Option<Vec<_>>>()
    };
    let (Some(own), Some(others)) = (refused(row), coarser.and_then(refused)) else {
        return false;
    };
    let is_same = |((name, error), (other, coarser)): (&(String, f64), &(String, f64))| {
        name == other && (error - coarser).abs() <= SAME_ERROR * coarser.abs()
    };
    !own.is_empty() && own.len() == others.len() && own.iter().zip(&others).all(is_same)
}

/// Returns the deviations of a candidate and the first reason against it.
fn judge(
    runs: &[CandidateRun],
    known: &Known<'_>,
    is_complete: bool,
) -> (Vec<Deviation>, Option<String>) {
    let indexed = known.margins.iter().enumerate();
    let deviations = indexed.map(|(n, margin)| margin.deviation(&outcomes(runs, n), is_complete));
    let deviations: Vec<Deviation> = deviations.collect();
    let mut of_computation = runs.iter().flat_map(|run| &run.of_computation);
    let broken = of_computation.find(|outcome| !outcome.holds);
    let broken = broken.map(|outcome| format!("{}: it fails", outcome.name));
    let refused = deviations.iter().find_map(|deviation| {
        let why = deviation.why.as_ref()?;
        Some(format!("{}: {why}", deviation.name))
    });
    let why = refused.or(broken);
    (deviations, why)
}

fn failed(candidate: &Candidate, failure: &RunFailure) -> CandidateRow {
    let status = match failure {
        RunFailure::Refused(_) => CandidateStatus::Refused,
        RunFailure::Failed(_) | RunFailure::Interrupted => CandidateStatus::Failed,
        RunFailure::OverLimit => CandidateStatus::Slower,
    };
    CandidateRow::without_run(candidate, status, &failure.to_string())
}

fn row(
    candidate: &Candidate,
    deviations: Vec<Deviation>,
    why: Option<String>,
    run_s_per_s: Option<f64>,
    work: Option<u64>,
) -> CandidateRow {
    CandidateRow {
        candidate: candidate.clone(),
        status: if why.is_none() {
            CandidateStatus::Sufficient
        } else {
            CandidateStatus::Insufficient
        },
        why,
        run_s_per_s,
        work,
        deviations,
    }
}
