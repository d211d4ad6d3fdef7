//! Section of the best point: its values, its cases and its expectations.

use twinrig_campaign::optimization::{BestPoint, OptimizationResult};

use twinrig_report::html::element::{element, escaped, in_unit, paragraph};
use twinrig_report::html::table::HtmlTable;
use twinrig_report::number::plain;

/// Returns the table of the best point and its expectations.
pub(super) fn section(result: &OptimizationResult) -> String {
    let Some(best) = &result.best else {
        return paragraph("There is none.");
    };
    let mut table = HtmlTable::new("dimension | best | from | to |", 1);
    for (dimension, value) in result.dimensions.iter().zip(&best.point) {
        let is_at_bound = best.at_bounds.iter().any(|(key, _)| *key == dimension.key);
        let symbol = in_unit(dimension.unit.symbol());
        table.row(
            "",
            vec![
                element("b", "", &escaped(&dimension.key)),
                escaped(value.shown()),
                escaped(&format!("{}{symbol}", plain(dimension.from))),
                escaped(&format!("{}{symbol}", plain(dimension.to))),
                if is_at_bound {
                    element("span", "tag bad", "at its bound")
                } else {
                    String::new()
                },
            ],
        );
    }
    let mut expectations = HtmlTable::new("expectation | verdict | measured | bound | unit", 2);
    for one in best.row.iter().flat_map(|row| &row.expectations) {
        let class = if one.holds { "tag ok" } else { "tag bad" };
        let number = |value: Option<f64>| value.map_or(String::new(), plain);
        expectations.row(
            "",
            vec![
                element("b", "", &escaped(&one.name)),
                element("span", class, one.verdict.word()),
                number(one.measured),
                number(one.bound),
                escaped(&one.unit),
            ],
        );
    }
    table.html()
        + &cases(result, best)
        + &expectations.html()
        + &element("p", "", &element("code", "", &escaped(&best.command)))
}

/// Returns the table of the evaluations of the best point in all cases; nothing without cases.
fn cases(result: &OptimizationResult, best: &BestPoint) -> String {
    if best.cases.is_empty() {
        return String::new();
    }
    let mut table = HtmlTable::new("case | class | objective | unit | command", 2);
    for it in &best.cases {
        let objective = it.evaluation.objective;
        table.row(
            "",
            vec![
                element("b", "", &escaped(&it.name)),
                it.evaluation.class.word().to_owned(),
                objective.map_or(String::new(), plain),
                escaped(&result.unit),
                element("code", "", &escaped(&it.command)),
            ],
        );
    }
    table.html() + &paragraph("The worst case counts; its expectations are:")
}
