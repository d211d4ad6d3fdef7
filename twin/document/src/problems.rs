//! Problems and warnings of a document that is read.

use std::cell::RefCell;

use crate::error::{Problem, Warning};

/// Token returned by a reader in place of a value, after a problem was reported.
///
/// It carries no data, so that a reader can request every key first and return afterwards, and all
/// problems are shown at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reported(pub(crate) ());

/// Problems and warnings collected while a document is read.
#[derive(Debug, Default)]
pub(crate) struct Problems {
    /// `None` where a problem was withdrawn.
    errors: RefCell<Vec<Option<Problem>>>,
    warnings: RefCell<Vec<Warning>>,
}

impl Problems {
    pub fn report(&self, problem: Problem) -> Reported {
        self.errors.borrow_mut().push(Some(problem));
        Reported(())
    }

    /// Index of the next problem, for [`Problems::withdraw`].
    pub fn next(&self) -> usize {
        self.errors.borrow().len()
    }

    /// Withdraws a problem that another one explains.
    pub fn withdraw(&self, index: usize) {
        if let Some(problem) = self.errors.borrow_mut().get_mut(index) {
            *problem = None;
        }
    }

    pub fn warn(&self, code: &'static str, problem: Problem) {
        self.warnings.borrow_mut().push(Warning { code, problem });
    }

    pub fn into_inner(self) -> (Vec<Problem>, Vec<Warning>) {
        let errors = self.errors.into_inner().into_iter().flatten();
        (errors.collect(), self.warnings.into_inner())
    }
}
