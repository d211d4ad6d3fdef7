//! Control tables as data.

use twinrig_kernel::SimDuration;

use crate::codes::{ErrorNumber, Instruction};
use crate::protocol::ProtocolVersion;
use crate::request::Span;

/// Model of a servo.
#[derive(Debug)]
pub struct ServoModel {
    /// Name: `XL330-M288-T`.
    pub name: &'static str,
    /// Protocol of its packets.
    pub protocol: ProtocolVersion,
    /// Registers by address, without indirect ones.
    pub items: &'static [Register],
    /// Indirect registers.
    pub indirect: &'static [Indirect],
    /// Errors of its answers.
    pub errors: Errors,
    /// Addresses of the registers that communication itself uses.
    pub roles: CommonRegisters,
    /// Registers of the position, and its unit.
    pub position: PositionScale,
    /// Registers that others determine.
    pub derived: &'static [Derived],
    /// Instructions that the servo does not have, though its protocol has them.
    pub lacks: &'static [Instruction],
    /// Whether a write that is not valid is refused as a whole. Otherwise values are limited, and
    /// bytes that cannot be written are left out.
    pub is_strict: bool,
    /// Baud rates by the value of their register \[bit/s\].
    pub baud_rates: &'static [u32],
}

/// Register of a control table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Register {
    /// Address of the first byte.
    pub address: u16,
    /// Number of bytes, low byte first.
    pub size: u8,
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

impl Bounds {
    /// Returns the bounds, if they do not depend on other registers.
    pub(crate) const fn constant(self) -> Option<[i32; 2]> {
        match self {
            Self::Between(low, high) => Some([low, high]),
            Self::OneOf(_) | Self::Limit(_) | Self::Positions { .. } => None,
        }
    }
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
}

/// Origin of a line of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The table of the model in the vendor's manual.
    Manual,
    /// No source.
    Assumed,
}

/// Register that another determines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Derived {
    /// Its address.
    pub register: u16,
    /// Address of the register whose value it gets; without one its initial value.
    pub from: Option<u16>,
    /// Whether it does when the servo starts.
    pub at_start: bool,
    /// Address of the register by whose writes it does, too.
    pub by_write: Option<u16>,
}

/// Registers that stand for bytes of others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Indirect {
    /// Address of the first address register, of two bytes each.
    pub addresses: u16,
    /// Address of the first data register, of a byte each.
    pub data: u16,
    /// Number of both.
    pub count: u16,
    /// Least and greatest address for which they stand.
    pub targets: [u16; 2],
}

/// Addresses of registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CommonRegisters {
    /// Model number, of two bytes.
    pub model: u16,
    /// Version of the firmware.
    pub firmware: u16,
    /// Identifier.
    pub id: u16,
    /// Baud rate.
    pub baud_rate: u16,
    /// Return delay.
    pub return_delay: ReturnDelay,
    /// Status return level.
    pub status_level: u16,
    /// What is added to its value to get that of protocol 2.0: 0 for answers to pings alone, 1 for
    /// those to reads, 2 for all.
    pub status_offset: i32,
    /// Torque enable.
    pub torque: u16,
    /// Register that, when it is not 0, lets writes to the EEPROM be lost at a restart. Without it
    /// torque locks the EEPROM.
    pub lock: Option<u16>,
    /// Whether a write is kept for an action, if there is such a register.
    pub registered: Option<u16>,
    /// Hardware error, which answers report, if there is such a register.
    pub hardware_error: Option<u16>,
    /// Whether the shaft moves.
    pub moving: u16,
    /// Bus watchdog, and the goals that cannot be written while it reports silence.
    pub watchdog: Option<(u16, &'static [u16])>,
}

/// Registers of the position, and its unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionScale {
    /// Address of the goal.
    pub goal: u16,
    /// Address of the position.
    pub present: u16,
    /// Counts of a turn.
    pub counts_per_turn: f64,
    /// Position at angle 0.
    pub centre: i32,
}

/// Errors of answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Errors {
    /// Numbers of protocol 2.0, and the alert bit if there is a hardware error.
    Numbers,
    /// Bits of protocol 1.0, some of which are those of the hardware error.
    Bits,
    /// Bits of the hardware error alone.
    Hardware,
}

/// Errors that an answer reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ReportedErrors {
    /// A hardware error.
    pub(crate) hardware: bool,
    /// The instruction was refused.
    pub(crate) refused: bool,
}

impl Errors {
    /// Returns whether an error byte reports a hardware error, and whether it reports that the
    /// instruction was refused.
    pub(crate) fn of_byte(self, error: u8) -> ReportedErrors {
        const OF_INSTRUCTION: u8 = 0b0101_1000;
        match self {
            Self::Numbers => ReportedErrors {
                hardware: error & ErrorNumber::ALERT != 0,
                refused: error & !ErrorNumber::ALERT != 0,
            },
            Self::Bits => ReportedErrors {
                hardware: error & !OF_INSTRUCTION != 0,
                refused: error & OF_INSTRUCTION != 0,
            },
            Self::Hardware => ReportedErrors {
                hardware: error != 0,
                refused: false,
            },
        }
    }

