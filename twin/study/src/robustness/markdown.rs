//! Table of a study of robustness in Markdown, for documentation.

use std::fmt::Write as _;

use twinrig_campaign::sweep::percent;

use super::RobustnessStudy;
use twinrig_campaign::spread::{EnsembleKind, ExpectationSpread};
use twinrig_report::number::plain;

impl RobustnessStudy {
    /// Returns a table with a line for each scenario, and one of the expectations of each.
    pub fn markdown(&self) -> String {
        let mut text = format!(
            "| scenario | plant | runs differ by | hold in all {} runs | horizon | growth rate | \
             changed by 1 ulp |\n|---|---|---|---|---|---|---|\n",
            self.plan.runs
        );
        for result in &self.results {
            let all = result.expectations.iter();
            let always = all.filter(|it| it.held == it.runs).count();
            let kind = match result.case.kind {
                EnsembleKind::Starts => "start",
                EnsembleKind::Seeds => "seed",
            };
            let undetermined: Vec<String> =
                result.undetermined().map(|it| escaped(&it.name)).collect();
            // Writing to a `String` cannot fail.
            let _ = writeln!(
                text,
                "| {} | {} | {kind} | {always} of {} | {} | {} | {} |",
                escaped(&result.case.scenario),
                result.case.plant,
                result.expectations.len(),
                result.horizon_text(),
                result.growth_text(),
                undetermined.join(", "),
            );
        }
        for result in &self.results {
            // Writing to a `String` cannot fail.
            let _ = write!(
                text,
                "\n## {}, on {}\n\n{HEAD}",
                result.case.scenario, result.case.plant
            );
            text.extend(result.expectations.iter().map(row));
        }
        text
    }
}

/// Head of the table of expectations.
const HEAD: &str = "| expectation | holds | 95 % interval | least margin | 5 % | median | 95 % | \
                    greatest | unit | not observed | changes at |\n\
                    |---|---|---|---|---|---|---|---|---|---|---|\n";

fn row(one: &ExpectationSpread) -> String {
    let margins = one.margins.map_or([const { String::new() }; 5], |it| {
        [it.min, it.p5, it.median, it.p95, it.max].map(plain)
    });
    let unobserved = match one.unobserved {
        0 => String::new(),
        count => count.to_string(),
    };
    let changes_at = one.changes_at;
    format!(
        "| {} | {} of {} | {} to {} | {} | {} | {unobserved} | {} |\n",
        escaped(&one.name),
        one.held,
        one.runs,
        percent(one.interval.low),
        percent(one.interval.high),
        margins.join(" | "),
        one.unit,
        changes_at.map_or(String::new(), |at| at.to_string()),
    )
}

fn escaped(text: &str) -> String {
    text.replace('|', "\\|")
}
