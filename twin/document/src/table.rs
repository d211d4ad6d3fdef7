//! Typed reading of tables that record the requested keys.

use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;

use crate::error::{Placed, Problem};
use crate::item::Item;
use crate::near;
use crate::node::{Node, Value};
use crate::problems::{Problems, Reported};
use crate::source::Place;

/// A table that is being read. When it is dropped, every key that was not requested is reported as
/// unknown.
#[derive(Debug)]
pub struct Table<'d> {
    node: &'d Node,
    path: String,
    problems: &'d Problems,
    requested: RefCell<Vec<String>>,
    given_up: Cell<bool>,
    /// Missing keys, with the indices of their problems.
    missing: RefCell<Vec<(String, usize)>>,
}

impl<'d> Item<'d> {
    /// Returns the value as a table.
    ///
    /// # Errors
    /// The value has another type.
    pub fn table(&self) -> Result<Table<'d>, Reported> {
        match &self.node.value {
            Value::Table(_) => Ok(Table::new(self.node, &self.path, self.problems)),
            _ => Err(self.wrong_type_with_help(
                "a table",
                format!("write it as in {} = {{ … }}", self.key()),
            )),
        }
    }

    /// Reads a table whose keys are names chosen by the user, value by value with `read`; every
    /// value is read, even after a problem.
    ///
    /// # Errors
    /// The value is not a table, or `read` reported a problem.
    pub fn by_name<T>(
        &self,
        read: impl Fn(&Item<'d>) -> Result<T, Reported>,
    ) -> Result<Vec<(Placed<String>, T)>, Reported> {
        let table = self.table()?;
        let read = table.keys().map(|key| {
            let value = table.required(key, &read)?;
            let (name, place) = (key.to_owned(), table.key_place(key));
            Ok((Placed { value: name, place }, value))
        });
        let read: Vec<_> = read.collect();
        read.into_iter().collect()
    }
}

impl<'d> Table<'d> {
    pub(crate) fn new(node: &'d Node, path: &str, problems: &'d Problems) -> Self {
        Table {
            node,
            path: path.to_owned(),
            problems,
            requested: RefCell::default(),
            given_up: Cell::new(false),
            missing: RefCell::default(),
        }
    }

    /// Dotted path in the document; empty for the root table.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Position of the table.
    pub fn place(&self) -> Place {
        self.node.place.clone()
    }

    /// Returns the value of `key`, if present.
    pub fn get(&self, key: &str) -> Option<Item<'d>> {
        self.mark_requested(key);
        let Value::Table(entries) = &self.node.value else {
            return None;
        };
        let entry = entries.iter().find(|entry| entry.key == key)?;
        Some(self.item(key, &entry.node))
    }

    /// Reads the value of `key`, which must be present.
    ///
    /// # Errors
    /// The key is missing, or `read` reported a problem.
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

    /// Reads the value of `key`, if present.
    ///
    /// # Errors
    /// `read` reported a problem.
    pub fn optional<T>(
        &self,
        key: &str,
        read: impl FnOnce(&Item<'d>) -> Result<T, Reported>,
    ) -> Result<Option<T>, Reported> {
        self.get(key).map(|item| read(&item)).transpose()
    }

    /// Keys of the table, in the order of the text. They do not count as requested.
    pub fn keys(&self) -> impl Iterator<Item = &'d str> + use<'d> {
        let entries = match &self.node.value {
            Value::Table(entries) => entries.as_slice(),
            _ => &[],
        };
        entries.iter().map(|entry| entry.key.as_str())
    }

    /// Position of `key`, or of the table if it has no such key. Does not count as a request.
    pub fn key_place(&self, key: &str) -> Place {
        let Value::Table(entries) = &self.node.value else {
            return self.place();
        };
        let entry = entries.iter().find(|entry| entry.key == key);
        entry.map_or_else(|| self.place(), |entry| entry.key_place.clone())
    }

    /// Marks `keys` as valid without reading them, so that near misses of them are found.
    pub fn expect<'k>(&self, keys: impl IntoIterator<Item = &'k str>) {
        for key in keys {
            self.mark_requested(key);
        }
    }

    /// Reports a problem with `key` of this table.
    pub fn report(
        &self,
        key: &str,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Reported {
        self.problems
            .report(Problem::at(&self.key_place(key), message, help))
    }

    /// Reports a problem at `place` in this document.
    pub fn report_at(
        &self,
        place: &Place,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Reported {
        self.problems.report(Problem::at(place, message, help))
    }

    /// Adds a warning at `place` in this document.
    pub fn warn_at(
        &self,
        place: &Place,
        code: &'static str,
        message: impl Into<String>,
        help: impl Into<String>,
    ) {
        self.problems.warn(code, Problem::at(place, message, help));
    }

    /// Reports that `key` is missing.
    pub fn missing(&self, key: &str) -> Reported {
        let message = if self.path.is_empty() {
            format!("`{key}` is missing")
        } else {
            format!("`{key}` is missing in `{}`", self.path)
        };
        let missing = (key.to_owned(), self.problems.next());
        self.missing.borrow_mut().push(missing);
        self.problems.report(Problem::at(
            &self.head(),
            message,
            format!("add `{key} = …`"),
        ))
    }

    /// Stops reading this table because of a reported problem: further keys are unread rather than
    /// unknown. (A near miss of a requested key is still reported.)
    pub fn give_up(&self) {
        self.given_up.set(true);
    }

    fn mark_requested(&self, key: &str) {
        let mut requested = self.requested.borrow_mut();
        if !requested.iter().any(|known| known == key) {
            requested.push(key.to_owned());
        }
    }

    /// Position of the header line, for problems with the table as a whole.
    fn head(&self) -> Place {
        if self.path.is_empty() {
            let source = self.node.place.clone();
            return source.first_line();
        }
        self.place()
    }

    /// Dotted path of a key.
    fn path_of(&self, key: &str) -> String {
        if self.path.is_empty() {
            key.to_owned()
        } else {
            format!("{}.{key}", self.path)
        }
    }

    fn item(&self, key: &str, node: &'d Node) -> Item<'d> {
        Item::new(node, self.path_of(key), self.problems)
    }
}

impl Drop for Table<'_> {
    fn drop(&mut self) {
        let requested = self.requested.take();
        let Value::Table(entries) = &self.node.value else {
            return;
        };
        let unknown = entries
            .iter()
            .filter(|entry| !requested.contains(&entry.key));
        let mut unknown = unknown.peekable();
        if unknown.peek().is_none() {
            return;
        }
        // A key that is present is not suggested.
        let present: BTreeSet<&str> = entries.iter().map(|entry| entry.key.as_str()).collect();
        let absent = requested.iter().map(String::as_str);
        let absent: Vec<&str> = absent.filter(|key| !present.contains(key)).collect();
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
                Some(near) => {
                    // The misspelt key explains the missing one.
                    let missing = self.missing.take();
                    for (_, index) in missing.iter().filter(|(key, _)| key == near) {
                        self.problems.withdraw(*index);
                    }
                    self.missing.replace(missing);
                    format!("did you mean `{near}`?")
                }
                None => near::suggestion(
                    &entry.key,
                    "keys that are known here",
                    requested.iter().map(String::as_str),
                ),
            };
            self.problems.report(Problem {
                unknown_key: Some(self.path_of(&entry.key)),
                ..Problem::at(&entry.key_place, message, help)
            });
        }
    }
}
