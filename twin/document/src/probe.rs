//! Record of the numbers that are read from documents, and a move of one of them: which inputs a
//! result depends on.
//!
//! A probe belongs to a thread. Code that does a part of its work on other threads calls [`within`]
//! there, with its own [`current`]. Whole numbers, as counts and seeds, are not recorded.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::source::Place;

/// Name of a number: a file, by the last two parts of its path, and a dotted key.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Number {
    /// `robots/cheetah-cub.toml`
    pub file: String,
    /// `leg.aslp.l1`
    pub key: String,
}

/// Record of the numbers that are read in its scope.
#[derive(Debug, Default)]
pub struct Probe {
    moved: Option<(Number, f64)>,
    read: Mutex<BTreeMap<Number, String>>,
}

thread_local! {
    static CURRENT: RefCell<Option<Arc<Probe>>> = const { RefCell::new(None) };
}

impl Probe {
    /// Creates a probe that changes nothing.
    pub fn new() -> Arc<Self> {
        Arc::default()
    }

    /// Creates a probe that multiplies a number by a factor.
    pub fn moving(number: Number, factor: f64) -> Arc<Self> {
        Arc::new(Self {
            moved: Some((number, factor)),
            ..Self::default()
        })
    }

    /// Returns the numbers read so far, each with the comment beside it, or in the line above it.
    pub fn numbers(&self) -> BTreeMap<Number, String> {
        self.lock().clone()
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<Number, String>> {
        self.read.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Records a number; returns the factor by which it is moved.
    fn factor(&self, key: &str, place: &Place) -> f64 {
        let number = Number {
            file: short(&place.source().name),
            key: key.to_owned(),
        };
        let moved = self.moved.as_ref();
        let factor = moved.map_or(
            1.0,
            |(name, factor)| if *name == number { *factor } else { 1.0 },
        );
        self.lock().entry(number).or_insert_with(|| comment(place));
        factor
    }
}

/// Returns the probe of this thread.
pub fn current() -> Option<Arc<Probe>> {
    CURRENT.with_borrow(Clone::clone)
}

/// Does something with a probe in force on this thread, or with none.
pub fn within<T>(probe: Option<Arc<Probe>>, action: impl FnOnce() -> T) -> T {
    struct Restore(Option<Arc<Probe>>);
    impl Drop for Restore {
        fn drop(&mut self) {
            CURRENT.set(self.0.take());
        }
    }
    let _restore = Restore(CURRENT.replace(probe));
    action()
}

/// Returns the factor of the number that is being read, by the probe of this thread.
pub(crate) fn factor(key: &str, place: &Place) -> f64 {
    CURRENT.with_borrow(|probe| probe.as_ref().map_or(1.0, |probe| probe.factor(key, place)))
}

/// Returns the last two parts of a path.
fn short(file: &str) -> String {
    let path = Path::new(file);
    let parts = path.parent().and_then(Path::file_name).into_iter();
    let parts = parts.chain(path.file_name());
    let parts: Vec<_> = parts.map(|part| part.to_string_lossy()).collect();
    parts.join("/")
}

/// Returns the comment behind a value, or the line above it if that is a comment.
fn comment(place: &Place) -> String {
    let behind = place.after().split_once('#');
    if let Some((_, comment)) = behind {
        return comment.trim().to_owned();
    }
    let above = place.line_above().trim();
    above
        .strip_prefix('#')
        .unwrap_or_default()
        .trim()
        .to_owned()
}

#[cfg(test)]
mod tests {
    use twinrig_kernel::Unit;

    use super::*;
    use crate::{Document, Item, Range};

    const TEXT: &str = "# ASSUMED: a choice\nlength = '44.2 mm'\nperiod = '2 ms' # T\ncount = 3";

    fn read() -> (f64, u64, f64) {
        let document = Document::parse("/any/robots/leg.toml", TEXT).unwrap();
        let read = document.check(|table| {
            let length = table.required("length", |v| v.quantity(Unit::Meter, &Range::POSITIVE))?;
            let period = table.required("period", Item::duration)?;
            let count = table.required("count", |v| v.number(&Range::POSITIVE))?;
            Ok((length, period.as_nanos(), count))
        });
        read.unwrap()
    }

    fn number(key: &str) -> Number {
        Number {
            file: "robots/leg.toml".to_owned(),
            key: key.to_owned(),
        }
    }

    #[test]
    fn numbers_that_are_read_are_recorded_with_their_comments() {
        let probe = Probe::new();
        assert_eq!(
            within(Some(Arc::clone(&probe)), read),
            (0.0442, 2_000_000, 3.0)
        );
        let known = [
            ("count", ""),
            ("length", "ASSUMED: a choice"),
            ("period", "T"),
        ];
        let known = known.map(|(key, comment)| (number(key), comment.to_owned()));
        assert_eq!(probe.numbers().into_iter().collect::<Vec<_>>(), known);
        assert!(current().is_none());
    }

    #[test]
    fn only_the_moved_number_differs_and_only_within_the_probe() {
        let moved = |key| within(Some(Probe::moving(number(key), 1.5)), read);
        assert_eq!(moved("length"), (0.0442 * 1.5, 2_000_000, 3.0));
        assert_eq!(moved("period"), (0.0442, 3_000_000, 3.0));
        assert_eq!(moved("count"), (0.0442, 2_000_000, 4.5));
        assert_eq!(moved("other"), read());
    }
}
