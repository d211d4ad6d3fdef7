//! Text form of a study of radii.

use std::path::PathBuf;

use twinrig_experiment::radius_summary;

use super::execute::RadiusOutcome;

/// Formats the radii and the names of their files.
pub(crate) fn text(outcome: &RadiusOutcome, files: &[PathBuf]) -> String {
    let mut summary = radius_summary(&outcome.result);
    let of = match outcome.runs - outcome.ran {
        0 => String::new(),
        known => format!(", and {known} of earlier studies"),
    };
    summary.fact("runs", format!("{}{of}", outcome.ran));
    for note in &outcome.notes {
        summary.fact("note", note);
    }
    summary.left_out(&outcome.result.left_out);
    summary.finish(files)
}
