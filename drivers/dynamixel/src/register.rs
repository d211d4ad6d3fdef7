//! Registers of control tables, and their numbers as bytes.

/// Register of a control table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Register {
    /// Address of the first byte.
    pub address: u16,
    /// Number of bytes.
    pub size: u8,
    /// Order of the bytes.
    pub order: ByteOrder,
    /// Name: that of the manual in lower case, with underscores.
    pub name: &'static str,
    /// Access from the bus.
    pub access: Access,
    /// Initial value.
    pub initial: i32,
    /// Representation of its numbers.
    pub format: Format,
    /// Values that can be written.
    pub bounds: Bounds,
    /// Origin of this line.
    pub source: Source,
}

/// Representation of the numbers of a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Without a sign.
    Unsigned,
    /// Two's complement.
    TwosComplement,
    /// Magnitude, and this bit for the sign.
    SignBit(u8),
}

/// Order of the bytes of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ByteOrder {
    /// Low byte first.
    LowFirst,
    /// High byte first.
    HighFirst,
}

/// Access to a register from the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Set by the servo.
    ReadOnly,
    /// Can be written at any time; lost when the servo restarts.
    Ram,
    /// Can be written while torque is off; kept when the servo restarts.
    Eeprom,
}

/// Values that can be written to a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bounds {
    /// From one value to another.
    Between(i32, i32),
    /// One of these values.
    OneOf(&'static [i32]),
    /// Any value whose magnitude is that of the register at this address at most.
    Limit(u16),
    /// From the value of one register to that of another, while the register at `mode` is
    /// `in_mode`; otherwise from `−otherwise` to `otherwise`.
    Positions {
        /// Addresses of both limits.
        limits: [u16; 2],
        /// Address of the operating mode.
        mode: u16,
        /// Its value in which the limits hold.
        in_mode: i32,
        /// Greatest magnitude in other modes.
        otherwise: i32,
    },
    /// From the value of one register to that of another, or any up to `greatest` if both are 0.
    AngleLimits {
        /// Addresses of both limits.
        limits: [u16; 2],
        /// Greatest value without limits.
        greatest: i32,
    },
}

/// Origin of a line of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The table of the model in the vendor's manual.
    Manual,
    /// Another source.
    Other(&'static str),
    /// No source.
    Assumed,
}

impl Bounds {
    /// Returns the bounds, if they do not depend on other registers.
    pub(crate) const fn constant(self) -> Option<[i32; 2]> {
        match self {
            Self::Between(low, high) => Some([low, high]),
            Self::OneOf(_) | Self::Limit(_) | Self::Positions { .. } | Self::AngleLimits { .. } => {
                None
            }
        }
    }
}

