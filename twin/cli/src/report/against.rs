//! Text form of the comparison with a baseline.

use twinrig_rig::report::{Report, Status};

/// Differences shown in a table; `--json` has all.
const SHOWN: usize = 6;

/// Returns the difference by which a run parts from its baseline, if it fails. Of a run that an
/// error ended, the error is the cause.
pub(super) fn first(report: &Report) -> Option<String> {
    let against = report.against.as_ref()?;
    let first = against.differences.first().cloned();
    first.filter(|_| report.verdict == Status::Fail)
}

/// Returns the measured value of the baseline beside that of an expectation that does not hold.
pub(super) fn before(report: &Report, index: usize) -> Option<f64> {
    let line = report.expectations.get(index)?;
    let measured = report.against.as_ref()?.measured.get(index)?;
    measured.filter(|_| !line.holds())
}

/// Returns the comparison in lines; none without a baseline.
pub(super) fn facts(report: &Report) -> Vec<String> {
    let Some(against) = &report.against else {
        return Vec::new();
    };
    let differences = &against.differences;
    if differences.is_empty() {
        return vec![format!("equal to {}", against.baseline)];
    }
    let head = if against.same {
        format!("within the tolerances of {}", against.baseline)
    } else {
        format!("differs from {}", against.baseline)
    };
    let shown = differences.iter().take(SHOWN).cloned();
    let more = differences.len().saturating_sub(SHOWN);
    let more = (more > 0).then(|| format!("and {more} more: --json has all"));
    std::iter::once(head).chain(shown).chain(more).collect()
}

/// Returns the failure of a comparison in a line; none if it holds.
pub(super) fn failure(report: &Report) -> Option<String> {
    let against = report.against.as_ref().filter(|it| !it.same)?;
    let first = against.differences.first();
    let first = first.map_or("the run is another one", String::as_str);
    Some(format!("{first} ({})", against.baseline))
}
