use twinrig_dynamixel::{
    BaudRates, Bounds, CommonRegisters, Derived, EepromLock, Errors, Instruction, PositionScale,
    ProtocolVersion, Register, ReturnDelay, ServoKind, ServoModel, registers,
};
use twinrig_kernel::SimDuration;

use crate::firmware::{FeetechFirmware, STS};
use crate::register as r;

/// STS3215, by the table in the vendor's manual of the series (doc.feetech.cn, "SMS/STS memory
/// table"), with names as in `lerobot` 0.4. Lines with another source say so.
pub static STS3215: ServoKind = ServoKind {
    model: &MODEL,
    firmware: || Box::new(FeetechFirmware::sts()),
    voltage: 12.0,
};

static MODEL: ServoModel = ServoModel {
    name: "STS3215",
    protocol: ProtocolVersion::One,
    items: ITEMS,
    indirect: &[],
    errors: Errors::Hardware,
    roles: CommonRegisters {
        model: 3,
        firmware: 0,
        id: 5,
        baud_rate: 6,
        // The least value of the register in the series. ASSUMED for a servo on which it has no
        // effect.
        return_delay: ReturnDelay::Fixed(SimDuration::from_micros(100)),
        status_level: 8,
        status_offset: 1,
        torque: r::TORQUE_ENABLE,
        lock: EepromLock::Volatile(r::LOCK),
        registered: Some(64),
        hardware_error: Some(r::STATUS),
        moving: r::MOVING,
        watchdog: None,
    },
    position: PositionScale {
        goal: r::GOAL_POSITION,
        present: r::PRESENT_POSITION,
        counts_per_turn: STS.counts,
        centre: STS.centre,
        greatest: 4_095,
    },
    derived: &[Derived {
        register: r::TORQUE_LIMIT,
        from: Some(r::MAX_TORQUE_LIMIT),
        at_start: true,
        by_write: None,
    }],
    // The vendor's library has neither (`feetech-servo-sdk` 1.0).
    lacks: &[Instruction::BULK_READ, Instruction::BULK_WRITE],
    is_strict: false,
    baud_rates: BaudRates::Listed(&[
        1_000_000, 500_000, 250_000, 128_000, 115_200, 76_800, 57_600, 38_400,
    ]),
};

const LEROBOT: &str = "lerobot 0.4, motors/feetech/tables.py";
const LOGS: &str = "logs of kscalelabs/sysid (benches/sts3215.toml)";
const BYTE: Bounds = Bounds::Between(0, 254);
const SIGNED: Bounds = Bounds::Between(-32_767, 32_767);

