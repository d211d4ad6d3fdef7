//! Page of a sweep: shares with intervals, margins over the dimensions, failures with commands. It
//! contains neither times nor the machine, so that equal sweeps have equal pages.

mod plots;
#[cfg(test)]
mod tests;

use twinrig_campaign::sweep::{
    ElementaryEffect, FailedRun, Share, ShareVerdict, SweepResult, SweepVerdict,
};
use twinrig_report::number::quantity;
use twinrig_report::page::{Block, Card, Figure, Page, Term};
use twinrig_report::table::{Cell, Column, Interval, Table, Tone};

use plots::{SweepAxis, margins, passing, plane};

/// Greatest number of plots of margins.
const PLOTS: usize = 12;

/// Returns the page of a sweep.
pub fn sweep_page(result: &SweepResult) -> Page {
    let axes: Vec<SweepAxis<'_>> = (0..result.dimensions.len())
        .map(|index| SweepAxis::of(result, index))
        .collect();
    let mut blocks = vec![Block::Cards(cards(result))];
    blocks.extend(result.warning().map(Block::Text));
    if !result.shares.is_empty() {
        blocks.push(Block::heading("Shares"));
        blocks.push(Block::Table(share_table(result)));
        blocks.push(Block::Text(
            "Score intervals of Wilson, for independent draws: the points of a grid are none, and \
             those of a Latin hypercube scatter less. Thin lines are bounds."
                .to_owned(),
        ));
    }
    blocks.push(Block::heading("Runs that pass"));
    let passing = axes.iter().map(|axis| passing(result, axis));
    blocks.push(Block::Figures(passing.collect()));
    let effects = result.elementary_effects();
    if effects.is_empty() {
        let pairs = axes.iter().enumerate();
        let pairs = pairs
            .flat_map(|(index, x)| axes[index + 1..].iter().map(move |y| (x, y)))
            .map(|(x, y)| plane(result, x, y));
        let pairs: Vec<Figure> = pairs.collect();
        if !pairs.is_empty() {
            blocks.push(Block::Figures(pairs));
        }
        blocks.push(Block::heading("Margins"));
        blocks.extend(strongest(result, &axes));
    } else {
        // Plots of all pairs of so many dimensions would be no overview.
        blocks.push(Block::heading("Elementary effects"));
        blocks.push(Block::Text(
            "Changes of a measured value per whole interval of a dimension: their mean μ, the mean \
             μ* of their magnitudes, and their standard deviation σ."
                .to_owned(),
        ));
        blocks.push(Block::Table(effect_table(&effects, usize::MAX)));
    }
    blocks.push(Block::heading("Failures"));
    blocks.extend(failures(result));
    Page {
        kind: "Sweep".to_owned(),
        title: format!("{}: {}", result.name, result.scenario),
        headline: headline(result),
        blocks,
        terms: terms(result),
    }
}

