//! Reading of declared keys.

use twinrig_document::{Document, Item, Place, Reported, Table};

use super::{Key, Presence, TableSpec};

/// A table that is being read by its declaration.
#[derive(Clone, Copy)]
pub(crate) struct Declared<'t, 'd> {
    table: &'t Table<'d>,
    spec: &'static TableSpec,
}

impl TableSpec {
    /// Returns the reader of a table with this declaration.
    pub fn of<'t, 'd>(&'static self, table: &'t Table<'d>) -> Declared<'t, 'd> {
        Declared { table, spec: self }
    }
}

impl<'t, 'd> Declared<'t, 'd> {
    /// Reads a key that is required or has a default.
    pub fn read<T>(self, key: &Key<T>) -> Result<T, Reported> {
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
    pub fn get<T>(self, key: &Key<T>) -> Result<Option<T>, Reported> {
        self.get_with(key, |item| (key.of.read)(item, &key.of.shape))
    }

    /// Reads a required key by `read`, which has knowledge of other tables.
    pub fn read_with<T, U>(
        self,
        key: &Key<T>,
        read: impl FnOnce(&Item<'d>) -> Result<U, Reported>,
    ) -> Result<U, Reported> {
        self.check_declared(key.name);
        self.table.required(key.name, read)
    }

    /// Reads a key that may be absent by `read`, which has knowledge of other tables.
    pub fn get_with<T, U>(
        self,
        key: &Key<T>,
        read: impl FnOnce(&Item<'d>) -> Result<U, Reported>,
    ) -> Result<Option<U>, Reported> {
        self.check_declared(key.name);
        self.table.optional(key.name, read)
    }

    /// Returns the value of a key, if present.
    pub fn item<T>(self, key: &Key<T>) -> Option<Item<'d>> {
        self.check_declared(key.name);
        self.table.get(key.name)
    }

    /// Returns whether a key is present.
    pub fn has<T>(self, key: &Key<T>) -> bool {
        self.table.keys().any(|known| known == key.name)
    }

    /// Returns the name of the one key present of those of which the table has exactly one. The
    /// table is the value `item`; `missing` is the error if there is none.
    pub fn one_of(self, item: &Item<'_>, missing: &str) -> Result<&'static str, Reported> {
        let keys = self.spec.all_keys().into_iter();
        let keys = keys.filter(|key| key.presence == Presence::OneOf);
        let keys: Vec<&'static str> = keys.map(|key| key.name).collect();
        self.table.expect(keys.iter().copied());
        let is_present = |key: &&&'static str| self.table.keys().any(|known| known == **key);
        let present: Vec<_> = keys.iter().filter(is_present).collect();
        match present[..] {
            [key] => {
                self.check_needs(key, &keys)?;
                Ok(key)
            }
            [] => {
                self.table.give_up();
                Err(item.report(missing, format!("give one of {}", keys.join(", "))))
            }
            [first, second, ..] => {
                self.table.give_up();
                let message = format!("`{first}` and `{second}` are two expectations");
                Err(self
                    .table
                    .report(second, message, "write a second [[expect]]"))
            }
        }
    }

    /// Reports a present key that belongs to another than `key` of those that exclude each other.
    fn check_needs(self, key: &str, exclusive: &[&str]) -> Result<(), Reported> {
        for other in self.spec.all_keys() {
            let Some(needs) = other.needs.filter(|needs| exclusive.contains(needs)) else {
                continue;
            };
            let is_present = self.table.keys().any(|known| known == other.name);
            if is_present && needs != key {
                self.table.give_up();
                let message = format!("`{}` has no meaning with `{key}`", other.name);
                let help = format!("`{}` requires `{needs}`", other.name);
                return Err(self.table.report(other.name, message, help));
            }
        }
        Ok(())
    }

    /// Reads the present key with the name `name`, which is declared with values of type `T`.
    pub fn read_named<T: 'static>(self, name: &str) -> Result<T, Reported> {
        let keys = (self.spec.typed)();
        let mut keys = keys.iter().filter_map(|key| key.downcast_ref::<Key<T>>());
        let Some(key) = keys.find(|key| key.name == name) else {
            unreachable!("`{name}` of {} has values of another type", self.spec.name);
        };
        self.read(key)
    }

    /// Reports a problem with a key.
    pub fn report<T>(
        self,
        key: &Key<T>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Reported {
        self.check_declared(key.name);
        self.table.report(key.name, message, help)
    }

    /// Stops reading because of a reported problem.
    pub fn give_up(self) {
        self.table.give_up();
    }

    /// Marks a key as valid without reading it.
    pub fn expect<T>(self, key: &Key<T>) {
        self.check_declared(key.name);
        self.table.expect([key.name]);
    }

    /// Returns the position of the table.
    pub fn place(self) -> Place {
        self.table.place()
    }

    /// Returns the table, for the keys that a kind of part declares.
    pub fn table(self) -> &'t Table<'d> {
        self.table
    }

    fn check_declared(self, name: &str) {
        debug_assert!(
            self.spec.all_keys().iter().any(|key| key.name == name),
            "`{name}` is not declared in {}",
            self.spec.name
        );
    }
}
