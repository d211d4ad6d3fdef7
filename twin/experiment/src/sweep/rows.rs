//! Complete rows of a sweep, which are on disk.

use twinrig_campaign::sweep::{
    CompleteRow, FailedRun, ResultRow, RowReader, StoreError, SweepResult, SweepRow,
};

use crate::runs::plan::{RunPlan, set_option};

/// Greatest number of runs that do not pass of which all is kept, for tables of a report.
pub(super) const FAILURES_MOST: usize = 200;

/// Complete rows of a sweep, which are on disk. They are readable as long as the folder of the
/// results is there.
#[derive(Debug)]
pub struct SweepRows {
    reader: RowReader<SweepRow>,
    /// Command of a run without the values of its point.
    command: String,
}

impl SweepRows {
    pub(super) fn new(plan: &RunPlan<'_>, reader: RowReader<SweepRow>) -> Self {
        // A sweep has one case.
        let command = plan.command_of(0, &[]);
        Self { reader, command }
    }

    /// Reads a row of the sweep's result, best one after the other.
    ///
    /// # Errors
    /// [`StoreError`] if it cannot be read, or has been changed.
    pub fn read(
        &mut self,
        result: &SweepResult,
        row: &ResultRow,
    ) -> Result<CompleteRow, StoreError> {
        let mut command = self.command.clone();
        for (dimension, value) in result.dimensions.iter().zip(&row.point) {
            command += &set_option(&dimension.key, &value.toml);
        }
        let row = self.reader.row(row.key, row.place)?;
        Ok(CompleteRow { command, row })
    }

    /// Returns the first runs that do not pass.
    pub(super) fn failures(&mut self, result: &SweepResult) -> Result<Vec<FailedRun>, StoreError> {
        let failed = result.not_passed().take(FAILURES_MOST).map(|row| {
            Ok(FailedRun {
                name: result.name_of(row),
                run: self.read(result, row)?,
            })
        });
        failed.collect()
    }
}
