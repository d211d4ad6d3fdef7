//! Text form of the result of a sweep.

use std::fmt::Write as _;

use anstyle::Style;
use twinrig_campaign::sweep::{
    CompleteRow, RowVerdict, Share, ShareVerdict, SweepResult, SweepVerdict, percent,
};
use twinrig_document::escaped;
use twinrig_report::number::quantity;
use twinrig_report::text::grid::{Cell, Grid, Left, Right};
use twinrig_report::text::style::{BOLD, DIM, GREEN, RED, YELLOW, styled};

use super::execute::SweepOutcome;

/// Greatest number of runs, and of effects on a measured value, that are listed.
const LISTED: usize = 5;

impl SweepOutcome {
    /// Returns the text of a result.
    pub fn text(&self) -> String {
        let result = &self.result;
        let mut out = heading(result);
        out.push_str("\n\n");
        if !result.shares.is_empty() {
            for line in shares(result).lines(2) {
                // Writing to a string cannot fail.
                let _ = writeln!(out, "{line}");
            }
            out.push('\n');
        }
        let _ = writeln!(out, "  {}", verdict(result));
        for line in facts(self).lines(2) {
            let _ = writeln!(out, "{line}");
        }
        let effects = effects(result);
        if effects.is_empty() {
            list(&mut out, result);
        } else {
            // A screening is not about single runs, and their commands set all dimensions.
            out.push('\n');
            out.push_str(&effects);
        }
        out
    }
}

/// Returns the greatest elementary effects on each measured value that has any.
fn effects(result: &SweepResult) -> String {
    let mut grid = Grid::new(&[Left, Left, Right, Right, Right, Right]);
    grid.header("effect on | of | μ* | μ | σ | number");
    let effects = result.elementary_effects();
    let mut out = String::new();
    for of_measure in effects.chunk_by(|one, other| one.measure == other.measure) {
        let some = of_measure.iter().filter(|one| one.mu_star > 0.0);
        for (index, one) in some.take(LISTED).enumerate() {
            let shown = |value: f64| quantity(value, &one.unit);
            let measure = if index == 0 { &*one.measure } else { "" };
            grid.row([
                measure.into(),
                one.dimension.as_str().into(),
                shown(one.mu_star).into(),
                shown(one.mu).into(),
                one.sigma.map_or_else(String::new, shown).into(),
                one.effects.to_string().into(),
            ]);
        }
    }
    if !effects.is_empty() {
        for line in grid.lines(2) {
            // Writing to a string cannot fail.
            let _ = writeln!(out, "{line}");
        }
    }
    out
}

fn heading(result: &SweepResult) -> String {
    let details = format!(
        "{} points, {} · {} · {}",
        result.design.points,
        result.design.kind.word(),
        result.spec,
        result.file
    );
    format!("{}  {}", styled(BOLD, &result.name), styled(DIM, &details))
}

fn shares(result: &SweepResult) -> Grid {
    let mut grid = Grid::new(&[Left, Left, Right, Right, Left, Left]);
    grid.header("| share | held | interval | bound |");
    for share in &result.shares {
        let (mark, style) = match share.verdict {
            ShareVerdict::Pass => ("✓", GREEN),
            ShareVerdict::Fail => ("✗", RED),
            ShareVerdict::Undecided => ("?", YELLOW),
        };
        grid.row([
            Cell::new(mark, style),
            share.of.as_str().into(),
            format!("{} of {}", share.held, share.runs).into(),
            interval(share).into(),
            bounds(share).into(),
            Cell::new(share.verdict.word(), style),
        ]);
    }
    grid
}

/// Returns the confidence interval: `93.0 … 99.4 %, at 95 %`.
fn interval(share: &Share) -> String {
    format!(
        "{:.1} … {}, at {} %",
        100.0 * share.interval.low,
        percent(share.interval.high),
        100.0 * share.confidence
    )
}