const ITEMS: &[Register] = registers(&[
    Register::read_only(0, 1, "firmware_major_version").assumed(3),
    Register::read_only(1, 1, "firmware_minor_version").assumed(10),
    Register::read_only(3, 2, "model_number")
        .of(777)
        .from(LEROBOT),
    Register::eeprom(5, 1, "id", 1, 0, 253),
    Register::eeprom(6, 1, "baud_rate", 0, 0, 7),
    Register::eeprom(7, 1, "return_delay_time", 0, 0, 253),
    Register::eeprom(8, 1, "response_status_level", 1, 0, 1),
    Register::eeprom(9, 2, "min_position_limit", 0, 0, 4_094),
    Register::eeprom(11, 2, "max_position_limit", 4_095, 0, 4_095),
    Register::eeprom(13, 1, "max_temperature_limit", 70, 0, 100),
    // 14 V, for a servo of 12 V.
    Register::eeprom(14, 1, "max_voltage_limit", 140, 0, 254).assumed(140),
    Register::eeprom(15, 1, "min_voltage_limit", 40, 0, 254),
    Register::eeprom(16, 2, "max_torque_limit", 1_000, 0, 1_000),
    // Phase: velocities in counts/s; a speed of 0 is the greatest one; positions in one turn.
    Register::eeprom(18, 1, "phase", 12, 0, 254).assumed(12),
    Register::eeprom(19, 1, "unloading_condition", 44, 0, 254).assumed(44),
    Register::eeprom(20, 1, "led_alarm_condition", 47, 0, 254).assumed(47),
    Register::eeprom(21, 1, "p_coefficient", 32, 0, 254).assumed(32),
    Register::eeprom(22, 1, "d_coefficient", 32, 0, 254).assumed(32),
    Register::eeprom(23, 1, "i_coefficient", 0, 0, 254),
    // By the duty cycle at rest.
    Register::eeprom(24, 1, "minimum_startup_force", 16, 0, 254).from(LOGS),
    Register::eeprom(25, 1, "integral_limit", 0, 0, 254),
    Register::eeprom(26, 1, "cw_dead_zone", 1, 0, 16),
    Register::eeprom(27, 1, "ccw_dead_zone", 1, 0, 16),
    Register::eeprom(28, 2, "protection_current", 511, 0, 2_047),
    Register::eeprom(30, 1, "angular_resolution", 1, 1, 128),
    Register::eeprom(31, 2, "homing_offset", 0, -2_047, 2_047).with_sign_bit(11),
    Register::eeprom(33, 1, "operating_mode", 0, 0, 3),
    Register::eeprom(34, 1, "protective_torque", 20, 0, 254),
    Register::eeprom(35, 1, "protection_time", 200, 0, 254),
    Register::eeprom(36, 1, "overload_torque", 80, 0, 254),
    Register::eeprom(
        37,
        1,
        "velocity_closed_loop_p_proportional_coefficient",
        10,
        0,
        254,
    )
    .assumed(10),
    Register::eeprom(38, 1, "over_current_protection_time", 200, 0, 254),
    Register::eeprom(
        39,
        1,
        "velocity_closed_loop_i_integral_coefficient",
        10,
        0,
        254,
    )
    .assumed(10),
    Register::ram(40, 1, "torque_enable", 0, Bounds::Between(0, 128)),
    Register::ram(41, 1, "acceleration", 0, BYTE),
    Register::ram(42, 2, "goal_position", 0, SIGNED).with_sign_bit(15),
    Register::ram(44, 2, "goal_time", 0, Bounds::Between(-1_000, 1_000)).with_sign_bit(10),
    Register::ram(46, 2, "goal_velocity", 0, SIGNED).with_sign_bit(15),
    Register::ram(48, 2, "torque_limit", 1_000, Bounds::Between(0, 1_000)),
    Register::ram(55, 1, "lock", 1, Bounds::Between(0, 1)),
    Register::read_only(56, 2, "present_position").with_sign_bit(15),
    Register::read_only(58, 2, "present_velocity").with_sign_bit(15),
    // By its sign.
    Register::read_only(60, 2, "present_load")
        .with_sign_bit(10)
        .from(LOGS),
    Register::read_only(62, 1, "present_voltage"),
    Register::read_only(63, 1, "present_temperature"),
    Register::read_only(64, 1, "asynchronous_write"),
    Register::read_only(65, 1, "status"),
    Register::read_only(66, 1, "moving"),
    Register::read_only(69, 2, "present_current").with_sign_bit(15),
    Register::read_only(71, 2, "goal_position_2").with_sign_bit(15),
    Register::read_only(80, 1, "moving_velocity_threshold").assumed(10),
    Register::read_only(81, 1, "dts").assumed(0),
    Register::read_only(82, 1, "velocity_unit_factor").assumed(1),
    Register::read_only(83, 1, "hts").assumed(0),
    // 3250 counts/s: 65 of 0.732 rev/min.
    Register::read_only(84, 1, "maximum_velocity_limit")
        .of(65)
        .from(LOGS),
    Register::read_only(85, 1, "maximum_acceleration").assumed(0),
    Register::read_only(86, 1, "acceleration_multiplier").assumed(0),
]);