/// Returns the plots of the margins that depend most on a dimension, and sentences on the others.
fn strongest(result: &SweepResult, axes: &[SweepAxis<'_>]) -> Vec<Block> {
    let mut plots = Vec::new();
    let mut same = Vec::new();
    for (name, units) in result.expectations() {
        let of_units = units.iter().map(|unit| (name, *unit));
        let of_axes = of_units.flat_map(|of| axes.iter().map(move |axis| (of, axis)));
        let before = plots.len();
        plots.extend(of_axes.filter_map(|((name, unit), axis)| margins(result, axis, name, unit)));
        if plots.len() == before {
            same.push(name);
        }
    }
    plots.sort_by(|(one, _), (other, _)| other.total_cmp(one));
    let more = plots.len().saturating_sub(PLOTS);
    let mut blocks = Vec::new();
    if !plots.is_empty() {
        let rest = match more {
            0 => String::new(),
            more => format!(" {more} plots of a weaker dependence are left out; rows.csv has all."),
        };
        blocks.push(Block::Text(format!(
            "The margin of an expectation is the distance to its bound; below 0 the expectation \
             fails. The margins that depend most on a dimension come first, by the share of their \
             variance between its ranges.{rest}"
        )));
        let figures = plots.into_iter().take(PLOTS).map(|(_, figure)| figure);
        blocks.push(Block::Figures(figures.collect()));
    }
    if !same.is_empty() {
        let names = same.join(", ");
        blocks.push(Block::Text(format!(
            "No margin, or the same one in all runs within 1 %: {names}."
        )));
    }
    blocks
}

/// Returns the greatest elementary effects on each measured value, at most so many.
pub(super) fn effect_table(effects: &[ElementaryEffect], most: usize) -> Table {
    let mut table = Table::new([
        Column::label("effect on"),
        Column::text("of"),
        Column::number("μ*"),
        Column::number("μ"),
        Column::number("σ"),
        Column::number("number"),
    ]);
    for of_measure in effects.chunk_by(|one, other| one.measure == other.measure) {
        for one in of_measure.iter().take(most) {
            let shown = |value: f64| quantity(value, &one.unit);
            table.row([
                one.measure.as_str().into(),
                Cell::code(&one.dimension),
                shown(one.mu_star).into(),
                shown(one.mu).into(),
                one.sigma.map(shown).into(),
                one.effects.into(),
            ]);
        }
    }
    table
}

fn headline(result: &SweepResult) -> String {
    let counts = &result.counts;
    let runs = format!("{} of {} runs pass", counts.pass, counts.points);
    let passed = |share: &&Share| share.verdict == ShareVerdict::Pass;
    let all = result.shares.len();
    let shares = match result.shares.iter().filter(passed).count() {
        _ if all == 0 => String::new(),
        held => format!("{held} of {all} shares hold; "),
    };
    let word = match result.verdict {
        SweepVerdict::Pass => "Pass",
        SweepVerdict::Undecided => "Undecided",
        SweepVerdict::Error => "Error",
        _ => "Fail",
    };
    let errors = match counts.error {
        0 => String::new(),
        errors => format!(", {errors} have an error"),
    };
    format!("{word}: {shares}{runs}{errors}.")
}

fn cards(result: &SweepResult) -> Vec<Card> {
    let counts = &result.counts;
    let design = format!("{} design", result.design.kind.word());
    let mut cards = vec![
        Card::new("verdict", result.verdict.word().to_owned(), "of the sweep"),
        Card::new("points", counts.points.to_string(), design),
        Card::new("pass", counts.pass.to_string(), "all expectations hold"),
        Card::new("fail", counts.fail.to_string(), "an expectation fails"),
    ];
    if counts.error > 0 {
        let more = "the run did not complete";
        cards.push(Card::new("error", counts.error.to_string(), more));
    }
    cards
}

/// Returns the shares with their intervals and bounds.
pub(super) fn share_table(result: &SweepResult) -> Table {
    let mut table = Table::new([
        Column::label("share"),
        Column::status("verdict"),
        Column::number("held"),
        Column::number("share").only_on_pages(),
        Column::number("interval"),
        Column::number("confidence"),
        Column::number("least"),
        Column::number("greatest"),
    ]);
    for share in &result.shares {
        let Share { interval, .. } = share;
        let tone = match share.verdict {
            ShareVerdict::Pass => Tone::Good,
            ShareVerdict::Fail => Tone::Bad,
            ShareVerdict::Undecided => Tone::Doubtful,
        };
        table.row([
            share.of.as_str().into(),
            Cell::from(share.verdict.word()).with_tone(tone),
            format!("{} of {}", share.held, share.runs).into(),
            share.share.map(Cell::share).into(),
            Interval {
                ends: [interval.low, interval.high],
                share: share.share,
                bounds: [share.min, share.max],
            }
            .into(),
            Cell::share(share.confidence),
            share.min.map(Cell::share).into(),
            share.max.map(Cell::share).into(),
        ]);
    }
    table
}

fn failures(result: &SweepResult) -> Vec<Block> {
    if result.failures.is_empty() {
        return vec![Block::text("All runs pass.")];
    }
    let mut table = Table::new([
        Column::label("point"),
        Column::status("verdict"),
        Column::text("command"),
        Column::reason(),
    ]);
    for FailedRun { name, run } in &result.failures {
        table.row([
            name.as_str().into(),
            Cell::from(run.row.verdict.word()).with_tone(Tone::Bad),
            Cell::code(&run.command),
            run.row.reason().into(),
        ]);
    }
    let mut blocks = vec![Block::Table(table)];
    let all = result.not_passed().count();
    let more = all.saturating_sub(result.failures.len());
    if more > 0 {
        blocks.push(Block::Text(format!("{more} more are in rows.csv.")));
    }
    blocks
}

fn terms(result: &SweepResult) -> Vec<Term> {
    let mut terms = vec![
        Term::code("scenario", &result.file),
        Term::code("specification", &result.spec),
    ];
    let settings = result.settings.iter();
    terms.extend(
        settings.map(|(key, value)| Term::code("set in all runs", format!("{key} = {value}"))),
    );
    let design = &result.design;
    let design = format!("{}, seed {}", design.kind.word(), design.seed);
    let hash = result.hash.as_deref().unwrap_or("incomplete");
    terms.extend([
        Term::code("design", design),
        Term::code("hash of points and runs", hash),
        Term::code("hash of the program", &result.build),
    ]);
    terms
}
