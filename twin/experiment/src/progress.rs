//! Progress of a running study.

/// Receives the progress of a study, and may stop it.
pub trait ProgressObserver {
    /// Called when the study begins part `part` of `of`, described by `doing`. Returns whether the
    /// study continues.
    fn at(&mut self, part: usize, of: usize, doing: &str) -> bool;
}

/// No observer: the study runs to completion.
impl ProgressObserver for () {
    fn at(&mut self, _: usize, _: usize, _: &str) -> bool {
        true
    }
}