/// Returns the registers of a table. The constant of a table does not compile if its registers are
/// not sorted by address, overlap, or have an initial value out of their bounds.
///
/// ```compile_fail
/// # use twinrig_dynamixel::{Register, registers};
/// static TABLE: &[Register] = registers(&[
///     Register::read_only(0, 2, "model_number"),
///     Register::read_only(1, 1, "firmware_version"),
/// ]);
/// ```
///
/// # Panics
/// Under the same conditions, where it is not called for a constant.
pub const fn registers(table: &'static [Register]) -> &'static [Register] {
    let mut n = 0;
    let mut end = 0;
    while n < table.len() {
        let register = &table[n];
        assert!(register.address >= end, "registers overlap");
        assert!(
            matches!(register.size, 1 | 2 | 4),
            "a size is not 1, 2 or 4"
        );
        if let Bounds::Between(low, high) = register.bounds {
            let initial = register.initial;
            assert!(
                low <= initial && initial <= high,
                "an initial value is out of bounds"
            );
        }
        end = register.address + register.size as u16;
        n += 1;
    }
    table
}

impl Register {
    /// Returns the number that bytes of this register are; none if they are of another length.
    pub(crate) fn decode(&self, bytes: &[u8]) -> Option<i32> {
        if bytes.len() != usize::from(self.size) {
            return None;
        }
        let highest = match self.order {
            ByteOrder::LowFirst => bytes.last(),
            ByteOrder::HighFirst => bytes.first(),
        };
        let is_negative = highest.is_some_and(|byte| *byte >= 0x80);
        let extended = self.format == Format::TwosComplement && is_negative;
        let mut number = [if extended { 0xff } else { 0 }; 4];
        let low_first = number.get_mut(..bytes.len())?;
        low_first.copy_from_slice(bytes);
        if self.order == ByteOrder::HighFirst {
            low_first.reverse();
        }
        let number = i32::from_le_bytes(number);
        Some(match self.format {
            Format::SignBit(bit) if number >> bit & 1 == 1 => -(number & !(1 << bit)),
            _ => number,
        })
    }

    /// Returns the nearest number that the register can hold.
    pub(crate) fn representable(&self, number: i32) -> i32 {
        let bits = 8 * u32::from(self.size);
        let [low, high] = match self.format {
            _ if bits >= 32 => [i32::MIN, i32::MAX],
            Format::Unsigned => [0, (1 << bits) - 1],
            Format::TwosComplement => [-(1 << (bits - 1)), (1 << (bits - 1)) - 1],
            Format::SignBit(bit) => [1 - (1 << bit), (1 << bit) - 1],
        };
        number.clamp(low, high)
    }

    /// Returns the bytes of a number, of which the first ones are those of this register.
    pub(crate) fn encode(&self, number: i32) -> [u8; 4] {
        let bits = match self.format {
            Format::SignBit(bit) if number < 0 => number.saturating_neg() | 1 << bit,
            _ => number,
        };
        let mut bytes = bits.to_le_bytes();
        if self.order == ByteOrder::HighFirst {
            bytes[..usize::from(self.size).min(4)].reverse();
        }
        bytes
    }

    /// A register that the servo sets.
    pub const fn read_only(address: u16, size: u8, name: &'static str) -> Self {
        Self {
            address,
            size,
            order: ByteOrder::LowFirst,
            name,
            access: Access::ReadOnly,
            initial: 0,
            format: Format::Unsigned,
            bounds: Bounds::Between(i32::MIN, i32::MAX),
            source: Source::Manual,
        }
    }

    /// A register that is lost when the servo restarts.
    pub const fn ram(
        address: u16,
        size: u8,
        name: &'static str,
        initial: i32,
        bounds: Bounds,
    ) -> Self {
        Self {
            access: Access::Ram,
            initial,
            format: match bounds {
                Bounds::Between(0.., _) | Bounds::OneOf(_) => Format::Unsigned,
                _ => Format::TwosComplement,
            },
            bounds,
            ..Self::read_only(address, size, name)
        }
    }

    /// A register that is kept when the servo restarts.
    pub const fn eeprom(
        address: u16,
        size: u8,
        name: &'static str,
        initial: i32,
        low: i32,
        high: i32,
    ) -> Self {
        Self {
            access: Access::Eeprom,
            ..Self::ram(address, size, name, initial, Bounds::Between(low, high))
        }
    }

    /// The same with some values only.
    #[must_use]
    pub const fn one_of(self, values: &'static [i32]) -> Self {
        Self {
            bounds: Bounds::OneOf(values),
            ..self
        }
    }

    /// The same with the high byte first.
    #[must_use]
    pub const fn high_first(self) -> Self {
        Self {
            order: ByteOrder::HighFirst,
            ..self
        }
    }

    /// The same with a bit for the sign.
    #[must_use]
    pub const fn with_sign_bit(self, bit: u8) -> Self {
        Self {
            format: Format::SignBit(bit),
            ..self
        }
    }

    /// The same with numbers without a sign.
    #[must_use]
    pub const fn unsigned(self) -> Self {
        Self {
            format: Format::Unsigned,
            ..self
        }
    }

    /// The same with numbers in two's complement.
    #[must_use]
    pub const fn signed(self) -> Self {
        Self {
            format: Format::TwosComplement,
            ..self
        }
    }

    /// The same with a constant value.
    #[must_use]
    pub const fn of(self, initial: i32) -> Self {
        Self { initial, ..self }
    }

    /// The same from another source than the manual.
    #[must_use]
    pub const fn from(self, source: &'static str) -> Self {
        Self {
            source: Source::Other(source),
            ..self
        }
    }

    /// The same with a value that has no source.
    #[must_use]
    pub const fn assumed(self, initial: i32) -> Self {
        Self {
            initial,
            source: Source::Assumed,
            ..self
        }
    }
}
