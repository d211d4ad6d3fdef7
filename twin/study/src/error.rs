use thiserror::Error;

/// Why there is no study at all. What fails of a part of one is a row of it.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum StudyError {
    /// There is nothing to compare.
    #[error("there is no plant to study")]
    NoPlant,
    /// The scene is over before it begins, or its grid has no instant in it.
    #[error("{duration} is too short to study: nothing shorter than {least} is compared")]
    TooShort {
        /// What was asked for.
        duration: twinrig_kernel::SimDuration,
        /// What it takes.
        least: twinrig_kernel::SimDuration,
    },
    /// Somebody ended it.
    #[error("interrupted after {done} of {of} parts")]
    Interrupted {
        /// Parts that were begun.
        done: usize,
        /// Parts there are.
        of: usize,
    },
}
