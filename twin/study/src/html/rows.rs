//! Rows of a study in words and cells.

use crate::row::{Row, Status};

use super::text::{element, escaped};
use crate::number::{grouped, grouped_factor, method_setting, si};

/// How the method of a row is set.
pub(crate) fn setting(row: &Row) -> String {
    method_setting(row.step_s, row.tolerance)
}

/// A length, or nothing.
pub(crate) fn length(value: Option<f64>) -> String {
    value.map_or(String::new(), |value| si(value, "m"))
}

/// A time, or nothing.
pub(crate) fn time(value: Option<f64>) -> String {
    value.map_or(String::new(), |value| si(value, "s"))
}

/// `1230 ×`
pub(crate) fn factor(value: Option<f64>) -> String {
    value.map_or(String::new(), grouped_factor)
}

/// A count, or nothing; a zero says nothing either.
pub(crate) fn count(value: Option<u64>) -> String {
    value
        .filter(|&value| value > 0)
        .map_or(String::new(), |value| grouped(&value.to_string()))
}

/// The word of its status, coloured.
pub(crate) fn status(row: &Row) -> String {
    if row.status == Status::Ok && row.wrong {
        return element("span", "tag bad", "stable, but wrong");
    }
    tag(row.status, row.cut, row.word())
}

/// The word of a status, coloured: grey where a run was cut for the budget, which says nothing against it.
pub(crate) fn tag(status: Status, cut: bool, word: &str) -> String {
    let class = match status {
        Status::Ok => "tag ok",
        _ if cut => "tag",
        _ => "tag bad",
    };
    element("span", class, word)
}

/// How many runs came to the end of the scene, and what became of the others.
pub(crate) fn outcome(whole: usize, failed: usize, cut: usize) -> String {
    if failed + cut == 0 {
        return "all came to the end of the scene".to_owned();
    }
    let mut parts = vec![format!("{whole} came to the end")];
    parts.extend((failed > 0).then(|| format!("{failed} failed")));
    parts.extend((cut > 0).then(|| format!("{cut} were cut for the budget")));
    parts.join(", ") + ": see the table of all runs"
}

/// Why it is so.
pub(crate) fn why(row: &Row) -> String {
    let why = row.why.as_ref();
    why.map_or(String::new(), |why| element("span", "why", &escaped(why)))
}

/// The class of its line in a table.
pub(crate) fn class(row: &Row, before: Option<&Row>) -> &'static str {
    let first = before.is_some_and(|before| before.line() != row.line());
    line_class(first, row.status, row.cut)
}

/// The class of a line that is the `first` of its kind or not.
pub(crate) fn line_class(first: bool, status: Status, cut: bool) -> &'static str {
    match (first, status) {
        (true, Status::Ok) => "first",
        (false, Status::Ok) => "",
        (true, _) if cut => "first cut",
        (false, _) if cut => "cut",
        (true, _) => "first bad",
        (false, _) => "bad",
    }
}

/// What a person sees who points at it.
pub(crate) fn title(row: &Row) -> String {
    let mut parts = vec![format!("{}, {}", row.line().name(), setting(row))];
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
