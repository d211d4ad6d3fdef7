//! Text form of the result of a sweep.

use std::fmt::Write as _;

use anstyle::Style;
use twinrig_campaign::sweep::{
    CompleteRow, RowVerdict, Share, ShareVerdict, SweepResult, SweepVerdict,
};
use twinrig_document::escaped;
use twinrig_report::number::{fixed, percent, percent_range, plain};
use twinrig_report::table::Table;
use twinrig_report::text::grid::{Cell, Grid, Left};
use twinrig_report::text::style::{BOLD, DIM, GREEN, RED, YELLOW, styled};

use super::execute::SweepOutcome;
use super::view::{effect_table, share_table};

/// Greatest number of runs, and of effects on a measured value, that are listed.
const LISTED: usize = 5;

impl SweepOutcome {
    /// Returns the text of a result.
    pub fn text(&self) -> String {
        let result = &self.result;
        let mut out = heading(result);
        out.push_str("\n\n");
        if !result.shares.is_empty() {
            push(&mut out, &share_table(result));
            out.push('\n');
        }
        let _ = writeln!(out, "  {}", verdict(result));
        for line in facts(self).lines(2) {
            let _ = writeln!(out, "{line}");
        }
        let mut effects = result.elementary_effects();
        if effects.is_empty() {
            list(&mut out, result);
        } else {
            // A screening is not about single runs, and their commands set all dimensions.
            effects.retain(|one| one.mu_star > 0.0);
            out.push('\n');
            push(&mut out, &effect_table(&effects, LISTED));
        }
        out
    }
}

fn push(out: &mut String, table: &Table) {
    for line in table.grid().lines(2) {
        // Writing to a string cannot fail.
        let _ = writeln!(out, "{line}");
    }
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

fn bounds(share: &Share) -> String {
    match (share.min, share.max) {
        (Some(min), Some(max)) => format!("{} … {}", percent(min), percent(max)),
        (Some(min), None) => format!("≥ {}", percent(min)),
        (None, Some(max)) => format!("≤ {}", percent(max)),
        (None, None) => String::new(),
    }
}

/// Returns a share as a sentence: `82 of 100 held, 73.3 … 88.3 %, at 95 %; required: ≥ 80.0 %`.
pub fn share_sentence(share: &Share) -> String {
    format!(
        "{} of {} held, {}, at {} %; required: {}",
        share.held,
        share.runs,
        percent_range([share.interval.low, share.interval.high]),
        plain(100.0 * share.confidence),
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
                "{} runs in {} s on {}, {} per second",
                progress.ran,
                fixed(*wall_s, 2),
                progress.workers,
                fixed(rate, 1)
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
