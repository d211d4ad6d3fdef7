//! Panics and exceeded budgets of the parts that a study runs. Each is the reason of one row, and
//! the study continues.

use std::cell::{Cell, RefCell};

use twinrig_runtime::catch_panic;

/// Log of the panics of a study and of its runs over budget.
#[derive(Debug, Default)]
pub(crate) struct Incidents {
    panics: RefCell<Vec<String>>,
    over_budget: Cell<usize>,
}

impl Incidents {
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
            self.panics.borrow_mut().push(why.clone());
            Err(why)
        })
    }

    /// Notes a run that a deadline ended.
    pub(crate) fn note_over_budget(&self) {
        self.over_budget.set(self.over_budget.get() + 1);
    }

    /// Returns the number of incidents so far.
    pub(crate) fn count(&self) -> usize {
        self.panics.borrow().len() + self.over_budget.get()
    }

    /// Returns the messages of all panics.
    pub(crate) fn into_panics(self) -> Vec<String> {
        self.panics.into_inner()
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
