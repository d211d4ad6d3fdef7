//! The recorded results, which the documentation shows.

use crate::thesis::result::ThesisResult;

/// Output of `twin thesis --all --json`, from which the table of docs/thesis.md is made.
const RECORD: &str = include_str!("../../files/thesis.json");

/// Returns the recorded results; none if the file is not valid, as while it is written anew.
pub(crate) fn recorded() -> Option<ThesisResult> {
    serde_json::from_str(RECORD).ok()
}
