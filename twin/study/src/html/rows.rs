//! Selection of rows, and their formatting as text and table cells.

use crate::row::{Row, RowKind, Series, Status};
use crate::study::Study;

use twinrig_report::html::element::{element, escaped};
use twinrig_report::number::{grouped, grouped_factor, method_setting, si};
use twinrig_report::table::Tone;

/// Returns the rows of integration.
pub(crate) fn integration(study: &Study) -> impl Iterator<Item = &Row> {
    study
        .rows
        .iter()
        .filter(|row| row.kind == RowKind::Integration)
}

/// Returns the rows of integration of a series.
pub(crate) fn of_series<'a>(study: &'a Study, series: Series<'a>) -> impl Iterator<Item = &'a Row> {
    integration(study).filter(move |row| row.series() == series)
}

/// Formats the setting of a row.
pub(crate) fn setting(row: &Row) -> String {
    method_setting(row.step_s, row.tolerance)
}

/// Formats a length; empty if unknown.
pub(crate) fn length(value: Option<f64>) -> String {
    value.map_or(String::new(), |value| si(value, "m"))
}

/// Formats a time; empty if unknown.
pub(crate) fn time(value: Option<f64>) -> String {
    value.map_or(String::new(), |value| si(value, "s"))
}

/// Formats a factor: `1230 ×`; empty if unknown.
pub(crate) fn factor(value: Option<f64>) -> String {
    value.map_or(String::new(), grouped_factor)
}

/// Formats a count; empty if unknown or zero.
pub(crate) fn count(value: Option<u64>) -> String {
    value
        .filter(|&value| value > 0)
        .map_or(String::new(), |value| grouped(&value.to_string()))
}

/// Returns the tag of a row's outcome.
pub(crate) fn status(row: &Row) -> String {
    if row.status == Status::Ok && row.wrong {
        return element("span", "tag bad", "stable, but wrong");
    }
    tag(row.status, row.cut, row.word())
}

/// Returns the tone of an outcome.
pub(crate) fn tone(status: Status, cut: bool) -> Tone {
    match status {
        Status::Ok => Tone::Good,
        _ if cut => Tone::Faint,
        _ => Tone::Bad,
    }
}

/// Returns the coloured tag of an outcome; grey for a run truncated by the budget.
pub(crate) fn tag(status: Status, cut: bool, word: &str) -> String {
    let class = match status {
        Status::Ok => "tag ok",
        _ if cut => "tag",
        _ => "tag bad",
    };
    element("span", class, word)
}

/// Returns how many runs completed, failed and were truncated, in words.
pub(crate) fn outcome(completed: usize, failed: usize, cut: usize) -> String {
    if failed + cut == 0 {
        return "all completed".to_owned();
    }
    let mut parts = vec![format!("{completed} completed")];
    parts.extend((failed > 0).then(|| format!("{failed} failed")));
    parts.extend((cut > 0).then(|| format!("{cut} were cut for the budget")));
    parts.join(", ") + ": see the table of all runs"
}

/// Returns the reason of a row as HTML.
pub(crate) fn why(row: &Row) -> String {
    let why = row.why.as_ref();
    why.map_or(String::new(), |why| element("span", "why", &escaped(why)))
}

/// Returns the CSS class of a row, from its predecessor in the table.
pub(crate) fn class(row: &Row, before: Option<&Row>) -> &'static str {
    let first = before.is_some_and(|before| before.series() != row.series());
    row_class(first, row.status, row.cut)
}

/// Returns the CSS class of a table row that is the `first` of its series or not.
pub(crate) fn row_class(first: bool, status: Status, cut: bool) -> &'static str {
    match (first, status) {
        (true, Status::Ok) => "first",
        (false, Status::Ok) => "",
        (true, _) if cut => "first cut",
        (false, _) if cut => "cut",
        (true, _) => "first bad",
        (false, _) => "bad",
    }
}

/// Returns whether the longest step tried is stable.
pub(crate) fn unlimited(row: &Row) -> bool {
    row.largest_stable_step_s.is_some() && row.least_unstable_step_s.is_none()
}

/// Formats the largest stable step of a row.
pub(crate) fn limit_cell(row: &Row) -> String {
    match row.largest_stable_step_s {
        Some(step) if unlimited(row) => format!("≥ {}", si(step, "s")),
        Some(step) => si(step, "s"),
        None if row.tolerance.is_some() && row.status == Status::Ok => "adaptive".to_owned(),
        None => String::new(),
    }
}

/// Returns the tooltip of a row.
pub(crate) fn title(row: &Row) -> String {
    let mut parts = vec![format!("{}, {}", row.series().name(), setting(row))];
    if let Some(error) = row.error_rms_m {
        parts.push(format!("foot {} RMS", si(error, "m")));
    }
    if let Some(error) = row.error_max_m {
        parts.push(format!("greatest {}", si(error, "m")));
    }
    if row.real_time_factor.is_some() {
        parts.push(format!("{} real time", factor(row.real_time_factor)));
    }
    if let Some(why) = &row.why {
        parts.push(why.clone());
    }
    parts.join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_grouped_and_settings_named() {
        assert_eq!(grouped("1234567"), "1\u{202f}234\u{202f}567");
        assert_eq!(grouped("12"), "12");
        assert_eq!(method_setting(Some(5e-4), None), "500 µs");
        assert_eq!(method_setting(None, Some(1e-8)), "tolerance 10⁻⁸");
        assert_eq!(factor(Some(1234.4)), "1\u{202f}230 ×");
    }
}