fn bounds(share: &Share) -> String {
    match (share.min, share.max) {
        (Some(min), Some(max)) => format!("{} … {}", percent(min), percent(max)),
        (Some(min), None) => format!("≥ {}", percent(min)),
        (None, Some(max)) => format!("≤ {}", percent(max)),
        (None, None) => String::new(),
    }
}

/// Returns a share as a sentence: `82 of 100 held, 73.3 … 88.3 %, at 95 %; required: ≥ 80 %`.
pub fn share_sentence(share: &Share) -> String {
    format!(
        "{} of {} held, {}; required: {}",
        share.held,
        share.runs,
        interval(share),
        bounds(share)
    )
}

fn verdict(result: &SweepResult) -> String {
    let (style, explained): (Style, String) = match result.verdict {
        SweepVerdict::Pass => (GREEN, judged(result)),
        SweepVerdict::Fail => (RED, judged(result)),
        SweepVerdict::Undecided => (
            YELLOW,
            "an interval contains its bound; more points decide".to_owned(),
        ),
        SweepVerdict::Partial => (
            BOLD,
            format!(
                "partition {} is complete; {} points of others are missing",
                result.partition, result.counts.missing
            ),
        ),
        SweepVerdict::Interrupted | SweepVerdict::Error => {
            (YELLOW, result.error().unwrap_or_default())
        }
    };
    let word = styled(style, &result.verdict.word().to_uppercase());
    format!("{word}  {}", escaped(&explained))
}

fn judged(result: &SweepResult) -> String {
    if result.shares.is_empty() {
        let counts = &result.counts;
        return format!("{} of {} runs pass", counts.pass, counts.points);
    }
    let passed = |share: &&Share| share.verdict == ShareVerdict::Pass;
    let held = result.shares.iter().filter(passed).count();
    format!("{held} of {} shares hold", result.shares.len())
}

fn facts(outcome: &SweepOutcome) -> Grid {
    let SweepOutcome {
        result,
        files,
        progress,
        wall_s,
        ..
    } = outcome;
    let mut grid = Grid::new(&[Left, Left]);
    let mut fact = |name: &str, text: String| grid.row([Cell::new(name, DIM), text.into()]);
    let counts = &result.counts;
    let mut runs = format!("{} pass, {} fail", counts.pass, counts.fail);
    for (count, word) in [(counts.error, "with an error"), (counts.missing, "missing")] {
        if count > 0 {
            let _ = write!(runs, ", {count} {word}");
        }
    }
    if progress.stored > 0 {
        let _ = write!(runs, "; {} of earlier calls", progress.stored);
    }
    fact("runs", runs);
    if progress.ran > 0 {
        let rate = progress.ran as f64 / wall_s;
        fact(
            "time",
            format!(
                "{} runs in {wall_s:.2} s on {}, {rate:.1} per second",
                progress.ran, progress.workers
            ),
        );
    }
    if let Some(report) = files.iter().find(|path| path.ends_with("report.html")) {
        fact("report", report.display().to_string());
    }
    if let Some(hash) = &result.hash {
        fact("hash", hash.clone());
    }
    grid
}

/// Lists the first runs with errors, then those that fail.
fn list(out: &mut String, result: &SweepResult) {
    for failed in result.failures.iter().take(LISTED) {
        let CompleteRow { command, row } = &failed.run;
        let style = if row.verdict == RowVerdict::Error {
            YELLOW
        } else {
            RED
        };
        let word = styled(style, row.verdict.word());
        let _ = writeln!(
            out,
            "\n  {word}  {}\n    {}",
            escaped(&failed.name),
            escaped(command)
        );
        let error = row.error.as_deref().unwrap_or_default();
        for line in error.lines() {
            let _ = writeln!(out, "    {}", styled(DIM, line));
        }
    }
    let all = result.not_passed().count();
    if all > LISTED {
        // There is a report when all points are done.
        let place = ["", " in the report"][usize::from(result.counts.missing == 0)];
        let _ = writeln!(out, "\n  and {} more{place}", all - LISTED);
    }
}
