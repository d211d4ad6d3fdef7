//! Control tables as data.

use twinrig_kernel::SimDuration;

use crate::codes::{Errors, Instruction};
use crate::protocol::ProtocolVersion;
use crate::register::Register;
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
    /// Baud rates.
    pub baud_rates: BaudRates,
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
    /// Lock of the EEPROM.
    pub lock: EepromLock,
    /// Whether a write is kept for an action, if there is such a register.
    pub registered: Option<u16>,
    /// Hardware error, which answers report; without such a register they report
    /// [`crate::Registers::alarms`].
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
    /// Greatest goal of the driver.
    pub greatest: i32,
}

/// Lock of the EEPROM.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EepromLock {
    /// Writes are refused while torque is on.
    Torque,
    /// Writes are lost at a restart while the register at this address is not 0.
    Volatile(u16),
    /// Writes are refused after the register at this address has been set, until a restart.
    UntilRestart(u16),
}

impl EepromLock {
    /// Returns whether the register at an address is the lock.
    pub(crate) fn is_register(self, address: u16) -> bool {
        match self {
            Self::Torque => false,
            Self::Volatile(lock) | Self::UntilRestart(lock) => lock == address,
        }
    }
}

/// Baud rates by the value of their register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BaudRates {
    /// These \[bit/s\], from the value 0 on.
    Listed(&'static [u32]),
    /// This rate \[bit/s\] divided by the value and 1.
    Divided(u32),
}

impl BaudRates {
    /// Returns the baud rate for a value \[bit/s\], if there is one.
    pub fn rate(self, value: u8) -> Option<u32> {
        match self {
            Self::Listed(rates) => rates.get(usize::from(value)).copied(),
            Self::Divided(rate) => Some(rate / (u32::from(value) + 1)),
        }
    }

    /// Returns the value for a baud rate \[bit/s\], if there is one.
    pub fn value(self, rate: u64) -> Option<u8> {
        (0..=u8::MAX).find(|value| self.rate(*value).map(u64::from) == Some(rate))
    }

    /// Returns the greatest baud rates, at most eight, for messages.
    pub fn names(self) -> String {
        let rates = (0..8).filter_map(|value| self.rate(value));
        rates
            .map(|rate| rate.to_string())
            .collect::<Vec<_>>()
            .join(", ")
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

    /// Returns the goal for an angle \[rad\], and whether it is limited to the range; none for an
    /// angle that is not a number.
    #[expect(clippy::cast_possible_truncation, reason = "within the range")]
    pub(crate) fn goal_counts(&self, angle: f64) -> Option<(i32, bool)> {
        if angle.is_nan() {
            return None;
        }
        let position = &self.position;
        let exact = angle / core::f64::consts::TAU * position.counts_per_turn;
        let counts = libm::rint(exact) + f64::from(position.centre);
        let most = f64::from(position.greatest);
        let limited = counts.clamp(0.0, most);
        Some((limited as i32, limited != counts))
    }
}
