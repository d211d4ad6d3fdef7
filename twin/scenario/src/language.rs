//! The dialect of scenarios: declarations of tables with names of parts and limits of measures.

use serde_json::Value;
use twinrig_document::declaration::{self, Dialect};
use twinrig_document::quantity_name;
use twinrig_kernel::Unit;

pub(crate) use twinrig_document::declaration::{
    Accepts, Presence, Words, choice, contextual, quantity, table,
};

use crate::domain::Domain;

pub(crate) type Declared<'t, 'd> = declaration::Declared<'t, 'd, Special>;
pub(crate) type Key<T> = declaration::Key<T, Special>;
pub(crate) type KeySpec = declaration::KeySpec<Special>;
pub(crate) type Shape = declaration::Shape<Special>;
pub(crate) type TableSpec = declaration::TableSpec<Special>;
pub(crate) type Type<T> = declaration::Type<T, Special>;

/// Values that only scenarios have.
#[derive(Clone, Copy)]
pub(crate) enum Special {
    /// Limits of a measure in a unit.
    Limits(Unit, Domain),
    /// Name of a kind of part.
    Kind(Part),
    /// Name of a plant.
    Plant,
}

impl Dialect for Special {
    type Schema = Value;

    fn words(&self) -> String {
        match self {
            Special::Limits(unit, _) => {
                format!("limits of {}", quantity_name(*unit).replace("plain ", ""))
            }
            Special::Kind(part) => format!("kind of {}", part.nouns().0),
            Special::Plant => "plant".to_owned(),
        }
    }
}

/// Sort of part with kinds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    Plant,
    Controller,
    Bus,
}

impl Part {
    /// Returns the singular and the plural in messages.
    pub const fn nouns(self) -> (&'static str, &'static str) {
        match self {
            Part::Plant => ("plant", "plants"),
            Part::Controller => ("controller", "controllers"),
            Part::Bus => ("bus", "buses"),
        }
    }
}
