//! Typed reading of tables that know which of their keys were asked for.

use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;

use crate::error::{Problem, Warning};
use crate::item::Item;
use crate::near;
use crate::node::{Node, Value};
use crate::source::Place;

/// Proof that a problem has been noted: what a reader returns instead of a value.
///
/// It carries nothing, so that a reader can ask for every key first and give up afterwards, and a person sees all that is
/// wrong at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reported(pub(crate) ());

/// Where problems gather while a document is read.
#[derive(Debug, Default)]
pub(crate) struct Problems {
    errors: RefCell<Vec<Problem>>,
    warnings: RefCell<Vec<Warning>>,
}

impl Problems {
    pub fn report(&self, problem: Problem) -> Reported {
        self.errors.borrow_mut().push(problem);
        Reported(())
    }

    pub fn warn(&self, code: &'static str, problem: Problem) {
        self.warnings.borrow_mut().push(Warning { code, problem });
    }

    pub fn into_inner(self) -> (Vec<Problem>, Vec<Warning>) {
        (self.errors.into_inner(), self.warnings.into_inner())
    }
}

/// A table that is being read. When it goes out of scope, every key that nobody asked for is a problem: an unknown key.
#[derive(Debug)]
pub struct Table<'d> {
    node: &'d Node,
    path: String,
    problems: &'d Problems,
    asked: RefCell<Vec<String>>,
    given_up: Cell<bool>,
}

impl<'d> Table<'d> {
    pub(crate) fn new(node: &'d Node, path: &str, problems: &'d Problems) -> Self {
        Table {
            node,
            path: path.to_owned(),
            problems,
            asked: RefCell::default(),
            given_up: Cell::new(false),
        }
    }

    /// Its dotted path in the document; empty for the outermost table.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Where it stands.
    pub fn place(&self) -> Place {
        self.node.place.clone()
    }

    /// The value of `key`, if the table has it.
    pub fn get(&self, key: &str) -> Option<Item<'d>> {
        self.ask(key);
        let Value::Table(entries) = &self.node.value else {
            return None;
        };
        let entry = entries.iter().find(|entry| entry.key == key)?;
        Some(self.item(key, &entry.node))
    }

    /// What `read` makes of the value of `key`, which must be there.
    ///
    /// # Errors
    /// The key is missing, or `read` reported something.
    pub fn required<T>(
        &self,
        key: &str,
        read: impl FnOnce(&Item<'d>) -> Result<T, Reported>,
    ) -> Result<T, Reported> {
        match self.get(key) {
            Some(item) => read(&item),
            None => Err(self.missing(key)),
        }
    }

    /// What `read` makes of the value of `key`, if it is there.
    ///
    /// # Errors
    /// `read` reported something.
    pub fn optional<T>(
        &self,
        key: &str,
        read: impl FnOnce(&Item<'d>) -> Result<T, Reported>,
    ) -> Result<Option<T>, Reported> {
        self.get(key).map(|item| read(&item)).transpose()
    }

    /// Every key that the table has, in the order of the text. Asks for none of them.
    pub fn keys(&self) -> impl Iterator<Item = &'d str> + use<'d> {
        let entries = match &self.node.value {
            Value::Table(entries) => entries.as_slice(),
            _ => &[],
        };
        entries.iter().map(|entry| entry.key.as_str())
    }

    /// Where `key` stands, or the table itself if it has no such key. Does not ask for it.
    pub fn key_place(&self, key: &str) -> Place {
        let Value::Table(entries) = &self.node.value else {
            return self.place();
        };
        let entry = entries.iter().find(|entry| entry.key == key);
        entry.map_or_else(|| self.place(), |entry| entry.key_place.clone())
    }

    /// Names keys that are valid here although nobody asks for them, so that near misses of them are found.
    pub fn expect<'k>(&self, keys: impl IntoIterator<Item = &'k str>) {
        for key in keys {
            self.ask(key);
        }
    }

    /// Notes that `key`, which this table has, is wrong.
    pub fn report(
        &self,
        key: &str,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Reported {
        self.problems
            .report(Problem::at(&self.key_place(key), message, help))
    }

    /// Notes that what stands at `place`, in this document, is wrong.
    pub fn report_at(
        &self,
        place: &Place,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Reported {
        self.problems.report(Problem::at(place, message, help))
    }

    /// Notes a warning about what stands at `place`, in this document.
    pub fn warn_at(
        &self,
        place: &Place,
        code: &'static str,
        message: impl Into<String>,
        help: impl Into<String>,
    ) {
        self.problems.warn(code, Problem::at(place, message, help));
    }

    /// Notes that `key` is missing.
    pub fn missing(&self, key: &str) -> Reported {
        let message = if self.path.is_empty() {
            format!("`{key}` is missing")
        } else {
            format!("`{key}` is missing in `{}`", self.path)
        };
        self.problems.report(Problem::at(
            &self.head(),
            message,
            format!("add `{key} = …`"),
        ))
    }

    /// The rest of this table will not be read, because of a problem that has been reported: keys that were not asked
    /// for are not unknown then, merely unread. (A near miss of a key that was asked for still is a problem.)
    pub fn give_up(&self) {
        self.given_up.set(true);
    }

    fn ask(&self, key: &str) {
        let mut asked = self.asked.borrow_mut();
        if !asked.iter().any(|known| known == key) {
            asked.push(key.to_owned());
        }
    }

    /// The first line of the table, for what is missing in it as a whole.
    fn head(&self) -> Place {
        if self.path.is_empty() {
            let source = self.node.place.clone();
            return source.first_line();
        }
        self.place()
    }

    fn item(&self, key: &str, node: &'d Node) -> Item<'d> {
        let path = if self.path.is_empty() {
            key.to_owned()
        } else {
            format!("{}.{key}", self.path)
        };
        Item::new(node, path, self.problems)
    }
}

impl Drop for Table<'_> {
    fn drop(&mut self) {
        let asked = self.asked.take();
        let Value::Table(entries) = &self.node.value else {
            return;
        };
        let unknown = entries.iter().filter(|entry| !asked.contains(&entry.key));
        let mut unknown = unknown.peekable();
        if unknown.peek().is_none() {
            return;
        }
        // A key that is there already is not what was meant.
        let given: BTreeSet<&str> = entries.iter().map(|entry| entry.key.as_str()).collect();
        let absent = asked.iter().map(String::as_str);
        let absent: Vec<&str> = absent.filter(|key| !given.contains(key)).collect();
        for entry in unknown {
            if self.given_up.get() && near::nearest(&entry.key, absent.iter().copied()).is_none() {
                continue;
            }
            let message = if self.path.is_empty() {
                format!("unknown key `{}`", entry.key)
            } else {
                format!("unknown key `{}` in `{}`", entry.key, self.path)
            };
            let help = match near::nearest(&entry.key, absent.iter().copied()) {
                Some(near) => format!("did you mean `{near}`?"),
                None => near::suggestion(
                    &entry.key,
                    "keys that are known here",
                    asked.iter().map(String::as_str),
                ),
            };
            self.problems
                .report(Problem::at(&entry.key_place, message, help));
        }
    }
}
