//! Tables that are read as structures.

use super::{Key, KeySpec, Type};
use crate::{Reported, Table};

/// A field of a structure of [`record!`](crate::record): the type of a key, [`Optional`], or
/// [`Defaulted`].
pub trait Field {
    /// Value of the field.
    type Value;

    /// Reads the key.
    fn read(&self, table: &Table<'_>, key: &str) -> Result<Self::Value, Reported>;

    /// Returns the declaration of the key.
    fn spec(self, key: &'static str, about: &'static str) -> KeySpec;
}

impl<T: 'static> Field for Type<T> {
    type Value = T;

    fn read(&self, table: &Table<'_>, key: &str) -> Result<T, Reported> {
        table.required(key, |item| (self.read)(item, &self.shape))
    }

    fn spec(self, key: &'static str, about: &'static str) -> KeySpec {
        Key::new(key, self, about, "").required().spec()
    }
}

/// A key that may be absent.
pub struct Optional<T: 'static>(pub Type<T>);

impl<T: 'static> Field for Optional<T> {
    type Value = Option<T>;

    fn read(&self, table: &Table<'_>, key: &str) -> Result<Option<T>, Reported> {
        table.optional(key, |item| (self.0.read)(item, &self.0.shape))
    }

    fn spec(self, key: &'static str, about: &'static str) -> KeySpec {
        Key::new(key, self.0, about, "").spec()
    }
}

/// A key that may be absent, with the value that it then has, and the same in words.
pub struct Defaulted<T: 'static>(pub Type<T>, pub T, pub &'static str);

impl<T: Clone + 'static> Field for Defaulted<T> {
    type Value = T;

    fn read(&self, table: &Table<'_>, key: &str) -> Result<T, Reported> {
        let value = table.optional(key, |item| (self.0.read)(item, &self.0.shape))?;
        Ok(value.unwrap_or_else(|| self.1.clone()))
    }

    fn spec(self, key: &'static str, about: &'static str) -> KeySpec {
        Key::new(key, self.0, about, "").otherwise(self.2).spec()
    }
}

/// Declares a table as a structure whose fields are its keys: the doc comment describes the key,
/// and its value has the type after `=`, which may be [`Optional`] or [`Defaulted`]. The constants
/// `TABLE` and `TYPE` are for declarations that contain the table. Its reader reports all problems
/// of the table, and then calls the function after `checked by`, if there is one. Fields after
/// `and` are no keys; they have their default when a table is read.
///
/// ```
/// use twinrig_document::declaration::{Optional, Type, quantity, record};
/// use twinrig_document::{Document, Range};
/// use twinrig_kernel::Unit;
///
/// record! {
///     /// A linear spring.
///     #[derive(Debug, PartialEq)]
///     pub struct Spring = "spring" {
///         /// Stiffness \[N/m\].
///         pub stiffness: f64 = quantity(Unit::NewtonPerMeter, Range::POSITIVE),
///         /// Supplier.
///         pub supplier: Option<String> = Optional(Type::TEXT),
///     }
/// }
///
/// let read = |text: &str| {
///     let document = Document::parse("spring.toml", text).unwrap();
///     document.check(|table| table.required("spring", |item| Spring::read_from(&item.table()?)))
/// };
/// let spring = read("spring = { stiffness = '2 N/mm' }").unwrap();
/// assert_eq!(spring, Spring { stiffness: 2000.0, supplier: None });
/// let error = read("spring = { stifness = '2 N/mm' }").unwrap_err();
/// assert_eq!(error.problems[0].help, "did you mean `stiffness`?");
/// ```
#[macro_export]
macro_rules! record {
    (
        $(#[doc = $about:literal])+ $(#[derive($($derive:ident),+)])?
        $visible:vis struct $name:ident = $table:literal $(, checked by $check:ident)? {
            $($(#[doc = $doc:literal])+ $shown:vis $key:ident: $type:ty = $of:expr,)*
        } $(and {
            $($(#[doc = $more:literal])+ $visible_too:vis $other:ident: $other_type:ty,)*
        })?
    ) => {
        $(#[doc = $about])+ $(#[derive($($derive),+)])?
        $visible struct $name {
            $($(#[doc = $doc])+ $shown $key: $type,)*
            $($($(#[doc = $more])+ $visible_too $other: $other_type,)*)?
        }

        impl $name {
            /// Declaration of the table.
            $visible const TABLE: &'static $crate::declaration::TableSpec =
                &$crate::declaration::TableSpec {
                    keys: || vec![$(
                        $crate::declaration::Field::spec(
                            $of, stringify!($key), concat!($($doc),+),
                        )
                    ),*],
                    ..$crate::declaration::TableSpec::new($table, concat!($($about),+))
                };
            /// Type of the table.
            $visible const TYPE: $crate::declaration::Type<Self> = $crate::declaration::Type::new(
                $crate::declaration::Shape::Table(Self::TABLE),
                |item, _| Self::read_from(&item.table()?),
            );

            /// Reads the keys of a table.
            ///
            /// # Errors
            /// Keys that are missing, and values that are not accepted.
            $visible fn read_from(
                table: &$crate::Table<'_>,
            ) -> Result<Self, $crate::Reported> {
                $(let $key = $crate::declaration::Field::read(&$of, table, stringify!($key));)*
                let read = Self {
                    $($key: $key?,)*
                    $($($other: Default::default(),)*)?
                };
                $($check(table, &read)?;)?
                Ok(read)
            }
        }
    };
}
