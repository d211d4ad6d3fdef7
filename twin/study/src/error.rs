use thiserror::Error;

/// Error that prevents a study. A failure of one part is a row of the study instead.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum StudyError {
    /// No plant is selected.
    #[error("there is no plant to study")]
    NoPlant,
    /// The duration is shorter than one sampling period.
    #[error("{duration} is too short to study: nothing shorter than {least} is compared")]
    TooShort {
        /// Requested duration.
        duration: twinrig_kernel::SimDuration,
        /// Least duration.
        least: twinrig_kernel::SimDuration,
    },
    /// The observer or an interrupt stopped the study.
    #[error("interrupted after {done} of {of} parts")]
    Interrupted {
        /// Number of parts begun.
        done: usize,
        /// Number of parts.
        of: usize,
    },
}
