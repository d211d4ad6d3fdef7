//! Declarations of the tables of files. Reader and reference follow from them, and for scenarios
//! the JSON schema: the reader takes a key by its declaration, the others enumerate the tables,
//! beginning with the root.
//!
//! The files of one crate may accept values that no others do, such as names that the crate knows:
//! these are its [`Dialect`].
#![expect(
    clippy::missing_errors_doc,
    reason = "a reader reports the problems of its table"
)]

mod accepts;
mod declared;
mod record;
mod reference;
mod shape;
mod types;

use std::any::Any;
use std::fmt;

pub use accepts::Accepts;
pub use declared::Declared;
pub use record::{Defaulted, Field, Optional};
pub use reference::{KeyReference, TableReference};
pub use shape::{Dialect, Plain, Shape};
pub use types::{Read, Type, Words, choice, contextual, quantity};

/// Declaration of a table: its keys and the conditions between them.
#[must_use]
pub struct TableSpec<X: Dialect = Plain> {
    /// Name in the reference.
    pub name: &'static str,
    /// One-line description.
    pub about: &'static str,
    /// Declarations of its keys.
    pub keys: fn() -> Vec<KeySpec<X>>,
    /// The same keys with their types, each a [`Key`].
    pub typed: fn() -> Vec<Box<dyn Any>>,
    /// Declarations of further keys, from another table or an array.
    pub more: fn() -> Vec<KeySpec<X>>,
    /// Key whose value selects the keys that are valid with it.
    pub selector: Option<&'static str>,
    /// Conditions in the schema that the declarations of the keys do not express.
    pub refine: fn(&mut X::Schema),
}

impl<X: Dialect> TableSpec<X> {
    /// Returns a table without keys.
    pub const fn new(name: &'static str, about: &'static str) -> Self {
        TableSpec {
            name,
            about,
            keys: Vec::new,
            typed: Vec::new,
            more: Vec::new,
            selector: None,
            refine: |_| (),
        }
    }

    /// Adds keys that are declared elsewhere.
    pub const fn with(mut self, more: fn() -> Vec<KeySpec<X>>) -> Self {
        self.more = more;
        self
    }

    /// Sets the key whose value selects other keys.
    pub const fn selected_by(mut self, key: &'static str) -> Self {
        self.selector = Some(key);
        self
    }

    /// Sets the conditions of the schema.
    pub const fn refined(mut self, refine: fn(&mut X::Schema)) -> Self {
        self.refine = refine;
        self
    }

    /// Returns the declarations of all keys.
    pub fn all_keys(&self) -> Vec<KeySpec<X>> {
        let mut keys = (self.keys)();
        keys.extend((self.more)());
        keys
    }
}

/// Whether a key is present, and the meaning of its absence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Presence {
    /// It must be present.
    Required,
    /// Exactly one of the keys of this kind in the table must be present.
    OneOf,
    /// It may be absent.
    Optional,
    /// It may be absent, with the default in these words.
    Otherwise(&'static str),
    /// It has this TOML value by default.
    Default(&'static str),
}

/// Declaration of a key.
#[derive(Clone)]
pub struct KeySpec<X: Dialect = Plain> {
    /// The key.
    pub name: &'static str,
    /// One-line description.
    pub about: &'static str,
    /// Line of TOML with the key, and others where it requires them, without a line break.
    pub example: &'static str,
    /// Accepted values.
    pub shape: Shape<X>,
    /// Whether it is present.
    pub presence: Presence,
    /// Values of the selector of the table with which the key is valid; empty for all.
    pub only_with: &'static [&'static str],
    /// Key that it requires.
    pub needs: Option<&'static str>,
    /// Whether it qualifies the other keys: the name of an expectation leaves it out.
    pub is_qualifier: bool,
}

/// Declaration of a key with values of type `T`.
#[must_use]
pub struct Key<T: 'static, X: Dialect = Plain> {
    /// The key.
    pub name: &'static str,
    about: &'static str,
    example: &'static str,
    presence: Presence,
    only_with: &'static [&'static str],
    needs: Option<&'static str>,
    is_qualifier: bool,
    of: Type<T, X>,
}

/// The name.
impl<T, X: Dialect> fmt::Display for Key<T, X> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl<T, X: Dialect> Key<T, X> {
    /// Returns an optional key.
    pub const fn new(
        name: &'static str,
        of: Type<T, X>,
        about: &'static str,
        example: &'static str,
    ) -> Self {
        Key {
            name,
            about,
            example,
            presence: Presence::Optional,
            only_with: &[],
            needs: None,
            is_qualifier: false,
            of,
        }
    }

    const fn presence(mut self, presence: Presence) -> Self {
        self.presence = presence;
        self
    }

    /// Makes it required.
    pub const fn required(self) -> Self {
        self.presence(Presence::Required)
    }

    /// Makes it one of the keys of which the table has exactly one.
    pub const fn one_of(self) -> Self {
        self.presence(Presence::OneOf)
    }

    /// Describes its default.
    pub const fn otherwise(self, words: &'static str) -> Self {
        self.presence(Presence::Otherwise(words))
    }

    /// Sets its default, a TOML value.
    pub const fn default(self, toml: &'static str) -> Self {
        self.presence(Presence::Default(toml))
    }

    /// Restricts it to values of the selector of its table.
    pub const fn only_with(mut self, words: &'static [&'static str]) -> Self {
        self.only_with = words;
        self
    }

    /// Makes another key required where it is present.
    pub const fn needs(mut self, key: &'static str) -> Self {
        self.needs = Some(key);
        self
    }

    /// Makes it a qualifier of the other keys.
    pub const fn qualifier(mut self) -> Self {
        self.is_qualifier = true;
        self
    }

    /// Returns the declaration without the type.
    pub fn spec(self) -> KeySpec<X> {
        KeySpec {
            name: self.name,
            about: self.about,
            example: self.example,
            shape: self.of.shape,
            presence: self.presence,
            only_with: self.only_with,
            needs: self.needs,
            is_qualifier: self.is_qualifier,
        }
    }
}

/// Declares the keys of a table as constants of a module, and the table as its constant `TABLE`. A
/// key has a name, the type of its values, a description and an example, then its properties:
/// methods of [`Key`].
#[macro_export]
macro_rules! table {
    (
        $(#[$doc:meta])* $visible:vis $module:ident = $table:expr;
        $(
            $key:ident: $type:ty = $name:expr, $of:expr, $about:expr, $example:expr
            $(, $property:ident($($argument:expr),*))*;
        )*
    ) => {
        $(#[$doc])*
        $visible mod $module {
            use super::*;
            $(
                #[doc = $about]
                pub(crate) const $key: Key<$type> =
                    Key::new($name, $of, $about, $example)$(.$property($($argument),*))*;
            )*
            pub(crate) const TABLE: &TableSpec = &TableSpec {
                keys: || vec![$($key.spec()),*],
                typed: || vec![$(Box::new($key)),*],
                ..$table
            };
        }
    };
}

pub use crate::{record, table};
