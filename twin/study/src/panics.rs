//! Panics of what a study runs: each is the reason of one row, and the others go on.

use std::cell::RefCell;

use twinrig_runtime::caught;

/// The panics of a study so far.
#[derive(Debug, Default)]
pub(crate) struct Panics(RefCell<Vec<String>>);

impl Panics {
    /// Does `what`. A panic in it is kept.
    ///
    /// # Errors
    /// What panicked and where, or why `what` gives nothing.
    pub(crate) fn guarded<R>(&self, what: impl FnOnce() -> Result<R, String>) -> Result<R, String> {
        caught(what).unwrap_or_else(|panic| {
            let why = panic.to_string();
            self.0.borrow_mut().push(why.clone());
            Err(why)
        })
    }

    /// Everything that was kept.
    pub(crate) fn into_all(self) -> Vec<String> {
        self.0.into_inner()
    }
}

/// What a study says of these panics; nothing if there was none.
pub(crate) fn error(panics: &[String]) -> Option<String> {
    let (first, others) = panics.split_first()?;
    Some(match others.len() {
        0 => format!("error: {first}"),
        more => format!("error: {first}, and {more} more panics"),
    })
}
