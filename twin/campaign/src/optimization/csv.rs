//! History and points of an optimisation as tables.

use twinrig_kernel::Unit;

use super::result::{EvaluatedPoint, OptimizationResult};
use crate::sweep::csv_line;

impl OptimizationResult {
    /// Returns the generations as CSV (RFC 4180): evaluations so far, objective of the best point
    /// so far, median of the objective, share of feasible points, cost of the best point, and its
    /// values in SI units.
    pub fn history_csv(&self) -> String {
        let unit = in_unit(&self.unit);
        let mut text = csv_line(
            ["generation", "evaluations"]
                .map(str::to_owned)
                .into_iter()
                .chain([format!("best{unit}"), format!("median{unit}")])
                .chain(["feasible".to_owned(), "cost".to_owned()])
                .chain(self.dimension_heads()),
        );
        let mut points = self.points.iter().peekable();
        let mut best: Option<&EvaluatedPoint> = None;
        for it in &self.history {
            while let Some(point) = points.next_if(|point| point.generation <= it.generation) {
                if best.is_none_or(|best| point.evaluation.cost < best.evaluation.cost) {
                    best = Some(point);
                }
            }
            let numbers = best.iter().flat_map(|best| &best.numbers);
            let cells = [
                it.generation.to_string(),
                it.evaluations.to_string(),
                shown(it.best),
                shown(it.median),
                it.feasible.to_string(),
                it.cost.to_string(),
            ];
            text += &csv_line(cells.into_iter().chain(numbers.map(f64::to_string)));
        }
        text
    }

    /// Returns the keys of the dimensions with their SI units.
    fn dimension_heads(&self) -> impl Iterator<Item = String> {
        self.dimensions.iter().map(|dimension| {
            let symbol = match dimension.unit {
                Unit::One => "",
                unit => unit.symbol(),
            };
            format!("{}{}", dimension.key, in_unit(symbol))
        })
    }

    /// Returns all points as CSV (RFC 4180): generation, values in SI units, the worst case if
    /// there are cases, class, objective, number of violated constraints, cost, time of the fall,
    /// simulated time, key of the row.
    pub fn points_csv(&self) -> String {
        let first = std::iter::once("generation".to_owned());
        let last = ["violations", "cost", "fell_at_s", "simulated_s", "key"].map(str::to_owned);
        let objective = format!("{}{}", self.objective, in_unit(&self.unit));
        let head = first
            .chain(self.dimension_heads())
            .chain((!self.cases.is_empty()).then(|| "case".to_owned()))
            .chain(["class".to_owned(), objective])
            .chain(last);
        let mut text = csv_line(head);
        for point in &self.points {
            let it = &point.evaluation;
            let numbers = point.numbers.iter().map(f64::to_string);
            let cells = std::iter::once(point.generation.to_string()).chain(numbers);
            let cells = cells.chain(self.cases.get(point.case).cloned());
            text += &csv_line(cells.chain([
                it.class.word().to_owned(),
                shown(it.objective),
                it.violations.to_string(),
                it.cost.to_string(),
                shown(it.fell_at_s),
                it.simulated_s.to_string(),
                point.key.to_string(),
            ]));
        }
        text
    }
}

fn in_unit(symbol: &str) -> String {
    match symbol {
        "" | "1" => String::new(),
        symbol => format!(" [{symbol}]"),
    }
}

fn shown(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}
