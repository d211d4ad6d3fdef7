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
