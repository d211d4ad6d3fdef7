use serde::{Deserialize, Serialize};

use crate::codes::{
    BROADCAST, ErrorCode, PROTOCOL_VERSION, REGISTER_DEVICE_VERSION, REGISTER_ID,
    REGISTER_PROTOCOL_VERSION,
};
use crate::error::SbcpError;

/// Size of a register; the low byte is transmitted first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Width {
    /// One byte.
    U8,
    /// Two bytes.
    U16,
}

impl Width {
    /// Returns the size in bytes \[B\].
    pub const fn bytes(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::U16 => 2,
        }
    }
}

/// Access of the master to a register. The board can always write.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Access {
    /// Readable.
    ReadOnly,
    /// Readable and writable.
    ReadWrite,
}

/// Register of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Register {
    /// Address.
    pub address: u8,
    /// Size.
    pub width: Width,
    /// Access of the master.
    pub access: Access,
    /// Whether its value can be saved across power cycles.
    pub non_volatile: bool,
    /// Minimum of the values that the master may write.
    pub min: u16,
    /// Maximum of the values that the master may write.
    pub max: u16,
    /// Factory value.
    pub initial: u16,
}

impl Register {
    /// A volatile register of two bytes that accepts any value, with the value `initial` at
    /// power-on.
    pub const fn u16(address: u8, initial: u16) -> Self {
        Self {
            address,
            width: Width::U16,
            access: Access::ReadWrite,
            non_volatile: false,
            min: 0,
            max: u16::MAX,
            initial,
        }
    }

    /// A volatile register of one byte that accepts any value, with the value `initial` at
    /// power-on.
    pub const fn u8(address: u8, initial: u8) -> Self {
        Self {
            width: Width::U8,
            max: u8::MAX as u16,
            ..Self::u16(address, initial as u16)
        }
    }

    /// The same register, read-only for the master.
    #[must_use]
    pub const fn read_only(self) -> Self {
        Self {
            access: Access::ReadOnly,
            ..self
        }
    }

    /// The same register, non-volatile.
    #[must_use]
    pub const fn non_volatile(self) -> Self {
        Self {
            non_volatile: true,
            ..self
        }
    }

    /// The same register, limited to values from `min` to `max`.
    #[must_use]
    pub const fn within(self, min: u16, max: u16) -> Self {
        Self { min, max, ..self }
    }
}

/// Place of a register in its table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RegisterPlace(usize);

/// Registers of a device with their values: the standard head (id, device version, protocol
/// version) and the device-specific ones.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RegisterTable {
    /// In order of address.
    registers: Vec<Register>,
    values: Vec<u16>,
    /// Values restored by a power cycle.
    saved: Vec<u16>,
}

impl RegisterTable {
    /// The registers of a device with factory values and that id.
    ///
    /// # Errors
    /// [`SbcpError::RegisterTwice`], [`SbcpError::RegisterValue`] if a factory value does not fit,
    /// [`SbcpError::Address`] if the id is reserved.
    pub fn new(id: u8, device_version: u16, specific: &[Register]) -> Result<Self, SbcpError> {
        if id >= BROADCAST {
            return Err(SbcpError::Address { class: 0, id });
        }
        let mut registers = vec![
            Register::u8(REGISTER_ID, id)
                .non_volatile()
                .within(0, u16::from(BROADCAST) - 1),
            Register::u16(REGISTER_DEVICE_VERSION, device_version).read_only(),
            Register::u16(REGISTER_PROTOCOL_VERSION, PROTOCOL_VERSION).read_only(),
        ];
        registers.extend_from_slice(specific);
        registers.sort_by_key(|register| register.address);
        for pair in registers.windows(2) {
            if pair[0].address == pair[1].address {
                let address = pair[0].address;
                return Err(SbcpError::RegisterTwice { address });
            }
        }
        for register in &registers {
            let Register { address, width, .. } = *register;
            if width == Width::U8 && register.initial > u16::from(u8::MAX) {
                let value = register.initial;
                return Err(SbcpError::RegisterValue { address, value });
            }
        }
        let values: Vec<u16> = registers.iter().map(|register| register.initial).collect();
        Ok(Self {
            saved: values.clone(),
            values,
            registers,
        })
    }

    fn find(&self, address: u8) -> Option<usize> {
        let by = |register: &Register| register.address;
        self.registers.binary_search_by_key(&address, by).ok()
    }

    /// Returns the registers in order of address.
    pub fn registers(&self) -> &[Register] {
        &self.registers
    }

    /// Returns the value of a register, if it exists.
    pub fn get(&self, address: u8) -> Option<u16> {
        self.find(address).map(|index| self.values[index])
    }

    /// Returns the place of a register, for [`RegisterTable::set`].
    pub fn place(&self, address: u8) -> Option<RegisterPlace> {
        self.find(address).map(RegisterPlace)
    }

    /// Writes a register of two bytes on behalf of the board, read-only or not, without a search.
    ///
    /// # Panics
    /// If the place is of another table.
    pub fn set(&mut self, place: RegisterPlace, value: u16) {
        self.values[place.0] = value;
    }

    /// Writes a register on behalf of the board, read-only or not.
    ///
    /// # Errors
    /// [`SbcpError::NoRegister`], [`SbcpError::RegisterValue`] if the value does not fit.
    pub fn put(&mut self, address: u8, value: u16) -> Result<(), SbcpError> {
        let index = self
            .find(address)
            .ok_or(SbcpError::NoRegister { address })?;
        if self.registers[index].width == Width::U8 && value > u16::from(u8::MAX) {
            return Err(SbcpError::RegisterValue { address, value });
        }
        self.values[index] = value;
        Ok(())
    }

    /// Reads a register on behalf of the master: returns the value and its size.
    ///
    /// # Errors
    /// The error code of the response.
    pub fn read(&self, address: u8) -> Result<(Width, u16), ErrorCode> {
        let index = self.find(address).ok_or(ErrorCode::UNKNOWN_REGISTER)?;
        Ok((self.registers[index].width, self.values[index]))
    }

    /// Writes a register on behalf of the master; returns the value written.
    ///
    /// # Errors
    /// The error code of the response; nothing is written then.
    pub fn write(&mut self, address: u8, bytes: &[u8]) -> Result<u16, ErrorCode> {
        let index = self.find(address).ok_or(ErrorCode::UNKNOWN_REGISTER)?;
        let register = &self.registers[index];
        if register.access == Access::ReadOnly {
            return Err(ErrorCode::READ_ONLY);
        }
        let value = match (register.width, bytes) {
            (Width::U8, &[byte]) => u16::from(byte),
            (Width::U16, &[low, high]) => u16::from_le_bytes([low, high]),
            _ => return Err(ErrorCode::BAD_LENGTH),
        };
        if !(register.min..=register.max).contains(&value) {
            return Err(ErrorCode::BAD_VALUE);
        }
        self.values[index] = value;
        Ok(value)
    }

    /// Saves the values of the non-volatile registers.
    pub fn save(&mut self) {
        for (index, register) in self.registers.iter().enumerate() {
            if register.non_volatile {
                self.saved[index] = self.values[index];
            }
        }
    }

    /// Restores the saved values, and the factory values of all other registers.
    pub fn power_cycle(&mut self) {
        self.values.copy_from_slice(&self.saved);
    }
}
