//! Registers of a motordriver board. Their list is from the public liboncilla-hw sources of 2014;
//! their addresses and the codes of the modes are ASSUMED.

use twinrig_sbcp::codes::REGISTER_FIRST_OWN;
use twinrig_sbcp::{Register, RegisterPlace, RegisterTable, SbcpError};

use crate::config::BoardConfig;
use crate::units::{CONTINUOUS, POSITION_MASK};

/// ASSUMED: version of the board and its firmware.
const DEVICE_VERSION: u16 = 0x0100;

/// Register of a motor. The discriminants are offsets within the motor's block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum MotorRegister {
    Mode,
    GoalPosition,
    PresentPosition,
    PGain,
    IGain,
    DGain,
    /// Stored without effect, as are damping and preload.
    Stiffness,
    Damping,
    Preload,
    MaxTorque,
    MaxSpeed,
    /// Effective in velocity mode only.
    MaxAcceleration,
    PositionLimit,
}

impl MotorRegister {
    /// Returns the address for motor 0 or 1.
    pub(crate) const fn address(self, motor: usize) -> u8 {
        let block = if motor == 0 {
            REGISTER_FIRST_OWN
        } else {
            REGISTER_FIRST_OWN + MOTOR_BLOCK
        };
        block + self as u8
    }
}

/// ASSUMED: size of a motor's block of registers.
const MOTOR_BLOCK: u8 = 0x10;
/// ASSUMED: first register common to both motors.
const SHARED: u8 = REGISTER_FIRST_OWN + 2 * MOTOR_BLOCK;
/// Period of the set-points \[ms\].
pub(crate) const SMOOTH_POSITION_UPDATE: u8 = SHARED;
/// First of the three words of the magnetic encoders.
pub(crate) const MAGNETIC: u8 = SHARED + 1;
/// First of the three counts of the force sensor.
pub(crate) const FORCE: u8 = SHARED + 4;

/// Bit 9 of the mode: the motor was calibrated since power-on.
pub(crate) const RUNTIME_CALIBRATED: u16 = 1 << 9;
/// ASSUMED: bits of the mode register that hold the mode.
const MODE_MASK: u16 = 0x00FF;

/// Operating mode of a motor. ASSUMED codes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(crate) enum Mode {
    /// Open bridge.
    #[default]
    Coast = 0,
    /// Start-up calibration of the position.
    Calibrate = 1,
    /// Position control on the last set-point received.
    Position = 2,
    /// Position control on set-points interpolated over each period.
    SmoothPosition = 3,
    /// Position control on a set-point that advances at the commanded speed.
    Velocity = 4,
}

impl Mode {
    /// Decodes a mode register.
    pub(crate) const fn from_register(register: u16) -> Self {
        match register & MODE_MASK {
            1 => Self::Calibrate,
            2 => Self::Position,
            3 => Self::SmoothPosition,
            4 => Self::Velocity,
            _ => Self::Coast,
        }
    }

    /// Returns whether the motor is driven in this mode.
    pub(crate) const fn is_driven(self) -> bool {
        matches!(self, Self::Position | Self::SmoothPosition | Self::Velocity)
    }
}

