use std::fmt::Debug;
use std::ops::RangeInclusive;

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::strategy::Union;

use super::case_ranges::{CASE_RANGES, DrawnKind, ListRanges};
use super::damage::Damage;

/// What happens to the course of a run, drawn by [`cases`]. Each law uses the part that concerns
/// it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Case {
    /// Damage to the bytes on their way to the driver.
    pub to_driver: Vec<Damage>,
    /// Damage to the bytes on their way to the devices.
    pub to_devices: Vec<Damage>,
    /// Lengths of the pieces into which streams are cut, in turn \[bytes\].
    pub pieces: Vec<u8>,
    /// Times between two looks, in turn \[‰ of a period\].
    pub looks: Vec<u16>,
    /// Number of the transmission within which the state is saved, modulo their number. Where the
    /// opening may be damaged, it is if this is a multiple of 4.
    pub saved: u16,
    /// Place within this transmission \[‰\].
    pub saved_at: u16,
    /// Bytes of garbage.
    pub garbage: Vec<u8>,
}

/// Returns the strategy of a number of damages of those kinds of [`CASE_RANGES`] that are included.
fn damages(
    count: &RangeInclusive<usize>,
    is_included: fn(&DrawnKind) -> bool,
) -> impl Strategy<Value = Vec<Damage>> + use<> {
    let included = CASE_RANGES.kinds.iter().filter(|it| is_included(it));
    let kinds = included.map(|it| (it.weight, it.number.clone().prop_map(it.kind)));
    let kinds = Union::new_weighted(kinds.collect());
    let damage = (CASE_RANGES.after.clone(), kinds);
    vec(
        damage.prop_map(|(after, kind)| Damage { after, kind }),
        count.clone(),
    )
}

fn list<T>(ranges: &ListRanges<T>) -> impl Strategy<Value = Vec<T>> + use<T>
where
    T: Clone + Debug,
    RangeInclusive<T>: Strategy<Value = T>,
{
    vec(ranges.number.clone(), ranges.length.clone())
}

/// Returns the strategy of the cases of all laws: those of [`CASE_RANGES`].
pub fn cases() -> impl Strategy<Value = Case> {
    let ranges = &CASE_RANGES;
    (
        damages(&ranges.to_driver, |_| true),
        damages(&ranges.to_devices, |it| it.to_devices),
        list(&ranges.pieces),
        list(&ranges.looks),
        ranges.saved.clone(),
        ranges.saved_at.clone(),
        list(&ranges.garbage),
    )
        .prop_map(
            |(to_driver, to_devices, pieces, looks, saved, saved_at, garbage)| Case {
                to_driver,
                to_devices,
                pieces,
                looks,
                saved,
                saved_at,
                garbage,
            },
        )
}
