//! Addresses of registers.

/// Least goal of the position \[counts\].
pub const CW_ANGLE_LIMIT: u16 = 6;
/// Greatest goal of the position \[counts\]; 0 of both for turning without an end.
pub const CCW_ANGLE_LIMIT: u16 = 8;
/// Greatest temperature \[°C\].
pub const TEMPERATURE_LIMIT: u16 = 11;
/// Least voltage of the supply \[0.1 V\].
pub const MIN_VOLTAGE_LIMIT: u16 = 12;
/// Greatest voltage of the supply \[0.1 V\].
pub const MAX_VOLTAGE_LIMIT: u16 = 13;
/// Torque limit after a restart \[1/1023\].
pub const MAX_TORQUE: u16 = 14;
/// Hardware errors that set the torque limit to 0.
pub const SHUTDOWN: u16 = 18;
/// Torque on or off.
pub const TORQUE_ENABLE: u16 = 24;
/// Dead zone for negative errors \[counts\].
pub const CW_COMPLIANCE_MARGIN: u16 = 26;
/// Dead zone for positive errors \[counts\].
pub const CCW_COMPLIANCE_MARGIN: u16 = 27;
/// Width of the proportional range for negative errors \[counts\].
pub const CW_COMPLIANCE_SLOPE: u16 = 28;
/// Width of the proportional range for positive errors \[counts\].
pub const CCW_COMPLIANCE_SLOPE: u16 = 29;
/// Goal of the position \[counts\].
pub const GOAL_POSITION: u16 = 30;
/// Speed of the set-point \[0.111 rev/min\], 0 for no limit; without an end the duty cycle
/// \[1/1023\].
pub const MOVING_SPEED: u16 = 32;
/// Greatest duty cycle \[1/1023\].
pub const TORQUE_LIMIT: u16 = 34;
/// Position of the shaft \[counts\].
pub const PRESENT_POSITION: u16 = 36;
/// Speed of the shaft \[0.111 rev/min\]; without an end the duty cycle \[1/1023\].
pub const PRESENT_SPEED: u16 = 38;
/// Duty cycle of the bridge \[1/1023\].
pub const PRESENT_LOAD: u16 = 40;
/// Voltage of the supply \[0.1 V\].
pub const PRESENT_VOLTAGE: u16 = 42;
/// Temperature \[°C\].
pub const PRESENT_TEMPERATURE: u16 = 43;
/// Whether a write waits for an action.
pub const REGISTERED: u16 = 44;
/// Whether the goal is not reached yet.
pub const MOVING: u16 = 46;
/// Whether the EEPROM is locked until a restart.
pub const LOCK: u16 = 47;
/// Duty cycle at the end of the dead zone \[1/1023\].
pub const PUNCH: u16 = 48;
