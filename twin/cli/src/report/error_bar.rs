//! Text of numerical errors.

use twinrig_report::comparison::Shown;
use twinrig_rig::report::{ErrorSource, Line};

/// Returns the numerical error of a measured value, `± 2e-5`; empty without one.
pub(super) fn text(line: &Line, shown: &Shown<'_>) -> String {
    let error = line.error_bar.and_then(|bar| bar.error);
    error.map_or_else(String::new, |error| shown.error(error))
}

/// Returns whether the error leaves the verdict open, and where it is not that of the method alone.
pub(super) fn remark(line: &Line) -> Option<String> {
    let bar = line.error_bar?;
    let parts = [
        (!bar.decided).then_some("undecided"),
        (bar.error_by == Some(ErrorSource::Ensemble)).then_some("error of an ensemble"),
    ];
    let parts: Vec<&str> = parts.into_iter().flatten().collect();
    (!parts.is_empty()).then(|| parts.join(", "))
}

/// Returns measured value, error and bound of an undecided verdict.
pub(super) fn sentence(line: &Line, shown: &Shown<'_>) -> String {
    let outcome = &line.outcome;
    let (measured, bound) = (outcome.measured, outcome.bound);
    match measured
        .zip(bound)
        .filter(|_| !text(line, shown).is_empty())
    {
        Some((measured, bound)) => format!(
            "undecided: {} {} beside {}",
            shown.number(measured),
            text(line, shown),
            shown.with_unit(bound)
        ),
        None => "undecided: other runs have another verdict".to_owned(),
    }
}
