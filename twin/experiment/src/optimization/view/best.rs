//! Tables of the best point: its values, its cases and its expectations.

use twinrig_campaign::optimization::{BestPoint, Evaluation, OptimizationResult, RunClass};
use twinrig_report::number::{plain, precise};
use twinrig_report::table::{Cell, Column, Table, Tone};

/// Returns the values of the best point between their bounds.
pub fn best_point(result: &OptimizationResult, best: &BestPoint) -> Table {
    let mut table = Table::new([
        Column::label("dimension"),
        Column::number("best"),
        Column::number("from"),
        Column::number("to"),
        Column::text(""),
    ]);
    for (dimension, value) in result.dimensions.iter().zip(&best.point) {
        let bound =
            |number| Cell::from(precise(number, dimension.unit.symbol())).with_tone(Tone::Faint);
        let is_at_bound = best.at_bounds.iter().any(|(key, _)| *key == dimension.key);
        let mark = is_at_bound.then_some("at its bound");
        table.row([
            dimension.key.as_str().into(),
            value.shown().into(),
            bound(dimension.from),
            bound(dimension.to),
            Cell::from(mark).with_tone(Tone::Doubtful),
        ]);
    }
    table
}

/// Returns the evaluations of the best point in all cases.
pub fn best_cases(result: &OptimizationResult, best: &BestPoint) -> Table {
    let mut table = Table::new([
        Column::label("case"),
        Column::number("objective"),
        Column::text(""),
        Column::text("command").only_on_pages(),
    ]);
    for it in &best.cases {
        let value = it.evaluation.objective;
        table.row([
            it.name.as_str().into(),
            value.map(|value| precise(value, &result.unit)).into(),
            Cell::from(evaluation_class(&it.evaluation)).with_tone(Tone::Faint),
            Cell::code(&it.command),
        ]);
    }
    table
}

/// Returns the expectations at the best point.
pub(super) fn expectations(best: &BestPoint) -> Table {
    let mut table = Table::new([
        Column::label("expectation"),
        Column::status("verdict"),
        Column::number("measured"),
        Column::number("bound"),
        Column::text("unit"),
    ]);
    for one in best.row.iter().flat_map(|row| &row.expectations) {
        let tone = if one.holds { Tone::Good } else { Tone::Bad };
        table.row([
            one.name.as_str().into(),
            Cell::from(one.verdict.word()).with_tone(tone),
            one.measured.map(plain).into(),
            one.bound.map(plain).into(),
            one.unit.as_str().into(),
        ]);
    }
    table
}

/// Returns whether a point meets its constraints: `feasible`, `violates 2 constraints`.
pub fn evaluation_class(evaluation: &Evaluation) -> String {
    match (evaluation.class, evaluation.violations) {
        (RunClass::Infeasible, 1) => "violates 1 constraint".to_owned(),
        (RunClass::Infeasible, count) => format!("violates {count} constraints"),
        (class, _) => class.word().to_owned(),
    }
}
