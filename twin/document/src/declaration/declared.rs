//! Reading of declared keys.

use std::ops::Deref;

use super::{Dialect, Key, Plain, Presence, TableSpec};
use crate::{Document, Item, Reported, Table};

/// A table that is being read by its declaration.
#[derive(Clone, Copy)]
pub struct Declared<'t, 'd, X: Dialect = Plain> {
    table: &'t Table<'d>,
    spec: &'static TableSpec<X>,
}

impl<'d, X: Dialect> Deref for Declared<'_, 'd, X> {
    type Target = Table<'d>;

    fn deref(&self) -> &Self::Target {
        self.table
    }
}

impl<X: Dialect> TableSpec<X> {
    /// Returns the reader of a table with this declaration.
    pub fn of<'t, 'd>(&'static self, table: &'t Table<'d>) -> Declared<'t, 'd, X> {
        Declared { table, spec: self }
    }
}

impl<'d, X: Dialect> Declared<'_, 'd, X> {
    /// Reads a key that is required or has a default.
    pub fn read<T>(self, key: &Key<T, X>) -> Result<T, Reported> {
        if let Some(value) = self.get(key)? {
            return Ok(value);
        }
        let Presence::Default(toml) = key.presence else {
            return Err(self.table.missing(key.name));
        };
        let read = |item: &Item<'_>| (key.of.read)(item, &key.of.shape);
        let default = Document::parse("the default", &format!("{} = {toml}", key.name))
            .and_then(|document| document.check(|table| table.required(key.name, read)));
        default.map_err(|error| self.report(key, error.to_string(), ""))
    }

    /// Reads a key that may be absent.
    pub fn get<T>(self, key: &Key<T, X>) -> Result<Option<T>, Reported> {
        self.get_with(key, |item| (key.of.read)(item, &key.of.shape))
    }

    /// Reads a required key by `read`, which has knowledge of other tables.
    pub fn read_with<T, U>(
        self,
        key: &Key<T, X>,
        read: impl FnOnce(&Item<'d>) -> Result<U, Reported>,
    ) -> Result<U, Reported> {
        self.check_declared(key.name);
        self.table.required(key.name, read)
    }

    /// Reads a key that may be absent by `read`, which has knowledge of other tables.
    pub fn get_with<T, U>(
        self,
        key: &Key<T, X>,
        read: impl FnOnce(&Item<'d>) -> Result<U, Reported>,
    ) -> Result<Option<U>, Reported> {
        self.check_declared(key.name);
        self.table.optional(key.name, read)
    }

    /// Returns the value of a key, if present.
    pub fn item<T>(self, key: &Key<T, X>) -> Option<Item<'d>> {
        self.check_declared(key.name);
        self.table.get(key.name)
    }

    /// Returns whether a key is present.
    pub fn has<T>(self, key: &Key<T, X>) -> bool {
        self.table.keys().any(|known| known == key.name)
    }

    /// Reads the present key with the name `name`, which is declared with values of type `T`.
    pub fn read_named<T: 'static>(self, name: &str) -> Result<T, Reported> {
        let keys = (self.spec.typed)();
        let mut keys = keys
            .iter()
            .filter_map(|key| key.downcast_ref::<Key<T, X>>());
        let Some(key) = keys.find(|key| key.name == name) else {
            unreachable!("`{name}` of {} has values of another type", self.spec.name);
        };
        self.read(key)
    }

    /// Reports a problem with a key.
    pub fn report<T>(
        self,
        key: &Key<T, X>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Reported {
        self.check_declared(key.name);
        self.table.report(key.name, message, help)
    }

    /// Marks a key as valid without reading it.
    pub fn expect<T>(self, key: &Key<T, X>) {
        self.check_declared(key.name);
        self.table.expect([key.name]);
    }

    /// Returns the declaration.
    pub fn spec(self) -> &'static TableSpec<X> {
        self.spec
    }

    fn check_declared(self, name: &str) {
        debug_assert!(
            self.spec.all_keys().iter().any(|key| key.name == name),
            "`{name}` is not declared in {}",
            self.spec.name
        );
    }
}
