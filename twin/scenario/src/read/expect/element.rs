//! Reading the element of a signal.

use twinrig_document::{Item, Reported};

use crate::language::{Accepts, Shape, Type};

/// Element of a signal.
pub(super) const ELEMENT: Type<usize> = Type::new(
    Shape::Either(&[
        Shape::Choice(|| vec!["x", "y", "z"]),
        Shape::One(Accepts::Natural(0..=u64::MAX)),
    ]),
    |item, _| component(item),
);

/// Reads an element of a signal: its index, or `x`, `y`, `z` for the first three.
fn component(item: &Item<'_>) -> Result<usize, Reported> {
    if item.is_text() {
        return item.choice(&[("x", 0), ("y", 1), ("z", 2)]);
    }
    let index = item.natural()?;
    usize::try_from(index).map_err(|_| item.report("no signal has that many elements", ""))
}
