//! Expectations: their outcomes, and their measured values over time.

use serde::Serialize;
use twinrig_record::{ExpectationMessage, VerdictMessage};
use twinrig_report::comparison::{Comparison, Shown};
use twinrig_report::table::{Cell, Column as TableColumn, Table, Tone};

use crate::columns::{Column, Columns};
use crate::link::instant;
use crate::run::Run;

/// Expectations of a run.
#[derive(Debug, Serialize)]
pub(crate) struct Judged {
    /// Times of the values on the way \[s\]; none without a repetition.
    times: Option<Column>,
    expectations: Vec<Expected>,
}

/// An expectation.
#[derive(Debug, Serialize)]
struct Expected {
    name: String,
    verdict: String,
    unit: String,
    measured: Option<f64>,
    min: Option<f64>,
    max: Option<f64>,
    /// Decisive instant \[s\].
    at: Option<f64>,
    leg: Option<String>,
    signal: Option<String>,
    element: Option<u32>,
    detail: String,
    /// Measured value if the scenario had ended at each of the times.
    course: Option<Column>,
}

impl Judged {
    pub(crate) fn of(
        run: &Run<'_>,
        verdict: Option<&VerdictMessage>,
        columns: &mut Columns,
    ) -> Self {
        let course = run.repetition().map(|it| it.course.as_slice());
        let course = course.filter(|course| !course.is_empty());
        let times = course.map(|course| {
            let times = course.iter().map(|evaluation| evaluation.at.as_secs_f64());
            columns.add_fine(&times.collect::<Vec<_>>())
        });
        let outcomes = verdict.map_or(&[][..], |verdict| &verdict.expectations);
        let expectations = outcomes.iter().enumerate().map(|(index, outcome)| {
            let course = course.map(|course| {
                let measured = course.iter().map(|evaluation| {
                    let outcome = evaluation.outcomes.get(index);
                    outcome.and_then(|it| it.measured).unwrap_or(f64::NAN)
                });
                columns.add(&measured.collect::<Vec<_>>())
            });
            Expected {
                name: outcome.name.clone(),
                verdict: outcome.verdict.clone(),
                unit: outcome.unit.clone(),
                measured: outcome.measured,
                min: outcome.min,
                max: outcome.max,
                at: decisive(outcome),
                leg: outcome.leg.clone(),
                signal: outcome.signal.clone(),
                element: outcome.element,
                detail: outcome.detail.clone(),
                course,
            }
        });
        Self {
            expectations: expectations.collect(),
            times,
        }
    }
}

/// Returns the decisive instant of an outcome: of the measured value nearest to a violation, or the
/// first violation \[s\].
pub(crate) fn decisive(outcome: &ExpectationMessage) -> Option<f64> {
    outcome.first_violation_s.or(outcome.instant_s)
}

/// Returns whether an outcome does not hold.
pub(crate) fn fails(outcome: &ExpectationMessage) -> bool {
    match outcome.verdict.as_str() {
        "pass" => false,
        "unobserved" => !outcome.optional,
        _ => true,
    }
}

/// Returns the table of the expectations of a run, those that fail first; `run` is its index.
pub(crate) fn table(run: usize, verdict: &VerdictMessage) -> Table {
    let mut table = Table::new([
        TableColumn::status("verdict"),
        TableColumn::label("expectation"),
        TableColumn::text("measured"),
        TableColumn::text("bound"),
        TableColumn::text("margin"),
        TableColumn::text("decisive instant"),
        TableColumn::text("of"),
        TableColumn::reason(),
    ]);
    let outcomes = verdict.expectations.iter().enumerate();
    let (failed, held): (Vec<_>, Vec<_>) = outcomes.partition(|(_, outcome)| fails(outcome));
    for (index, outcome) in failed.into_iter().chain(held) {
        let tone = match outcome.verdict.as_str() {
            "pass" => Tone::Good,
            "fail" => Tone::Bad,
            _ => Tone::Doubtful,
        };
        let comparison = Comparison {
            measured: outcome.measured,
            bound: outcome.bound,
            other_bound: outcome.other_bound,
            margin: outcome.margin,
        };
        let shown = Shown::of(&comparison, &outcome.unit);
        let number = |value: f64| shown.with_unit(value);
        let bound = match (outcome.min, outcome.max) {
            (Some(min), Some(max)) if min == max => Some(format!("= {}", number(min))),
            (Some(min), Some(max)) => Some(format!("{} … {}", shown.number(min), number(max))),
            (Some(min), None) => Some(format!("≥ {}", number(min))),
            (None, Some(max)) => Some(format!("≤ {}", number(max))),
            (None, None) => outcome.bound.map(number),
        };
        let at = decisive(outcome).map(|at| instant(run, at));
        let element = outcome.element.map(|element| format!("[{element}]"));
        let signal = outcome.signal.as_ref();
        let signal = signal.map(|signal| signal.clone() + element.as_deref().unwrap_or_default());
        let of = signal.or_else(|| outcome.leg.clone());
        table.row([
            Cell::from(outcome.verdict.as_str()).with_tone(tone),
            Cell::link(&outcome.name, format!("#expectation-{index}")),
            outcome.measured.map(number).into(),
            bound.into(),
            outcome.margin.map(number).into(),
            at.unwrap_or_default(),
            of.into(),
            outcome.detail.as_str().into(),
        ]);
    }
    table
}
