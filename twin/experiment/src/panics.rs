//! Panics of the parts that a study runs: each is the reason of one row, and the study continues.

use std::cell::RefCell;

use twinrig_runtime::catch_panic;

/// Log of the panics of a study.
#[derive(Debug, Default)]
pub(crate) struct Panics(RefCell<Vec<String>>);

impl Panics {
    /// Calls `action`, catches a panic and logs it.
    ///
    /// # Errors
    /// The panic with its location, or the error of `action`.
    pub(crate) fn guarded<R>(
        &self,
        action: impl FnOnce() -> Result<R, String>,
    ) -> Result<R, String> {
        catch_panic(action).unwrap_or_else(|panic| {
            let why = panic.to_string();
            self.0.borrow_mut().push(why.clone());
            Err(why)
        })
    }

    /// Returns all logged panics.
    pub(crate) fn into_messages(self) -> Vec<String> {
        self.0.into_inner()
    }
}

/// Returns the error message of a study for these panics; `None` if there was none.
pub(crate) fn error(panics: &[String]) -> Option<String> {
    let (first, others) = panics.split_first()?;
    Some(match others.len() {
        0 => format!("error: {first}"),
        more => format!("error: {first}, and {more} more panics"),
    })
}
