use std::ops::RangeInclusive;

use super::DamageKind;

/// Ranges from which [`cases`](super::cases) draws: for generators of cases in other languages.
#[derive(Clone, Debug)]
pub struct CaseRanges {
    /// Number of damages to the bytes on their way to the driver.
    pub to_driver: RangeInclusive<usize>,
    /// Number of damages to the bytes on their way to the devices.
    pub to_devices: RangeInclusive<usize>,
    /// Number of intact bytes before a damage.
    pub after: RangeInclusive<u8>,
    /// Kinds of damage.
    pub kinds: [DrawnKind; 7],
    /// Lengths of pieces \[bytes\].
    pub pieces: ListRanges<u8>,
    /// Times between looks \[‰ of a period\].
    pub looks: ListRanges<u16>,
    /// Number of the transmission within which the state is saved.
    pub saved: RangeInclusive<u16>,
    /// Place within this transmission \[‰\].
    pub saved_at: RangeInclusive<u16>,
    /// Garbage.
    pub garbage: ListRanges<u8>,
}

/// Ranges of a list of numbers.
#[derive(Clone, Debug)]
pub struct ListRanges<T> {
    /// Of its length.
    pub length: RangeInclusive<usize>,
    /// Of each number.
    pub number: RangeInclusive<T>,
}

/// A kind of damage with the range of its number.
#[derive(Clone, Debug)]
pub struct DrawnKind {
    /// Name: `wrong bit`. Kinds of which some numbers are drawn more often than others come twice.
    pub name: &'static str,
    /// Share of all draws, in comparison with that of the other kinds.
    pub weight: u32,
    /// Whether it concerns the bytes on their way to the devices, too.
    pub to_devices: bool,
    /// Range of its number; 0 for a kind without one.
    pub number: RangeInclusive<u16>,
    pub(super) kind: fn(u16) -> DamageKind,
}

impl DamageKind {
    /// Returns the kind with this name and number, if [`CASE_RANGES`] has both.
    pub fn named(name: &str, number: u16) -> Option<Self> {
        let mut kinds = CASE_RANGES.kinds.iter();
        let found = kinds.find(|it| it.name == name && it.number.contains(&number))?;
        Some((found.kind)(number))
    }
}

const fn drawn(
    (weight, name): (u32, &'static str),
    number: RangeInclusive<u16>,
    kind: fn(u16) -> DamageKind,
) -> DrawnKind {
    DrawnKind {
        name,
        weight,
        to_devices: true,
        number,
        kind,
    }
}

/// Returns a number whose range is that of bytes.
fn byte(number: u16) -> u8 {
    number.to_le_bytes()[0]
}

/// The ranges of [`cases`](super::cases).
pub static CASE_RANGES: CaseRanges = CaseRanges {
    to_driver: 0..=15,
    to_devices: 0..=4,
    after: 0..=29,
    kinds: [
        drawn((4, "wrong bit"), 0..=7, |bit| {
            DamageKind::WrongBit(byte(bit))
        }),
        // Mostly single bytes, and now and then a whole answer.
        drawn((1, "loss"), 1..=3, |count| DamageKind::Loss(byte(count))),
        drawn((1, "loss"), 4..=39, |count| DamageKind::Loss(byte(count))),
        drawn((1, "double byte"), 0..=0, |_| DamageKind::DoubleByte),
        drawn((1, "insertion"), 0..=255, |it| {
            DamageKind::Insertion(byte(it))
        }),
        drawn((1, "delay"), 1..=1499, DamageKind::Delay),
        DrawnKind {
            to_devices: false,
            ..drawn((3, "frame"), 0..=255, |it| DamageKind::Frame(byte(it)))
        },
    ],
    pieces: ListRanges {
        length: 1..=4,
        number: 1..=11,
    },
    looks: ListRanges {
        length: 1..=4,
        number: 40..=599,
    },
    saved: 0..=u16::MAX,
    saved_at: 0..=999,
    garbage: ListRanges {
        length: 1..=47,
        number: 0..=u8::MAX,
    },
};
