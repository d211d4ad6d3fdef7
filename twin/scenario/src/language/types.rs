//! Types of the values of keys: accepted values and their reader.

use twinrig_document::{Item, Placed, Range, Reported};
use twinrig_kernel::{SimDuration, Unit};

use super::Shape;
use crate::options::Accepts;

/// Reads a value of the accepted shape.
pub(crate) type Read<T> = fn(&Item<'_>, &Shape) -> Result<T, Reported>;

/// Accepted values of a key and their reader.
pub(crate) struct Type<T> {
    pub shape: Shape,
    pub read: Read<T>,
}

impl<T> Type<T> {
    pub const fn new(shape: Shape, read: Read<T>) -> Self {
        Type { shape, read }
    }
}

/// Words of an enumeration, in the order of messages and documentation.
pub(crate) trait Words: Clone + 'static {
    const WORDS: &'static [(&'static str, Self)];

    /// Returns the words.
    fn words() -> Vec<&'static str> {
        Self::WORDS.iter().map(|(word, _)| *word).collect()
    }
}

pub(crate) const TEXT: Type<String> = Type::new(Shape::One(Accepts::Text), |item, _| {
    Ok(item.text()?.to_owned())
});
pub(crate) const PLACED: Type<Placed<String>> =
    Type::new(Shape::One(Accepts::Name), |item, _| item.placed_text());
pub(crate) const BOOLEAN: Type<bool> =
    Type::new(Shape::One(Accepts::Boolean), |item, _| item.boolean());
pub(crate) const DURATION: Type<SimDuration> =
    Type::new(Shape::One(Accepts::Duration), |item, _| item.duration());
pub(crate) const POSITIVE_DURATION: Type<SimDuration> =
    Type::new(Shape::One(Accepts::PositiveDuration), |item, _| {
        item.positive_duration()
    });
pub(crate) const NATURAL: Type<u64> =
    Type::new(Shape::One(Accepts::Natural(0..=u64::MAX)), |item, _| {
        item.natural()
    });
/// A list of names.
pub(crate) const NAMES: Type<Vec<Placed<String>>> = Type::new(
    Shape::List {
        of: &Shape::One(Accepts::Name),
        least: 0,
        distinct: false,
    },
    |item, _| item.each(Item::placed_text),
);

/// Returns a quantity within a range.
pub(crate) const fn quantity(unit: Unit, range: Range) -> Type<f64> {
    let shape = Shape::One(Accepts::Quantity { unit, range });
    Type::new(shape, |item, shape| {
        let Shape::One(Accepts::Quantity { unit, range }) = shape else {
            unreachable!("a quantity");
        };
        item.quantity(*unit, range)
    })
}

/// Returns the words of an enumeration.
pub(crate) const fn choice<T: Words>() -> Type<T> {
    Type::new(Shape::Choice(T::words), |item, _| item.choice(T::WORDS))
}

/// Returns a value whose reader depends on other tables.
pub(crate) const fn contextual(shape: Shape) -> Type<()> {
    Type::new(shape, |_, _| Ok(()))
}
