//! Types of the values of keys: accepted values and their reader.

use twinrig_kernel::{SimDuration, Unit};

use super::{Accepts, Dialect, Plain, Shape};
use crate::{Item, Placed, Range, Reported};

/// Reads a value of the accepted shape.
pub type Read<T, X> = fn(&Item<'_>, &Shape<X>) -> Result<T, Reported>;

/// Accepted values of a key and their reader.
pub struct Type<T, X: Dialect = Plain> {
    /// Accepted values.
    pub shape: Shape<X>,
    /// Their reader.
    pub read: Read<T, X>,
}

impl<T, X: Dialect> Type<T, X> {
    /// Returns a type.
    pub const fn new(shape: Shape<X>, read: Read<T, X>) -> Self {
        Type { shape, read }
    }
}

/// Words of an enumeration, in the order of messages and documentation.
pub trait Words: Clone + 'static {
    /// The words and their values.
    const WORDS: &'static [(&'static str, Self)];

    /// Returns the words.
    fn words() -> Vec<&'static str> {
        Self::WORDS.iter().map(|(word, _)| *word).collect()
    }
}

impl<X: Dialect> Type<String, X> {
    /// A text.
    pub const TEXT: Self = Type::new(Shape::One(Accepts::Text), |item, _| {
        Ok(item.text()?.to_owned())
    });
}

impl<X: Dialect> Type<Placed<String>, X> {
    /// A name, with its position.
    pub const PLACED: Self = Type::new(Shape::One(Accepts::Name), |item, _| item.placed_text());
}

impl<X: Dialect> Type<bool, X> {
    /// A boolean.
    pub const BOOLEAN: Self = Type::new(Shape::One(Accepts::Boolean), |item, _| item.boolean());
}

impl<X: Dialect> Type<SimDuration, X> {
    /// A duration.
    pub const DURATION: Self = Type::new(Shape::One(Accepts::Duration), |item, _| item.duration());
    /// A duration longer than zero.
    pub const POSITIVE_DURATION: Self =
        Type::new(Shape::One(Accepts::PositiveDuration), |item, _| {
            item.positive_duration()
        });
}

impl<X: Dialect> Type<u64, X> {
    /// A whole number.
    pub const NATURAL: Self = Type::new(Shape::One(Accepts::Natural(0..=u64::MAX)), |item, _| {
        item.natural()
    });
}

impl<X: Dialect> Type<usize, X> {
    const INDEX_OR_AXIS: &'static [Shape<X>] = &[
        Shape::Choice(|| vec!["x", "y", "z"]),
        Shape::One(Accepts::Natural(0..=u64::MAX)),
    ];
    /// Element of a signal: its index, or `x`, `y`, `z` for the first three.
    pub const ELEMENT: Self = Type::new(Shape::Either(Self::INDEX_OR_AXIS), |item, _| {
        if item.is_text() {
            return item.choice(&[("x", 0), ("y", 1), ("z", 2)]);
        }
        let index = item.natural()?;
        usize::try_from(index).map_err(|_| item.report("no signal has that many elements", ""))
    });
}

impl<X: Dialect> Type<Vec<Placed<String>>, X> {
    const NAME: &'static Shape<X> = &Shape::One(Accepts::Name);
    /// A list of names.
    pub const NAMES: Self = Type::new(Shape::list(Self::NAME, 0), |item, _| {
        item.each(Item::placed_text)
    });
}

/// Returns a quantity within a range.
pub const fn quantity<X: Dialect>(unit: Unit, range: Range) -> Type<f64, X> {
    let shape = Shape::One(Accepts::Quantity { unit, range });
    Type::new(shape, |item, shape| {
        let Shape::One(Accepts::Quantity { unit, range }) = shape else {
            unreachable!("a quantity");
        };
        item.quantity(*unit, range)
    })
}

/// Returns the words of an enumeration.
pub const fn choice<T: Words, X: Dialect>() -> Type<T, X> {
    Type::new(Shape::Choice(T::words), |item, _| item.choice(T::WORDS))
}

/// Returns a value whose reader depends on other tables.
pub const fn contextual<X: Dialect>(shape: Shape<X>) -> Type<(), X> {
    Type::new(shape, |_, _| Ok(()))
}
