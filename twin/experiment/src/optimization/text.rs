//! Text form of the result of an optimisation.

use std::fmt::Write as _;

use twinrig_campaign::optimization::{
    BestPoint, OptimizationResult, OptimizationVerdict, RunClass,
};
use twinrig_campaign::sweep::ExpectationVerdict;
use twinrig_document::escaped;
use twinrig_report::number::{percent, precise};
use twinrig_report::text::grid::{Cell, Grid, Left};
use twinrig_report::text::style::{BOLD, DIM, GREEN, RED, YELLOW, styled};

use super::outcome::OptimizationOutcome;
use super::{best_cases, best_point, evaluation_class as class};

impl OptimizationOutcome {
    /// Returns the text of a result.
    pub fn text(&self) -> String {
        let result = &self.result;
        let mut out = heading(result);
        out.push_str("\n\n");
        if let Some(best) = &result.best {
            for line in best_point(result, best).grid().lines(2) {
                // Writing to a string cannot fail.
                let _ = writeln!(out, "{line}");
            }
            out.push('\n');
            if !best.cases.is_empty() {
                for line in best_cases(result, best).grid().lines(2) {
                    let _ = writeln!(out, "{line}");
                }
                out.push('\n');
            }
        }
        let _ = writeln!(out, "  {}", verdict(result));
        for line in facts(self).lines(2) {
            let _ = writeln!(out, "{line}");
        }
        if let Some(error) = &result.error {
            let _ = writeln!(out, "\n  the first of the errors is");
            for line in error.lines() {
                let _ = writeln!(out, "    {}", styled(DIM, line));
            }
        }
        out
    }
}

fn heading(result: &OptimizationResult) -> String {
    let details = format!(
        "{} · {} {} · {} · {}",
        result.method.word(),
        result.direction.word(),
        result.objective,
        result.space,
        result.file
    );
    format!("{}  {}", styled(BOLD, &result.name), styled(DIM, &details))
}

fn verdict(result: &OptimizationResult) -> String {
    let (style, explained) = match (result.verdict, &result.best) {
        (OptimizationVerdict::Found, Some(best)) => (GREEN, achieved(result, best)),
        (OptimizationVerdict::Interrupted, best) => {
            let so_far = best.as_ref().map_or(String::new(), |best| {
                format!("; best so far: {}", achieved(result, best))
            });
            (YELLOW, format!("the same command continues{so_far}"))
        }
        (OptimizationVerdict::Unobserved, _) => {
            let why = result.unobserved.as_ref();
            let why = why.map_or(String::new(), |why| format!(": {why}"));
            let (without, all) = (result.without_value(), result.counts.evaluations);
            let objective = &result.objective;
            (
                RED,
                format!("{objective} has no value in {without} of {all} points{why}"),
            )
        }
        (_, best) => {
            let best = best.as_ref().map_or(String::new(), |best| {
                format!("; the best one {}", class(&best.evaluation))
            });
            (RED, format!("no point meets all constraints{best}"))
        }
    };
    let word = styled(style, &result.verdict.word().to_uppercase());
    format!("{word}  {}", escaped(&explained))
}

/// Returns the objective of the best point: `forward speed 1.21 m/s, evaluation 811 of 1212`.
fn achieved(result: &OptimizationResult, best: &BestPoint) -> String {
    let value = best.evaluation.objective.map_or(String::new(), |value| {
        format!(" {}", precise(value, &result.unit))
    });
    let class = match best.evaluation.class {
        RunClass::Feasible => String::new(),
        _ => format!(", {}", class(&best.evaluation)),
    };
    format!(
        "{}{value}{class}, evaluation {} of {}",
        result.objective, best.number, result.counts.evaluations
    )
}

fn facts(outcome: &OptimizationOutcome) -> Grid {
    let OptimizationOutcome {
        result,
        files,
        ran,
        workers,
        wall_s,
        ..
    } = outcome;
    let mut grid = Grid::new(&[Left, Left]);
    let mut fact = |name: &str, text: String| grid.row([Cell::new(name, DIM), text.into()]);
    let counts = &result.counts;
    let mut points = format!("{} feasible", counts.feasible);
    for (count, word) in [
        (counts.infeasible, "infeasible"),
        (counts.unobserved, "without a value"),
        (counts.error, "with an error"),
    ] {
        if count > 0 {
            let _ = write!(points, ", {count} {word}");
        }
    }
    fact("points", points);
    if counts.fell > 0 {
        let saved = result.saved.map_or(String::new(), |saved| {
            format!(
                "; their early ends saved {} of the simulated time",
                percent(saved)
            )
        });
        let of = if result.cases.is_empty() {
            "runs"
        } else {
            "points"
        };
        fact("falls", format!("{} {of}{saved}", counts.fell));
    }
    fact("generations", result.history.len().to_string());
    if *ran > 0 {
        let hourly = *ran as f64 / wall_s * 3600.0;
        let runs = if *ran == 1 { "run" } else { "runs" };
        let text = format!("{ran} {runs} in {wall_s:.1} s on {workers}, {hourly:.0} an hour");
        fact("time", text);
    }
    if let Some(failed) = failed(result) {
        fact("fails", failed);
    }
    for (name, file) in [("scenario", "best.toml"), ("report", "report.html")] {
        if let Some(path) = files.iter().find(|path| path.ends_with(file)) {
            fact(name, path.display().to_string());
        }
    }
    if result.verdict != OptimizationVerdict::Interrupted {
        fact("hash", result.hash.clone());
    }
    grid
}

/// Returns the expectations that fail at the best point, which are no constraints.
fn failed(result: &OptimizationResult) -> Option<String> {
    let row = result.best.as_ref()?.row.as_ref()?;
    let failed = row.expectations.iter();
    let failed = failed.filter(|one| one.verdict == ExpectationVerdict::Fail);
    let names: Vec<&str> = failed.map(|one| one.name.as_str()).collect();
    (!names.is_empty()).then(|| format!("at the best point: {}", names.join("; ")))
}
