use twinrig_dynamixel::{
    BaudRates, Bounds, CommonRegisters, EepromLock, Errors, Instruction, PositionScale,
    ProtocolVersion, Register, ReturnDelay, ServoKind, ServoModel, registers,
};
use twinrig_kernel::SimDuration;

use crate::firmware::{FeetechFirmware, SCS};
use crate::register as r;

/// SCS0009, by `rustypot` 1.13, `scs0009.rs`, with names as in `lerobot` 0.4. Lines with another
/// source say so. Numbers have the high byte first.
pub static SCS0009: ServoKind = ServoKind {
    model: &MODEL,
    firmware: || Box::new(FeetechFirmware::scs()),
    voltage: 6.0,
};

static MODEL: ServoModel = ServoModel {
    name: "SCS0009",
    protocol: ProtocolVersion::One,
    items: ITEMS,
    indirect: &[],
    errors: Errors::Hardware,
    roles: CommonRegisters {
        model: 3,
        firmware: 0,
        id: 5,
        baud_rate: 6,
        // As that of STS. ASSUMED: the manual of the series does not define the register.
        return_delay: ReturnDelay::Fixed(SimDuration::from_micros(100)),
        status_level: 8,
        status_offset: 1,
        torque: r::TORQUE_ENABLE,
        lock: EepromLock::Volatile(r::scs::LOCK),
        registered: Some(64),
        hardware_error: Some(r::STATUS),
        moving: r::MOVING,
        watchdog: None,
    },
    position: PositionScale {
        goal: r::GOAL_POSITION,
        present: r::PRESENT_POSITION,
        counts_per_turn: SCS.counts,
        centre: SCS.centre,
        greatest: 1_023,
    },
    derived: &[],
    // Neither `rustypot` nor `lerobot` has a sync read for the series.
    lacks: &[
        Instruction::SYNC_READ,
        Instruction::BULK_READ,
        Instruction::BULK_WRITE,
    ],
    is_strict: false,
    // The vendor's library, `SCSCL.h`.
    baud_rates: BaudRates::Listed(&[
        1_000_000, 500_000, 250_000, 128_000, 115_200, 76_800, 57_600, 38_400,
    ]),
};

const LEROBOT: &str = "lerobot 0.4, motors/feetech/tables.py";
/// "SCSCL memory table".
const SERIES: &str = "the vendor's manual of the series";
const SCS15: &str = "the vendor's manual of SCS15, V1.02";
const BYTE: Bounds = Bounds::Between(0, 254);
const POSITION: Bounds = Bounds::Between(0, 1_023);

const ITEMS: &[Register] = registers(&[
    Register::read_only(0, 1, "firmware_major_version").assumed(1),
    Register::read_only(1, 1, "firmware_minor_version").assumed(0),
    // The high byte is the first one.
    Register::read_only(2, 1, "end").of(1).from(SERIES),
    Register::read_only(3, 2, "model_number")
        .high_first()
        .of(1_284)
        .from(LEROBOT),
    Register::eeprom(5, 1, "id", 1, 0, 253),
    Register::eeprom(6, 1, "baud_rate", 0, 0, 7),
    Register::eeprom(7, 1, "return_delay_time", 0, 0, 253),
    Register::eeprom(8, 1, "response_status_level", 1, 0, 1).from(SERIES),
    Register::eeprom(9, 2, "min_position_limit", 20, 0, 1_023)
        .high_first()
        .from(SERIES),
    Register::eeprom(11, 2, "max_position_limit", 1_003, 0, 1_023)
        .high_first()
        .from(SERIES),
    Register::eeprom(13, 1, "max_temperature_limit", 80, 0, 100).from(SCS15),
    // 9 V, for a servo of 6 V.
    Register::eeprom(14, 1, "max_voltage_limit", 90, 0, 254).assumed(90),
    Register::eeprom(15, 1, "min_voltage_limit", 40, 0, 254).assumed(40),
    Register::eeprom(16, 2, "max_torque_limit", 1_000, 0, 1_000)
        .high_first()
        .assumed(1_000),
    // A speed of 0 is the greatest one.
    Register::eeprom(18, 1, "phase", 8, 0, 254).assumed(8),
    Register::eeprom(19, 1, "unloading_condition", 37, 0, 254).from(SCS15),
    Register::eeprom(20, 1, "led_alarm_condition", 37, 0, 254).from(SCS15),
    Register::eeprom(21, 1, "p_coefficient", 15, 0, 254).from(SCS15),
    Register::eeprom(22, 1, "d_coefficient", 0, 0, 254).from(SCS15),
    Register::eeprom(23, 1, "i_coefficient", 0, 0, 254).from(SCS15),
    Register::eeprom(24, 2, "minimum_startup_force", 0, 0, 1_000)
        .high_first()
        .from(SCS15),
    Register::eeprom(26, 1, "cw_dead_zone", 2, 0, 32).from(SCS15),
    Register::eeprom(27, 1, "ccw_dead_zone", 2, 0, 32).from(SCS15),
    Register::eeprom(37, 1, "protective_torque", 20, 0, 254).assumed(20),
    Register::eeprom(38, 1, "protection_time", 200, 0, 254).assumed(200),
    Register::eeprom(39, 1, "overload_torque", 80, 0, 254).assumed(80),
    Register::ram(40, 1, "torque_enable", 0, Bounds::Between(0, 1)),
    Register::ram(41, 1, "acceleration", 0, BYTE),
    Register::ram(42, 2, "goal_position", 0, POSITION).high_first(),
    Register::ram(44, 2, "running_time", 0, Bounds::Between(-1_023, 1_023))
        .high_first()
        .with_sign_bit(10),
    Register::ram(46, 2, "goal_velocity", 0, Bounds::Between(-32_767, 32_767))
        .high_first()
        .with_sign_bit(15),
    Register::ram(48, 1, "lock", 1, Bounds::Between(0, 1)),
    Register::read_only(56, 2, "present_position").high_first(),
    Register::read_only(58, 2, "present_velocity")
        .high_first()
        .with_sign_bit(15),
    Register::read_only(60, 2, "present_load")
        .high_first()
        .with_sign_bit(10),
    Register::read_only(62, 1, "present_voltage"),
    Register::read_only(63, 1, "present_temperature"),
    Register::read_only(64, 1, "sync_write_flag"),
    Register::read_only(65, 1, "status"),
    Register::read_only(66, 1, "moving"),
    Register::read_only(78, 1, "pwm_maximum_step").assumed(0),
    // 50 counts/s.
    Register::read_only(79, 1, "moving_velocity_threshold").assumed(1),
    Register::read_only(80, 1, "dts").assumed(0),
    Register::read_only(81, 1, "minimum_velocity_limit").assumed(0),
    // 2000 counts/s, 98 rev/min.
    Register::read_only(82, 1, "maximum_velocity_limit").assumed(40),
]);
