//! The recorded results, which the documentation shows.

use crate::thesis::flips::Flips;
use crate::thesis::result::ThesisResult;

/// Output of `twin thesis --all --json`, from which the table of docs/thesis.md is made.
const RECORD: &str = include_str!("../../files/thesis.json");

/// Returns the recorded results; none if the file is not valid, as while it is written anew.
pub(crate) fn recorded() -> Option<ThesisResult> {
    serde_json::from_str(RECORD).ok()
}

/// Outputs of `twin thesis --flips --json`.
const FLIPS: &str = include_str!("../../files/thesis-flips.json");

/// Returns the recorded flips; none if the file is not valid.
pub(crate) fn recorded_flips() -> Option<Flips> {
    serde_json::from_str(FLIPS).ok()
}
