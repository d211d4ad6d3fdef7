//! The registers of a motordriver board. What there is comes from the public liboncilla-hw sources of 2014; where it is,
//! and which numbers the modes have, is ASSUMED.

use twinrig_sbcp::codes::REGISTER_FIRST_OWN;
use twinrig_sbcp::{Register, RegisterTable, SbcpError};

use crate::config::BoardConfig;

/// Version of the board and its firmware. ASSUMED.
const DEVICE_VERSION: u16 = 0x0100;

/// A register that each motor has. The discriminants are the places within the motor's block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum MotorRegister {
    Mode,
    GoalPosition,
    PresentPosition,
    PGain,
    IGain,
    DGain,
    /// Kept, without effect; as damping and preload.
    Stiffness,
    Damping,
    Preload,
    MaxTorque,
    MaxSpeed,
    /// Kept, without effect.
    MaxAcceleration,
    PositionLimit,
}

impl MotorRegister {
    /// Its address for motor 0 or 1.
    pub(crate) const fn of(self, motor: usize) -> u8 {
        let block = if motor == 0 {
            REGISTER_FIRST_OWN
        } else {
            REGISTER_FIRST_OWN + MOTOR_BLOCK
        };
        block + self as u8
    }
}

/// ASSUMED: registers of a motor.
const MOTOR_BLOCK: u8 = 0x10;
/// ASSUMED: where what the motors share begins.
const SHARED: u8 = REGISTER_FIRST_OWN + 2 * MOTOR_BLOCK;
/// Period of the set-points \[ms\].
pub(crate) const SMOOTH_POSITION_UPDATE: u8 = SHARED;
/// First of the three words of the magnetic encoders.
pub(crate) const MAGNETIC: u8 = SHARED + 1;
/// First of the three counts of the force sensor.
pub(crate) const FORCE: u8 = SHARED + 4;

/// Bit 9 of the mode: the motor was calibrated since power-on.
pub(crate) const RUNTIME_CALIBRATED: u16 = 1 << 9;
/// ASSUMED: what of the mode register is the mode.
const MODE_MASK: u16 = 0x00FF;

/// What a motor is at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(crate) enum Mode {
    /// Nothing: the bridge is open. ASSUMED number, as all of these.
    #[default]
    Coast = 0,
    /// Finding out where it is.
    Calibrate = 1,
    /// Following the last set-point that came.
    Position = 2,
    /// Following what is interpolated between set-points.
    SmoothPosition = 3,
}

impl Mode {
    /// What a mode register says.
    pub(crate) const fn of(register: u16) -> Self {
        match register & MODE_MASK {
            1 => Self::Calibrate,
            2 => Self::Position,
            3 => Self::SmoothPosition,
            _ => Self::Coast,
        }
    }

    /// Whether the motor is driven in it.
    pub(crate) const fn is_driven(self) -> bool {
        matches!(self, Self::Position | Self::SmoothPosition)
    }
}

/// The table of a board as it leaves the works.
pub(crate) fn table(board: &BoardConfig) -> Result<RegisterTable, SbcpError> {
    let mut own = vec![Register::u16(SMOOTH_POSITION_UPDATE, 2).within(2, 1_000)];
    for motor in 0..2 {
        let at = |register: MotorRegister, initial| Register::u16(register.of(motor), initial);
        let limit = board.position_limits[motor];
        own.extend([
            at(MotorRegister::Mode, Mode::Coast as u16).within(0, Mode::SmoothPosition as u16),
            at(MotorRegister::GoalPosition, 0).within(0, 0x0FFF),
            at(MotorRegister::PresentPosition, 0).read_only(),
            at(MotorRegister::PGain, 0),
            at(MotorRegister::IGain, 0),
            at(MotorRegister::DGain, 0),
            at(MotorRegister::Stiffness, 0),
            at(MotorRegister::Damping, 0),
            at(MotorRegister::Preload, 0),
            at(MotorRegister::MaxTorque, 0),
            at(MotorRegister::MaxSpeed, 0),
            at(MotorRegister::MaxAcceleration, 0),
            at(MotorRegister::PositionLimit, limit).non_volatile(),
        ]);
    }
    own.extend((0..3).map(|n| Register::u16(MAGNETIC + n, 0).read_only()));
    own.extend((0..3).map(|n| Register::u16(FORCE + n, 0).read_only()));
    RegisterTable::new(board.id, DEVICE_VERSION, &own)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mode_survives_its_flags() {
        for mode in [
            Mode::Coast,
            Mode::Calibrate,
            Mode::Position,
            Mode::SmoothPosition,
        ] {
            assert_eq!(Mode::of(mode as u16 | RUNTIME_CALIBRATED), mode);
        }
        assert_eq!(Mode::of(0x00AA), Mode::Coast);
    }

    #[test]
    fn every_register_has_an_address_of_its_own() {
        let table = table(&BoardConfig::default()).unwrap();
        assert_eq!(table.get(MotorRegister::PositionLimit.of(1)), Some(1_350));
        assert_eq!(table.registers().len(), 3 + 1 + 2 * 13 + 6);
    }
}
