//! Reading vectors of three quantities: forward, left and up.

use twinrig_document::{Item, Range, Reported};
use twinrig_kernel::Unit;

use crate::language::{Accepts, Shape, Type};

/// Greatest distance of a place on the trunk along each axis \[m\]: beyond, a unit is wrong.
const DISTANCE: Range = Range::between(-10.0, 10.0);

/// Returns the shape of three quantities of any size.
pub(super) const fn three(of: &'static Shape) -> Shape {
    Shape::list(of, 3)
}

/// Type of a place on the trunk, in its axes from its centre of mass.
pub(super) const PLACE: Type<[f64; 3]> = Type::new(
    three(&Shape::One(Accepts::Quantity {
        unit: Unit::Meter,
        range: DISTANCE,
    })),
    |item, _| vector(item, Unit::Meter, &DISTANCE),
);

/// Reads three quantities.
pub(super) fn vector(item: &Item<'_>, unit: Unit, range: &Range) -> Result<[f64; 3], Reported> {
    item.quantities(unit, range, "give its components forward, left and up")
}
