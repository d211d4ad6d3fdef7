//! Reports on radii: values with units, summary and page.

mod chosen;
mod context;
mod disturbances;
pub(crate) mod execute;
pub(crate) mod options;
mod report;
mod request;
mod view;

pub use view::{radius_markdown, radius_page, radius_summary};

use std::f64::consts::PI;

use twinrig_campaign::radius::{AxisEnd, AxisResult, ExpectationRadius, RadiusState};
use twinrig_kernel::Unit;
use twinrig_report::number::{plain, si};

/// Ratios whose axes stay below it are in parts per million.
const SMALL: f64 = 0.05;

/// Returns a value of an axis with its unit: `3.2 ms`.
pub(crate) fn radius_value(axis: &AxisResult, value: f64) -> String {
    match axis.unit {
        Unit::One if axis.nominal.abs().max(axis.limit.abs()) < SMALL => {
            format!("{} ppm", plain(1e6 * value))
        }
        Unit::One => plain(value),
        Unit::Kilogram => si(1e3 * value, "g"),
        Unit::Radian => format!("{}°", plain(value * 180.0 / PI)),
        unit => si(value, unit.symbol()),
    }
}

/// Returns the radius of an expectation as a cell of a table: `3.2 ms`, `≥ 10 ms`, `fails`. A star
/// marks one that is not monotone.
pub(crate) fn radius_cell(axis: &AxisResult, one: &ExpectationRadius) -> String {
    let value = one.holds_to.map(|value| radius_value(axis, value));
    match (one.state, value) {
        (RadiusState::Found, Some(value)) => {
            let star = if one.is_monotone() { "" } else { "*" };
            format!("{value}{star}")
        }
        (RadiusState::Beyond, Some(value)) if axis.limit < axis.nominal => format!("≤ {value}"),
        (RadiusState::Beyond, Some(value)) => format!("≥ {value}"),
        (RadiusState::Unobserved, _) => "–".to_owned(),
        _ => "fails".to_owned(),
    }
}

/// Returns the end of an axis: `10 ms`, `0.01 (not valid beyond: …)`.
pub(crate) fn axis_end(axis: &AxisResult) -> String {
    let value = radius_value(axis, axis.last());
    match &axis.end {
        AxisEnd::Limit => value,
        AxisEnd::Refused { reason, .. } => format!("{value} (not valid beyond: {reason})"),
    }
}

/// Returns the width of the widest window of failures that could have been missed below a radius of
/// the axis: `23 µs`; empty without a radius.
pub(crate) fn radius_resolution(axis: &AxisResult) -> String {
    let width = axis.resolution();
    width.map_or_else(String::new, |width| radius_value(axis, width))
}

/// Returns sentences about expectations that are not monotone along an axis.
pub(crate) fn not_monotone(axis: &AxisResult) -> Vec<String> {
    let sentence = |one: &ExpectationRadius| {
        let again: Vec<String> = one
            .holds_again
            .iter()
            .map(|value| radius_value(axis, *value))
            .collect();
        let (last, count) = (again.last()?, again.len());
        let fails = radius_value(axis, one.fails_at?);
        let values = if count == 1 { "value" } else { "values" };
        Some(format!(
            "{}, {}: fails at {fails} and holds again at {count} {values} beyond, the last {last}",
            axis.name, one.name
        ))
    };
    axis.expectations.iter().filter_map(sentence).collect()
}
