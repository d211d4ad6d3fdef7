use super::firmware::{AxFirmware, CENTRE, COUNTS, GREATEST};
use super::register as r;
use crate::codes::{Errors, Instruction};
use crate::firmware::ServoKind;
use crate::protocol::ProtocolVersion;
use crate::register::{Bounds, Register, registers};
use crate::table::{
    BaudRates, CommonRegisters, Derived, EepromLock, PositionScale, ReturnDelay, ServoModel,
};

/// AX-12A, by the table in the vendor's manual (emanual.robotis.com, docs/en/dxl/ax/ax-12a) and the
/// ranges in its sections. Lines with another source say so.
pub static AX12A: ServoKind = ServoKind {
    model: &MODEL,
    firmware: || Box::new(AxFirmware::default()),
    voltage: 12.0,
};

static MODEL: ServoModel = ServoModel {
    name: "AX-12A",
    protocol: ProtocolVersion::One,
    items: ITEMS,
    indirect: &[],
    errors: Errors::Bits,
    roles: CommonRegisters {
        model: 0,
        firmware: 2,
        id: 3,
        baud_rate: 4,
        return_delay: ReturnDelay::Register(5),
        status_level: 16,
        status_offset: 0,
        torque: r::TORQUE_ENABLE,
        lock: EepromLock::UntilRestart(r::LOCK),
        registered: Some(r::REGISTERED),
        hardware_error: None,
        moving: r::MOVING,
        watchdog: None,
    },
    position: PositionScale {
        goal: r::GOAL_POSITION,
        present: r::PRESENT_POSITION,
        counts_per_turn: COUNTS,
        centre: CENTRE,
        greatest: GREATEST,
    },
    derived: &[Derived {
        register: r::TORQUE_LIMIT,
        from: Some(r::MAX_TORQUE),
        at_start: true,
        by_write: None,
    }],
    lacks: &[
        Instruction::SYNC_READ,
        Instruction::BULK_READ,
        Instruction::REBOOT,
    ],
    is_strict: true,
    baud_rates: BaudRates::Divided(2_000_000),
};

const BYTE: Bounds = Bounds::Between(0, 254);
const MARGIN: Bounds = Bounds::Between(0, 255);
const TORQUE: Bounds = Bounds::Between(0, 1_023);
const SPEED: Bounds = Bounds::Between(-1_023, 1_023);

const ITEMS: &[Register] = registers(&[
    Register::read_only(0, 2, "model_number").of(12),
    Register::read_only(2, 1, "firmware_version").assumed(24),
    Register::eeprom(3, 1, "id", 1, 0, 253),
    Register::eeprom(4, 1, "baud_rate", 1, 0, 254),
    Register::eeprom(5, 1, "return_delay_time", 250, 0, 254),
    Register::eeprom(6, 2, "cw_angle_limit", 0, 0, 1_023),
    Register::eeprom(8, 2, "ccw_angle_limit", 1_023, 0, 1_023),
    Register::eeprom(11, 1, "temperature_limit", 70, 0, 100),
    // The bounds of both are ASSUMED.
    Register::eeprom(12, 1, "min_voltage_limit", 60, 50, 160),
    Register::eeprom(13, 1, "max_voltage_limit", 140, 50, 160),
    Register::eeprom(14, 2, "max_torque", 1_023, 0, 1_023),
    Register::eeprom(16, 1, "status_return_level", 2, 0, 2),
    Register::eeprom(17, 1, "alarm_led", 36, 0, 127),
    Register::eeprom(18, 1, "shutdown", 36, 0, 127),
    Register::ram(24, 1, "torque_enable", 0, Bounds::Between(0, 1)),
    Register::ram(25, 1, "led", 0, Bounds::Between(0, 1)),
    // The bounds of both are ASSUMED.
    Register::ram(26, 1, "cw_compliance_margin", 1, MARGIN),
    Register::ram(27, 1, "ccw_compliance_margin", 1, MARGIN),
    Register::ram(28, 1, "cw_compliance_slope", 32, BYTE),
    Register::ram(29, 1, "ccw_compliance_slope", 32, BYTE),
    Register::ram(30, 2, "goal_position", 0, GOAL_POSITIONS).unsigned(),
    Register::ram(32, 2, "moving_speed", 0, SPEED)
        .with_sign_bit(10)
        .assumed(0),
    Register::ram(34, 2, "torque_limit", 1_023, TORQUE),
    Register::read_only(36, 2, "present_position"),
    Register::read_only(38, 2, "present_speed").with_sign_bit(10),
    Register::read_only(40, 2, "present_load").with_sign_bit(10),
    Register::read_only(42, 1, "present_voltage"),
    Register::read_only(43, 1, "present_temperature"),
    Register::read_only(44, 1, "registered"),
    Register::read_only(46, 1, "moving"),
    Register::ram(47, 1, "lock", 0, Bounds::Between(0, 1)),
    Register::ram(48, 2, "punch", 32, Bounds::Between(32, 1_023)),
]);

const GOAL_POSITIONS: Bounds = Bounds::AngleLimits {
    limits: [r::CW_ANGLE_LIMIT, r::CCW_ANGLE_LIMIT],
    greatest: GREATEST,
};
