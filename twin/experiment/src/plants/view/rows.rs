//! Selection of rows, and their formatting as text and table cells.

use twinrig_report::number::{grouped, grouped_factor, method_setting, si};
use twinrig_report::table::{Cell, Table, Tone};

use crate::plants::row::{Row, RowKind, Series, Status};
use crate::plants::study::Study;

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

/// Returns the outcome of a row.
pub(crate) fn status(row: &Row) -> Cell {
    if row.status == Status::Ok && row.wrong {
        return Cell::from("stable, but wrong").with_tone(Tone::Bad);
    }
    Cell::from(row.word()).with_tone(tone(row.status, row.cut))
}

/// Formats the error of a row; the floor where it is not significant.
pub(crate) fn error(study: &Study, row: &Row) -> String {
    match row.error_rms_m {
        Some(_) if row.at_floor => format!("≤ {}", si(study.floor_of(&row.plant), "m")),
        error => length(error),
    }
}

/// Returns how many of `all` runs are `incomplete`: failed, or truncated by the budget.
pub(crate) fn incomplete<'r>(all: usize, incomplete: impl Iterator<Item = &'r Row>) -> Cell {
    let (cut, failed): (Vec<&Row>, Vec<&Row>) = incomplete.partition(|row| row.cut);
    let count = |of: usize, word: &str| (of > 0).then(|| format!("{of} of {all} {word}"));
    let parts = [count(failed.len(), "failed"), count(cut.len(), "truncated")];
    let text = parts.into_iter().flatten().collect::<Vec<_>>().join(", ");
    let is_cut_only = failed.is_empty();
    Cell::from(text).with_tone(if is_cut_only { Tone::Faint } else { Tone::Bad })
}

/// Returns the tone of an outcome.
pub(crate) fn tone(status: Status, cut: bool) -> Tone {
    match status {
        Status::Ok => Tone::Good,
        _ if cut => Tone::Faint,
        _ => Tone::Bad,
    }
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

/// Marks the last row of a table: whether it is the `first` of a group, and its outcome.
pub(crate) fn mark(table: &mut Table, first: bool, status: Status, cut: bool) {
    if first {
        table.begin_group();
    }
    if status != Status::Ok {
        table.set_tone(tone(status, cut));
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
