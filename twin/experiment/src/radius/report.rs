//! Report of a study of radii.

use serde_json::json;

use super::execute::RadiusOutcome;
use super::{radius_markdown, radius_page, radius_summary};
use crate::options::request::StudyReport;

impl RadiusOutcome {
    /// Returns the report.
    pub(crate) fn report(&self) -> StudyReport {
        let mut summary = radius_summary(&self.result);
        let of = match self.runs - self.ran {
            0 => String::new(),
            known => format!(", and {known} of earlier studies"),
        };
        summary.fact("runs", format!("{}{of}", self.ran));
        for note in &self.notes {
            summary.fact("note", note);
        }
        summary.left_out(&self.result.left_out);
        StudyReport {
            markdown: Some(radius_markdown(&self.result)),
            is_negative: self.result.fails_undisturbed(),
            ..StudyReport::new(
                summary,
                radius_page(&self.result),
                self.result.csv(),
                json!(self.result),
            )
        }
    }
}
