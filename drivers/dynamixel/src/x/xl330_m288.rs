use super::firmware::{Scales, XFirmware};
use super::register as r;
use super::series::{DERIVED, GAIN, GOAL_POSITIONS, MODES, POSITION, ROLES};
use crate::codes::Errors;
use crate::firmware::ServoKind;
use crate::protocol::ProtocolVersion;
use crate::register::{Bounds, Register, registers};
use crate::table::{BaudRates, Indirect, ServoModel};

/// Units of the registers. The factor of the gains is that of the logs in benches/xl330.toml.
const SCALES: Scales = Scales {
    gain: 0.5,
    milliamperes: 1.0,
};

/// XL330-M288-T, by the table in the vendor's manual (emanual.robotis.com,
/// docs/en/dxl/x/xl330-m288, sections "Control Table of EEPROM Area" and "of RAM Area"). Lines with
/// another source say so.
pub static XL330_M288: ServoKind = ServoKind {
    model: &MODEL,
    firmware: || Box::new(XFirmware::new(SCALES)),
    voltage: 5.0,
};

static MODEL: ServoModel = ServoModel {
    name: "XL330-M288-T",
    protocol: ProtocolVersion::Two,
    items: ITEMS,
    indirect: &[Indirect {
        addresses: 168,
        data: 208,
        count: 20,
        targets: [64, 227],
    }],
    errors: Errors::Numbers,
    roles: ROLES,
    position: POSITION,
    derived: DERIVED,
    lacks: &[],
    is_strict: true,
    baud_rates: BaudRates::Listed(&[
        9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000,
    ]),
};

const ITEMS: &[Register] = registers(&[
    Register::read_only(0, 2, "model_number").of(1_200),
    Register::read_only(2, 4, "model_information").assumed(0),
    // The version that has fast sync read and the indirect registers at these addresses.
    Register::read_only(6, 1, "firmware_version").assumed(52),
    Register::eeprom(7, 1, "id", 1, 0, 252),
    Register::eeprom(8, 1, "baud_rate", 1, 0, 6),
    Register::eeprom(9, 1, "return_delay_time", 250, 0, 254),
    Register::eeprom(10, 1, "drive_mode", 0, 0, 13),
    Register::eeprom(11, 1, "operating_mode", 3, 0, 16).one_of(MODES),
    Register::eeprom(12, 1, "secondary(shadow)_id", 255, 0, 255),
    Register::eeprom(13, 1, "protocol_type", 2, 2, 22),
    Register::eeprom(20, 4, "homing_offset", 0, -1_044_479, 1_044_479),
    Register::eeprom(24, 4, "moving_threshold", 10, 0, 1_023),
    Register::eeprom(31, 1, "temperature_limit", 70, 0, 100),
    Register::eeprom(32, 2, "max_voltage_limit", 70, 31, 70),
    Register::eeprom(34, 2, "min_voltage_limit", 35, 31, 70),
    Register::eeprom(36, 2, "pwm_limit", 885, 0, 885),
    Register::eeprom(38, 2, "current_limit", 1_750, 0, 1_750),
    Register::eeprom(44, 4, "velocity_limit", 445, 0, 2_047),
    Register::eeprom(48, 4, "max_position_limit", 4_095, 0, 4_095),
    Register::eeprom(52, 4, "min_position_limit", 0, 0, 4_095),
    Register::eeprom(60, 1, "startup_configuration", 0, 0, 3),
    Register::eeprom(62, 1, "pwm_slope", 140, 1, 255),
    Register::eeprom(63, 1, "shutdown", 53, 0, 255),
    Register::ram(64, 1, "torque_enable", 0, Bounds::Between(0, 1)),
    Register::ram(65, 1, "led", 0, Bounds::Between(0, 1)),
    Register::ram(68, 1, "status_return_level", 2, Bounds::Between(0, 2)),
    Register::read_only(69, 1, "registered_instruction"),
    Register::read_only(70, 1, "hardware_error_status"),
    Register::ram(76, 2, "velocity_i_gain", 1_600, GAIN),
    Register::ram(78, 2, "velocity_p_gain", 180, GAIN),
    Register::ram(80, 2, "position_d_gain", 0, GAIN),
    Register::ram(82, 2, "position_i_gain", 0, GAIN),
    Register::ram(84, 2, "position_p_gain", 400, GAIN),
    Register::ram(88, 2, "feedforward_2nd_gain", 0, GAIN),
    Register::ram(90, 2, "feedforward_1st_gain", 0, GAIN),
    // −1 is set by the servo, without an instruction for too long.
    Register::ram(98, 1, "bus_watchdog", 0, Bounds::Between(0, 127)),
    Register::ram(100, 2, "goal_pwm", 885, Bounds::Limit(r::PWM_LIMIT)).assumed(885),
    Register::ram(
        102,
        2,
        "goal_current",
        1_750,
        Bounds::Limit(r::CURRENT_LIMIT),
    )
    .assumed(1_750),
    Register::ram(104, 4, "goal_velocity", 0, Bounds::Limit(r::VELOCITY_LIMIT)),
    Register::ram(
        108,
        4,
        "profile_acceleration",
        0,
        Bounds::Between(0, 32_767),
    ),
    Register::ram(112, 4, "profile_velocity", 0, Bounds::Between(0, 32_767)),
    Register::ram(116, 4, "goal_position", 0, GOAL_POSITIONS),
    Register::read_only(120, 2, "realtime_tick"),
    Register::read_only(122, 1, "moving"),
    Register::read_only(123, 1, "moving_status"),
    Register::read_only(124, 2, "present_pwm").signed(),
    Register::read_only(126, 2, "present_current").signed(),
    Register::read_only(128, 4, "present_velocity").signed(),
    Register::read_only(132, 4, "present_position").signed(),
    Register::read_only(136, 4, "velocity_trajectory").signed(),
    Register::read_only(140, 4, "position_trajectory").signed(),
    Register::read_only(144, 2, "present_input_voltage"),
    Register::read_only(146, 1, "present_temperature"),
    Register::read_only(147, 1, "backup_ready"),
]);
