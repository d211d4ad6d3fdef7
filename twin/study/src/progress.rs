//! Who looks on while a study runs.

/// Is told how far a study is, and may end it.
pub trait ProgressObserver {
    /// The study begins part `part` of `of`, which it calls `doing`. It goes on unless this is false.
    fn at(&mut self, part: usize, of: usize, doing: &str) -> bool;
}

/// Nobody looks on.
impl ProgressObserver for () {
    fn at(&mut self, _: usize, _: usize, _: &str) -> bool {
        true
    }
}
