//! Page of a study of radii: a table of all expectations over all axes, and a chart of each axis.
//! It contains neither times nor the machine, so that equal studies have equal pages.

use twinrig_campaign::radius::{AxisResult, ExpectationRadius, RadiusResult, RadiusState};
use twinrig_campaign::sweep::percent;

use super::reproduction::Reproduction;
use super::{card, document, drawing};
use crate::radius::{axis_end, not_monotone, radius_cell, radius_resolution, radius_value};
use twinrig_report::html::element::{element, escaped, in_unit, paragraph};
use twinrig_report::html::line_plot::{LinePlot, Series, Shape};
use twinrig_report::html::marker::swatch;
use twinrig_report::html::table::Table;

/// Colours.
const HOLDS: usize = 0;
const FIRST: usize = 7;
const AGAIN: usize = 2;
/// Share of the distance of two bars that is filled.
const BAR: f64 = 0.6;

/// Returns the page of a study of radii.
pub fn radius_page(result: &RadiusResult) -> String {
    let mut body = cards(result);
    body += "<h2>Radii</h2>\n";
    body += &paragraph(
        "The greatest value below the first failure of each expectation. ≥ and ≤: it holds up to \
         the end of the axis. A star: it is not monotone, as it fails and holds again beyond. The \
         first ones to fail along an axis are bold.",
    );
    body += &radii(result);
    body += "<h2>Axes</h2>\n";
    for axis in &result.axes {
        body += &element("h3", "", &escaped(&axis.name));
        body += &section(axis);
    }
    body += &reproduction(result);
    let title = format!("{}: radii", result.scenario);
    document("Radii", &title, &headline(result), &body)
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

fn cards(result: &RadiusResult) -> String {
    let mut cards = String::new();
    for axis in result.axes.iter().filter(|axis| !axis.first.is_empty()) {
        let first = &axis.first[0];
        let radius = axis.expectations.iter().find(|one| one.name == *first);
        let radius = radius.map_or(String::new(), |one| radius_cell(axis, one));
        let others = match axis.first.len() {
            1 => String::new(),
            count => format!(" and {} more", count - 1),
        };
        cards += &card(&axis.name, &radius, &format!("{first}{others}"));
    }
    element("div", "cards", &cards)
}

fn radii(result: &RadiusResult) -> String {
    let mut table = Table::new(&result.head().join(" | "), 1);
    let cell = |(axis, one): (&AxisResult, &ExpectationRadius)| {
        let text = escaped(&radius_cell(axis, one));
        if axis.fails_first(one) {
            element("b", "", &text)
        } else {
            text
        }
    };
    for (name, radii) in result.rows() {
        let cells = std::iter::once(escaped(name)).chain(radii.into_iter().map(cell));
        table.row("", cells.collect());
    }
    table.html()
}

fn section(axis: &AxisResult) -> String {
    let mut text = paragraph(&format!(
        "{}: {} without a disturbance, {} to {}. {} values were tested.",
        axis.about,
        radius_value(axis, axis.nominal),
        axis.direction(),
        axis_end(axis),
        axis.tested.len()
    ));
    let resolution = radius_resolution(axis);
    if !resolution.is_empty() {
        text += &paragraph(&format!(
            "Below the radii, every window of failures wider than {resolution} contains a tested \
             value; narrower ones could have been missed."
        ));
    }
    text += &chart(axis);
    for sentence in not_monotone(axis) {
        text += &paragraph(&sentence);
    }
    if axis.exhausted {
        text += &paragraph("The search ended for the number of its runs.");
    }
    text
}

/// Returns the bars of an axis, one for each expectation, and their legend.
fn chart(axis: &AxisResult) -> String {
    let size = |value: f64| (value - axis.nominal).abs();
    let bars = |is_first: bool| {
        let numbered = axis.expectations.iter().enumerate();
        let of = numbered.filter(|(_, one)| axis.fails_first(one) == is_first);
        let bar = |(index, one): (usize, &ExpectationRadius)| {
            Some([(index + 1) as f64, size(one.holds_to?)])
        };
        Shape::Bars {
            width: BAR,
            points: of.filter_map(bar).collect(),
        }
    };
    let again = axis.expectations.iter().enumerate();
    let again = again.flat_map(|(index, one)| {
        let values = one.holds_again.iter();
        values.map(move |value| [(index + 1) as f64, size(*value)])
    });
    let series = [
        (HOLDS, bars(false)),
        (FIRST, bars(true)),
        (AGAIN, Shape::Dots(again.collect())),
    ];
    let plot = LinePlot {
        title: format!("radii along {}", axis.name),
        width: 1080.0,
        height: 300.0,
        x_label: "number of the expectation".to_owned(),
        y_label: format!(
            "distance from the undisturbed value{}",
            in_unit(axis.unit.symbol())
        ),
        series: series
            .into_iter()
            .map(|(number, shape)| Series { number, shape })
            .collect(),
    };
    let legend = [
        (swatch(HOLDS, false), "radius".to_owned()),
        (swatch(FIRST, false), "first to fail".to_owned()),
        (swatch(AGAIN, false), "holds again".to_owned()),
    ];
    let names = axis.expectations.iter().enumerate();
    let names: Vec<String> = names
        .map(|(index, one)| format!("{} {}", index + 1, one.name))
        .collect();
    drawing("", &legend, &plot.svg(), &format!("{}.", names.join("; ")))
}

fn reproduction(result: &RadiusResult) -> String {
    let mut terms = Reproduction::default();
    terms.code("scenario", &result.file);
    for (key, value) in &result.settings {
        terms.code("set in all runs", &format!("{key} = {value}"));
    }
    for axis in &result.axes {
        terms.code(&format!("keys of {}", axis.name), &axis.keys.join(", "));
    }
    for left_out in &result.left_out {
        terms.code("left out", left_out);
    }
    terms.code("precision", &percent(result.precision));
    terms.code("hash of the program", &result.build);
    terms.section()
}
