//! Text form of a study of radii.

use std::path::PathBuf;

use twinrig_campaign::radius::{AxisResult, ExpectationRadius, RadiusResult, RadiusState};
use twinrig_study::{axis_end, not_monotone, radius_cell, radius_resolution, radius_value};

use super::execute::RadiusOutcome;
use crate::study::layout::StudyText;
use twinrig_report::text::grid::{Cell, Grid, Left, Right, Side};
use twinrig_report::text::style::{DIM, RED, YELLOW};

/// Formats the radii and the names of their files.
pub(crate) fn text(outcome: &RadiusOutcome, files: &[PathBuf]) -> String {
    let result = &outcome.result;
    let mut text = StudyText::new(&result.scenario, "radii of disturbances", String::new());
    text.table("holds to", &radii(result));
    text.table("first to fail", &first(result));
    let widths = result
        .axes
        .iter()
        .map(|axis| (axis, radius_resolution(axis)));
    let widths: Vec<_> = widths.filter(|(_, width)| !width.is_empty()).collect();
    if !widths.is_empty() {
        text.section(
            "widest window of failures that could be missed below the radii",
            widths
                .iter()
                .map(|(axis, width)| format!("    {}: {width}", axis.name)),
        );
    }
    let notes: Vec<String> = result.axes.iter().flat_map(not_monotone).collect();
    if !notes.is_empty() {
        text.section(
            "not monotone",
            notes.iter().map(|note| format!("    {note}")),
        );
    }
    let of = match outcome.runs - outcome.ran {
        0 => String::new(),
        known => format!(", and {known} of earlier studies"),
    };
    text.fact("runs", format!("{}{of}", outcome.ran));
    for axis in result.axes.iter().filter(|axis| axis.exhausted) {
        text.fact(
            "ended early",
            format!("{}, after {} runs", axis.name, axis.tested.len()),
        );
    }
    for note in &outcome.notes {
        text.fact("note", note);
    }
    text.finish(&result.left_out, files)
}

fn radii(result: &RadiusResult) -> Grid {
    let sides = std::iter::once(Left).chain(result.axes.iter().map(|_| Right));
    let mut grid = Grid::new(&sides.collect::<Vec<Side>>());
    grid.header(&result.head().join(" | "));
    let cell = |(axis, one): (&AxisResult, &ExpectationRadius)| {
        let text = radius_cell(axis, one);
        match one.state {
            _ if axis.fails_first(one) => Cell::new(text, RED),
            RadiusState::Found if one.is_monotone() => text.into(),
            RadiusState::Found => Cell::new(text, YELLOW),
            RadiusState::FailsUndisturbed => Cell::new(text, RED),
            RadiusState::Beyond | RadiusState::Unobserved => Cell::new(text, DIM),
        }
    };
    for (name, radii) in result.rows() {
        grid.row(std::iter::once(name.into()).chain(radii.into_iter().map(cell)));
    }
    grid
}

/// Returns the axes with the expectations that fail first.
fn first(result: &RadiusResult) -> Grid {
    let mut grid = Grid::new(&[Left, Right, Right, Right, Left, Left]);
    grid.header("axis | undisturbed | holds to | fails at | first to fail | axis ends at");
    for axis in &result.axes {
        let mut radii = axis.expectations.iter();
        let one = radii.find(|one| axis.fails_first(one));
        let value = |value: Option<f64>| -> Cell {
            value
                .map_or(String::new(), |it| radius_value(axis, it))
                .into()
        };
        let error = one.and_then(|one| one.error.as_deref()?.lines().next());
        let names = match axis.first.as_slice() {
            _ if error.is_some() => format!(
                "all: {}",
                error.unwrap_or_default().trim_start_matches("error: ")
            )
            .into(),
            [] => Cell::new("none", DIM),
            [first] => first.as_str().into(),
            [first, others @ ..] => format!("{first}, and {} more", others.len()).into(),
        };
        grid.row([
            axis.name.as_str().into(),
            value(Some(axis.nominal)),
            value(one.and_then(|one| one.holds_to)),
            value(one.and_then(|one| one.fails_at)),
            names,
            Cell::new(axis_end(axis), DIM),
        ]);
    }
    grid
}
