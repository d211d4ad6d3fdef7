//! Parts of a study under a time budget: what an earlier start of the program has measured is not
//! measured again.
//!
//! Such studies are sequential: `Parts` gives each part its share of the budget, and takes its
//! result from a `PartStore` where an earlier start has measured it. The key of a part hashes
//! program, machine, files, settings and all that the part depends on, the reference of a row too.
//! What the budget cut is not kept; its time is, and the shares are those of one uninterrupted
//! start. A row has the number of its start, a study the load of each.

mod starts;
mod store;

use std::fmt::Debug;

use serde::Serialize;
use serde::de::DeserializeOwned;
use twinrig_runtime::interrupt;

pub use starts::{Start, Starts};
pub use store::PartStore;

use crate::budget::{Budget, Share, Weight};
use crate::error::StudyError;
use crate::incidents::Incidents;
use crate::progress::ProgressObserver;
use crate::stopwatch::Stopwatch;

/// Observer of a study that measures, and the store of its results; none: nothing is kept.
pub struct Measuring<'a> {
    progress: &'a mut dyn ProgressObserver,
    store: Option<&'a mut PartStore>,
}

impl<'a> Measuring<'a> {
    /// A study whose results are kept in `store`.
    pub fn kept(progress: &'a mut dyn ProgressObserver, store: &'a mut PartStore) -> Self {
        Self {
            progress,
            store: Some(store),
        }
    }
}

impl<'a, O: ProgressObserver> From<&'a mut O> for Measuring<'a> {
    fn from(progress: &'a mut O) -> Self {
        Self::from(progress as &mut dyn ProgressObserver)
    }
}

impl<'a> From<&'a mut dyn ProgressObserver> for Measuring<'a> {
    fn from(progress: &'a mut dyn ProgressObserver) -> Self {
        Self {
            progress,
            store: None,
        }
    }
}

/// Result of a part that can be kept.
pub(crate) trait Measured: Serialize + DeserializeOwned {
    /// Returns whether the budget ended the measurement, of results that name it.
    fn is_cut(&self) -> bool {
        false
    }

    /// Notes the start of the program that measured it, in results with run times.
    fn note_start(&mut self, _start: usize) {}
}

impl<T: Measured> Measured for Vec<T> {
    fn is_cut(&self) -> bool {
        self.iter().any(T::is_cut)
    }
}

impl<T: Measured> Measured for Result<T, String> {
    fn is_cut(&self) -> bool {
        self.as_ref().is_ok_and(T::is_cut)
    }
}

/// Parts of a running study.
pub(crate) struct Parts<'a> {
    budget: Budget,
    measuring: Measuring<'a>,
    incidents: &'a Incidents,
    /// Settings of all parts.
    scope: String,
}

impl<'a> Parts<'a> {
    /// Creates the parts of a study that depend on `scope` and on what each names as its content.
    pub(crate) fn new(
        budget: Budget,
        measuring: &'a mut Measuring<'_>,
        incidents: &'a Incidents,
        scope: &dyn Debug,
    ) -> Self {
        Self {
            budget,
            measuring: Measuring {
                progress: measuring.progress,
                store: measuring.store.as_deref_mut(),
            },
            incidents,
            scope: format!("{scope:?}"),
        }
    }

    /// Begins the next part, whose result is not kept.
    ///
    /// # Errors
    /// The observer stopped the study.
    pub(crate) fn begin(&mut self, label: &str, weight: Weight) -> Result<Share, StudyError> {
        let share = self.budget.next(weight);
        let (part, of) = self.budget.progress();
        if self.measuring.progress.at(part, of, label) {
            Ok(share)
        } else {
            Err(self.interrupted())
        }
    }

    /// Returns the result of the next part, which depends on `content`: that of an earlier start,
    /// or what `run` measures in its share of the budget.
    ///
    /// # Errors
    /// As [`Self::measure_and_report`].
    pub(crate) fn measure<T: Measured>(
        &mut self,
        label: &str,
        weight: Weight,
        content: &dyn Debug,
        run: impl FnOnce(Share) -> T,
    ) -> Result<T, StudyError> {
        self.measure_and_report(label, weight, content, |share, _| Ok(run(share)))
    }

    /// Returns the result of the next part, which depends on `content`: that of an earlier start,
    /// or what `run` measures in its share of the budget. `run` may report its progress, and ends
    /// where that returns no. Results that the budget cut, and those of a panic, are not kept; the
    /// time spent on them is.
    ///
    /// # Errors
    /// The observer or an interrupt stopped the study, the store cannot be written, or the error of
    /// `run`.
    pub(crate) fn measure_and_report<T: Measured>(
        &mut self,
        label: &str,
        weight: Weight,
        content: &dyn Debug,
        run: impl FnOnce(Share, &mut dyn FnMut(&str) -> bool) -> Result<T, StudyError>,
    ) -> Result<T, StudyError> {
        let (key, found) = match &mut self.measuring.store {
            None => (None, None),
            Some(store) => {
                let key = store.key(&self.scope, content);
                // As if the earlier starts were this one.
                self.budget.charge(store.spent_s(key));
                (Some(key), store.find(key))
            }
        };
        let share = self.begin(label, weight)?;
        if let Some(found) = found {
            return Ok(found);
        }
        let incidents = self.incidents.count();
        let (part, of) = self.budget.progress();
        let mut is_stopped = false;
        let stopwatch = Stopwatch::start();
        let result = run(share, &mut |label| {
            is_stopped |= !self.measuring.progress.at(part, of, label);
            !is_stopped
        });
        if is_stopped {
            return Err(self.interrupted());
        }
        self.check_interrupt()?;
        let mut result = result?;
        let is_incomplete =
            share.deadline.passed() || result.is_cut() || self.incidents.count() > incidents;
        if let (Some(store), Some(key)) = (&mut self.measuring.store, key) {
            result.note_start(store.this_start()?);
            store.keep(
                key,
                stopwatch.elapsed_s(),
                (!is_incomplete).then_some(&result),
            )?;
        }
        Ok(result)
    }

    /// Checks that the last part was not interrupted.
    ///
    /// # Errors
    /// An interrupt: the last results may be incomplete.
    pub(crate) fn check_interrupt(&self) -> Result<(), StudyError> {
        if interrupt::is_requested() {
            return Err(self.interrupted());
        }
        Ok(())
    }

    /// Ends the study; returns the starts of the program whose results it has.
    ///
    /// # Errors
    /// An interrupt.
    pub(crate) fn finish(self) -> Result<Starts, StudyError> {
        self.check_interrupt()?;
        let store = self.measuring.store;
        Ok(store.map_or_else(Starts::default, |store| store.starts()))
    }

    fn interrupted(&self) -> StudyError {
        let (done, of) = self.budget.progress();
        match self.measuring.store {
            None => StudyError::Interrupted { done, of },
            Some(_) => StudyError::InterruptedParts { done, of },
        }
    }
}

#[cfg(test)]
mod tests;
