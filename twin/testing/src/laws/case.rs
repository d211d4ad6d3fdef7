use std::fmt::Debug;
use std::ops::RangeInclusive;

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::strategy::Union;

use super::case_ranges::{CASE_RANGES, DrawnKind, ListRanges};

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

/// Damage to a stream of bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Damage {
    /// Number of intact bytes before it.
    pub after: u8,
    /// Its kind.
    pub kind: DamageKind,
}

/// Kind of a damage to a stream of bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DamageKind {
    /// A bit of a byte is wrong: its number, 0 to 7.
    WrongBit(u8),
    /// As many bytes are lost.
    Loss(u8),
    /// A byte arrives twice.
    DoubleByte,
    /// A byte is inserted.
    Insertion(u8),
    /// The bytes, and those behind them, are late by this time \[‰ of a period\].
    Delay(u16),
    /// A whole frame comes before the next transmission: a foreign one, or, if the protocol numbers
    /// its answers, one of the last answers again. The number selects it.
    Frame(u8),
}

/// Kinds of damage that the checksums of a protocol detect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detection {
    /// All of [`DamageKind`], up to a chance of one in some ten thousands: a CRC of 16 bits.
    AllDamage,
    /// Wrong bits, delays and whole frames, but not shifted bytes: a sum of 8 or 16 bits.
    WrongBits,
}

impl Detection {
    pub(super) fn includes(self, kind: DamageKind) -> bool {
        match (self, kind) {
            (Self::AllDamage, _)
            | (_, DamageKind::WrongBit(_) | DamageKind::Delay(_) | DamageKind::Frame(_)) => true,
            (Self::WrongBits, _) => false,
        }
    }
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