    /// Returns the error byte of an answer.
    pub(crate) fn byte(self, error: ErrorNumber, hardware: u8) -> u8 {
        const RANGE: u8 = 1 << 3;
        const CHECKSUM: u8 = 1 << 4;
        const INSTRUCTION: u8 = 1 << 6;
        match self {
            Self::Numbers if hardware == 0 => error.0,
            Self::Numbers => error.0 | ErrorNumber::ALERT,
            Self::Hardware => hardware,
            Self::Bits => {
                hardware
                    | match error {
                        ErrorNumber::OK => 0,
                        ErrorNumber::CRC => CHECKSUM,
                        ErrorNumber::INSTRUCTION => INSTRUCTION,
                        _ => RANGE,
                    }
            }
        }
    }
}

/// Time from an instruction to its answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReturnDelay {
    /// The register at this address, in units of 2 µs.
    Register(u16),
    /// Constant.
    Fixed(SimDuration),
}

impl CommonRegisters {
    /// Value of the bus watchdog after silence: −1.
    pub(crate) const SILENCE: i32 = 0xff;
}

impl ServoModel {
    /// Returns the register that begins at an address.
    pub fn item(&self, address: u16) -> Option<&'static Register> {
        let found = self.items.binary_search_by_key(&address, |it| it.address);
        found.ok().map(|at| &self.items[at])
    }

    /// Returns the register that contains an address.
    pub(crate) fn item_around(&self, address: u16) -> Option<&'static Register> {
        let behind = self.items.partition_point(|it| it.address <= address);
        let item = &self.items[behind.checked_sub(1)?];
        (address < item.address + u16::from(item.size)).then_some(item)
    }

    /// Returns the indirect registers of which one is at an address.
    pub(crate) fn indirect_around(&self, address: u16) -> Option<&'static Indirect> {
        self.indirect.iter().find(|it| {
            (it.addresses..it.addresses + 2 * it.count).contains(&address)
                || (it.data..it.data + it.count).contains(&address)
        })
    }

    /// Returns the register of a name.
    pub fn named(&self, name: &str) -> Option<&'static Register> {
        self.items.iter().find(|item| item.name == name)
    }

    /// Returns the number of bytes of the table.
    pub fn size(&self) -> u16 {
        let items = self
            .items
            .last()
            .map_or(0, |it| it.address + u16::from(it.size));
        let ends = self.indirect.iter();
        let ends = ends.flat_map(|it| [it.addresses + 2 * it.count, it.data + it.count]);
        ends.fold(items, u16::max)
    }

    fn span(&self, address: u16) -> Span {
        let length = self.item(address).map_or(0, |item| item.size.into());
        Span { address, length }
    }

    /// Returns the register of the goal.
    pub(crate) fn goal(&self) -> Span {
        self.span(self.position.goal)
    }

    /// Returns the register of the position.
    pub(crate) fn present(&self) -> Span {
        self.span(self.position.present)
    }

    /// Returns the number that the bytes of the position are; none if they are of another length.
    pub(crate) fn counts(&self, data: &[u8]) -> Option<i32> {
        self.item(self.position.present)?.decode(data)
    }

    /// Returns the bytes of a goal, of which the first ones are those of its register.
    pub(crate) fn goal_bytes(&self, counts: i32) -> [u8; 4] {
        let item = self.item(self.position.goal);
        item.map_or_else(|| counts.to_le_bytes(), |item| item.encode(counts))
    }

    /// Returns the angle of a position \[rad\].
    pub(crate) fn angle(&self, counts: i32) -> f64 {
        let from_centre = f64::from(counts) - f64::from(self.position.centre);
        from_centre / self.position.counts_per_turn * core::f64::consts::TAU
    }

    /// Returns the goal for an angle \[rad\], and whether it is limited to a turn; none for an
    /// angle that is not a number.
    #[expect(clippy::cast_possible_truncation, reason = "within a turn")]
    pub(crate) fn goal_counts(&self, angle: f64) -> Option<(i32, bool)> {
        if angle.is_nan() {
            return None;
        }
        let position = &self.position;
        let exact = angle / core::f64::consts::TAU * position.counts_per_turn;
        let counts = libm::rint(exact) + f64::from(position.centre);
        let most = position.counts_per_turn - 1.0;
        let limited = counts.clamp(0.0, most);
        Some((limited as i32, limited != counts))
    }
}

impl Register {
    /// Returns the number that bytes of this register are; none if they are of another length.
    pub(crate) fn decode(&self, bytes: &[u8]) -> Option<i32> {
        if bytes.len() != usize::from(self.size) {
            return None;
        }
        let is_negative = bytes.last().is_some_and(|byte| *byte >= 0x80);
        let extended = self.format == Format::TwosComplement && is_negative;
        let mut number = [if extended { 0xff } else { 0 }; 4];
        number.get_mut(..bytes.len())?.copy_from_slice(bytes);
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
        bits.to_le_bytes()
    }

    /// A register that the servo sets.
    pub const fn read_only(address: u16, size: u8, name: &'static str) -> Self {
        Self {
            address,
            size,
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

    /// The same with a bit for the sign.
    #[must_use]
    pub const fn with_sign_bit(self, bit: u8) -> Self {
        Self {
            format: Format::SignBit(bit),
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
