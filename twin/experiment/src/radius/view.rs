//! Summary, page and Markdown of a study of radii. The page contains neither times nor the machine,
//! so that equal studies have equal pages.

#[cfg(test)]
mod tests;

use twinrig_campaign::radius::{AxisResult, ExpectationRadius, RadiusResult, RadiusState};
use twinrig_report::number::percent;
use twinrig_report::page::{Block, Card, Page, Term};
use twinrig_report::summary::Summary;
use twinrig_report::table::{Cell, Column, Table, Tone};

use super::{axis_end, not_monotone, radius_cell, radius_resolution, radius_value};

/// Returns the summary, without the numbers of runs.
pub fn radius_summary(result: &RadiusResult) -> Summary {
    let mut summary = Summary::new(&result.scenario, "radii of disturbances", String::new());
    summary.table("holds to", &radii(result));
    summary.table("first to fail", &first(result));
    let widths = result.axes.iter().filter_map(|axis| {
        let width = radius_resolution(axis);
        (!width.is_empty()).then(|| format!("    {}: {width}", axis.name))
    });
    let widths: Vec<String> = widths.collect();
    if !widths.is_empty() {
        let heading = "widest window of failures that could be missed below the radii";
        summary.section(heading, widths);
    }
    let notes: Vec<String> = result.axes.iter().flat_map(not_monotone).collect();
    if !notes.is_empty() {
        let lines = notes.iter().map(|note| format!("    {note}"));
        summary.section("not monotone", lines);
    }
    for axis in result.axes.iter().filter(|axis| axis.exhausted) {
        let runs = axis.tested.len();
        summary.fact("ended early", format!("{}, after {runs} runs", axis.name));
    }
    summary
}

/// Returns the page.
pub fn radius_page(result: &RadiusResult) -> Page {
    let mut blocks = vec![
        Block::Cards(cards(result)),
        Block::heading("Radii"),
        Block::Text(
            "The greatest value below the first failure of each expectation. ≥ and ≤: it holds up \
             to the end of the axis. A star: it is not monotone, as it fails and holds again \
             beyond. The first ones to fail along an axis are bold."
                .to_owned(),
        ),
        Block::Table(radii(result)),
        Block::heading("Axes"),
        Block::Table(first(result)),
    ];
    blocks.extend(result.axes.iter().flat_map(section));
    Page {
        kind: "Radii".to_owned(),
        title: format!("{}: radii", result.scenario),
        headline: headline(result),
        blocks,
        terms: terms(result),
    }
}

/// Returns the table of expectations over axes in Markdown.
pub fn radius_markdown(result: &RadiusResult) -> String {
    radii(result).markdown()
}

fn headline(result: &RadiusResult) -> String {
    let all = result.axes.iter().flat_map(|axis| &axis.expectations);
    let of = |state: RadiusState| all.clone().filter(|it| it.state == state).count();
    format!(
        "{} radii along {} axes; {} times an expectation holds up to the end of the axis.",
        of(RadiusState::Found),
        result.axes.len(),
        of(RadiusState::Beyond)
    )
}

fn cards(result: &RadiusResult) -> Vec<Card> {
    let card = |axis: &AxisResult| {
        let first = axis.first.first()?;
        let radius = axis.expectations.iter().find(|one| one.name == *first);
        let others = match axis.first.len() {
            1 => String::new(),
            count => format!(" and {} more", count - 1),
        };
        Some(Card::new(
            axis.name.clone(),
            radius.map_or(String::new(), |one| radius_cell(axis, one)),
            format!("{first}{others}"),
        ))
    };
    result.axes.iter().filter_map(card).collect()
}

/// Returns the radii of all expectations along all axes, below the undisturbed values.
fn radii(result: &RadiusResult) -> Table {
    let mut head = result.head().into_iter();
    let labels = head.next().map(Column::label);
    let mut table = Table::new(labels.into_iter().chain(head.map(Column::number)));
    let undisturbed = result.axes.iter();
    let undisturbed = undisturbed.map(|axis| radius_value(axis, axis.nominal));
    let cells = std::iter::once("undisturbed".to_owned()).chain(undisturbed);
    table.row(cells.map(|text| Cell::from(text).with_tone(Tone::Faint)));
    let cell = |(axis, one): (&AxisResult, &ExpectationRadius)| {
        let tone = match one.state {
            _ if axis.fails_first(one) => Tone::Bad,
            RadiusState::Found if one.is_monotone() => Tone::Plain,
            RadiusState::Found | RadiusState::FailsUndisturbed => Tone::Doubtful,
            RadiusState::Beyond | RadiusState::Unobserved => Tone::Faint,
        };
        Cell::from(radius_cell(axis, one)).with_tone(tone)
    };
    for (name, radii) in result.rows() {
        table.row(std::iter::once(name.into()).chain(radii.into_iter().map(cell)));
    }
    table
}

/// Returns the axes with the expectations that fail first.
fn first(result: &RadiusResult) -> Table {
    let mut table = Table::new([
        Column::label("axis"),
        Column::number("undisturbed"),
        Column::number("holds to"),
        Column::number("fails at"),
        Column::text("first to fail"),
        Column::text("axis ends at"),
    ]);
    for axis in &result.axes {
        let mut radii = axis.expectations.iter();
        let one = radii.find(|one| axis.fails_first(one));
        let value = |value: Option<f64>| Cell::from(value.map(|it| radius_value(axis, it)));
        let error = one.and_then(|one| one.error.as_deref()?.lines().next());
        let names = match (error, axis.first.as_slice()) {
            (Some(error), _) => format!("all: {}", error.trim_start_matches("error: ")).into(),
            (None, []) => Cell::from("none").with_tone(Tone::Faint),
            (None, [first]) => first.as_str().into(),
            (None, [first, others @ ..]) => format!("{first}, and {} more", others.len()).into(),
        };
        table.row([
            axis.name.as_str().into(),
            value(Some(axis.nominal)),
            value(one.and_then(|one| one.holds_to)),
            value(one.and_then(|one| one.fails_at)),
            names,
            Cell::from(axis_end(axis)).with_tone(Tone::Faint),
        ]);
    }
    table
}

fn section(axis: &AxisResult) -> Vec<Block> {
    let mut texts = vec![format!(
        "{}: {} without a disturbance, {} to {}. {} values were tested.",
        axis.about,
        radius_value(axis, axis.nominal),
        axis.direction(),
        axis_end(axis),
        axis.tested.len()
    )];
    let resolution = radius_resolution(axis);
    if !resolution.is_empty() {
        texts.push(format!(
            "Below the radii, every window of failures wider than {resolution} contains a tested \
             value; narrower ones could have been missed."
        ));
    }
    texts.extend(not_monotone(axis));
    if axis.exhausted {
        texts.push("The search stopped at its limit of runs.".to_owned());
    }
    let heading = std::iter::once(Block::Subheading(axis.name.clone()));
    heading.chain(texts.into_iter().map(Block::Text)).collect()
}

fn terms(result: &RadiusResult) -> Vec<Term> {
    let mut terms = vec![Term::code("scenario", &result.file)];
    let settings = result.settings.iter();
    terms.extend(
        settings.map(|(key, value)| Term::code("set in all runs", format!("{key} = {value}"))),
    );
    let axes = result.axes.iter();
    terms.extend(
        axes.map(|axis| Term::code(format!("keys of {}", axis.name), axis.keys.join(", "))),
    );
    let left_out = result.left_out.iter();
    terms.extend(left_out.map(|part| Term::code("left out", part)));
    terms.push(Term::code("precision", percent(result.precision)));
    terms.push(Term::code("hash of the program", &result.build));
    terms
}