/// Returns the register table of a board with factory settings.
pub(crate) fn table(board: &BoardConfig) -> Result<RegisterTable, SbcpError> {
    let mut registers = vec![Register::u16(SMOOTH_POSITION_UPDATE, 2).within(2, 1_000)];
    for motor in 0..2 {
        let at = |register: MotorRegister, initial| Register::u16(register.address(motor), initial);
        let limit = board.position_limits[motor];
        // Velocity mode is for motors with continuous rotation; its speeds use the whole word.
        let (mode_max, goal_max) = if limit & CONTINUOUS == 0 {
            (Mode::SmoothPosition, POSITION_MASK)
        } else {
            (Mode::Velocity, u16::MAX)
        };
        registers.extend([
            at(MotorRegister::Mode, Mode::Coast as u16).within(0, mode_max as u16),
            at(MotorRegister::GoalPosition, 0).within(0, goal_max),
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
    registers.extend((0..3).map(|n| Register::u16(MAGNETIC + n, 0).read_only()));
    registers.extend((0..3).map(|n| Register::u16(FORCE + n, 0).read_only()));
    RegisterTable::new(board.id, DEVICE_VERSION, &registers)
}

/// Places of the registers that a board writes in every tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Measured {
    pub(crate) positions: [RegisterPlace; 2],
    pub(crate) magnetic: [RegisterPlace; 3],
    pub(crate) force: [RegisterPlace; 3],
}

impl Measured {
    /// Returns the places in a table of [`table`].
    pub(crate) fn in_table(registers: &RegisterTable) -> Self {
        let place = |address| {
            let place = registers.place(address);
            place.expect("the table has every register that a board writes")
        };
        let three = |first| [0, 1, 2].map(|n| place(first + n));
        Self {
            positions: [0, 1].map(|motor| place(MotorRegister::PresentPosition.address(motor))),
            magnetic: three(MAGNETIC),
            force: three(FORCE),
        }
    }
}

#[cfg(test)]
mod tests {
    use twinrig_sbcp::Access;

    use super::*;

    const MODES: [Mode; 5] = [
        Mode::Coast,
        Mode::Calibrate,
        Mode::Position,
        Mode::SmoothPosition,
        Mode::Velocity,
    ];

    fn page() -> String {
        let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/sbcp.md");
        std::fs::read_to_string(page).unwrap()
    }

    /// Cells of a row of a table in Markdown, without spaces around them.
    fn cells(row: &str) -> Vec<&str> {
        let row = row.trim().trim_matches('|');
        row.split('|').map(str::trim).collect()
    }

    #[test]
    fn page_has_every_register() {
        let page = page();
        let rows = page.split("<!-- registers -->").nth(1).unwrap();
        let rows = rows.split("<!-- end -->").next().unwrap();
        // Address, bytes, access, values, and value at power-on.
        let found: Vec<[String; 5]> = rows
            .lines()
            .filter(|row| row.starts_with("| `0x"))
            .map(|row| [0, 2, 3, 4, 5].map(|n| cells(row)[n].to_owned()))
            .collect();
        let table = table(&BoardConfig::default()).unwrap();
        let expected: Vec<[String; 5]> = table
            .registers()
            .iter()
            .map(|register| {
                let writable = register.access == Access::ReadWrite;
                let kept = if register.non_volatile { " nv" } else { "" };
                [
                    format!("`{:#04X}`", register.address).replace("0X", "0x"),
                    register.width.bytes().to_string(),
                    format!("{}{kept}", if writable { "rw" } else { "r" }),
                    if writable {
                        format!("{} – {}", register.min, register.max)
                    } else {
                        String::new()
                    },
                    register.initial.to_string(),
                ]
            })
            .collect();
        assert_eq!(found, expected);
    }

    #[test]
    fn page_names_registers_and_modes() {
        use MotorRegister as R;
        let page = page();
        let registers = [
            R::Mode,
            R::GoalPosition,
            R::PresentPosition,
            R::PGain,
            R::IGain,
            R::DGain,
            R::Stiffness,
            R::Damping,
            R::Preload,
            R::MaxTorque,
            R::MaxSpeed,
            R::MaxAcceleration,
            R::PositionLimit,
        ];
        for (register, motor) in registers.iter().flat_map(|r| [(r, 0), (r, 1)]) {
            let address = register.address(motor);
            let row = format!("| `0x{address:02X}` | `{register:?}`, motor {motor} |");
            assert!(page.contains(&row), "{row}");
        }
        for mode in MODES {
            let row = format!("| `{mode:?}` | {} |", mode as u16);
            assert!(page.contains(&row), "{row}");
        }
        for (name, address) in [
            ("SmoothPositionUpdate`", SMOOTH_POSITION_UPDATE),
            ("Magnetic`, segment 1", MAGNETIC),
            ("Force`, x", FORCE),
        ] {
            let row = format!("| `0x{address:02X}` | `{name} |");
            assert!(page.contains(&row), "{row}");
        }
    }

    #[test]
    fn mode_is_decoded_independently_of_flags() {
        for mode in MODES {
            assert_eq!(Mode::from_register(mode as u16 | RUNTIME_CALIBRATED), mode);
        }
        assert_eq!(Mode::from_register(0x00AA), Mode::Coast);
    }

    #[test]
    fn register_addresses_are_distinct() {
        let table = table(&BoardConfig::default()).unwrap();
        assert_eq!(
            table.get(MotorRegister::PositionLimit.address(1)),
            Some(1_350)
        );
        assert_eq!(table.registers().len(), 3 + 1 + 2 * 13 + 6);
    }
}
