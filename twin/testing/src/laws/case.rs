use std::ops::Range;

use proptest::collection::vec;
use proptest::prelude::*;

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

fn damage(kinds: impl Strategy<Value = DamageKind>) -> impl Strategy<Value = Damage> {
    (0_u8..30, kinds).prop_map(|(after, kind)| Damage { after, kind })
}

fn byte_damage() -> impl Strategy<Value = DamageKind> {
    prop_oneof![
        4 => (0_u8..8).prop_map(DamageKind::WrongBit),
        // Mostly single bytes, and now and then a whole answer.
        2 => prop_oneof![1_u8..4, 4_u8..40].prop_map(DamageKind::Loss),
        1 => Just(DamageKind::DoubleByte),
        1 => any::<u8>().prop_map(DamageKind::Insertion),
        1 => (1_u16..1500).prop_map(DamageKind::Delay),
    ]
}

/// Returns the strategy of the cases of all laws.
pub fn cases() -> impl Strategy<Value = Case> {
    const DAMAGES: Range<usize> = 0..16;
    let to_driver = prop_oneof![
        3 => byte_damage(),
        1 => any::<u8>().prop_map(DamageKind::Frame),
    ];
    (
        vec(damage(to_driver), DAMAGES),
        vec(damage(byte_damage()), 0..5),
        vec(1_u8..12, 1..5),
        vec(40_u16..600, 1..5),
        any::<u16>(),
        0_u16..1000,
        vec(any::<u8>(), 1..48),
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
