//! Addresses of registers of the STS series, and of those of the SCS series that differ.

/// Least goal of the position \[counts\].
pub const MIN_POSITION_LIMIT: u16 = 9;
/// Greatest goal of the position \[counts\].
pub const MAX_POSITION_LIMIT: u16 = 11;
/// Greatest temperature \[°C\].
pub const MAX_TEMPERATURE_LIMIT: u16 = 13;
/// Greatest voltage of the supply \[0.1 V\].
pub const MAX_VOLTAGE_LIMIT: u16 = 14;
/// Least voltage of the supply \[0.1 V\].
pub const MIN_VOLTAGE_LIMIT: u16 = 15;
/// Torque limit after a restart \[0.1 %\].
pub const MAX_TORQUE_LIMIT: u16 = 16;
/// Options: bits of the direction, of units, and whether positions count turns.
pub const PHASE: u16 = 18;
/// Hardware errors that release the motor.
pub const UNLOADING_CONDITION: u16 = 19;
/// Proportional gain of the position.
pub const P_COEFFICIENT: u16 = 21;
/// Duty cycle at the end of the dead zone \[0.1 %\].
pub const MINIMUM_STARTUP_FORCE: u16 = 24;
/// Dead zone for negative errors \[counts\].
pub const CW_DEAD_ZONE: u16 = 26;
/// Dead zone for positive errors \[counts\].
pub const CCW_DEAD_ZONE: u16 = 27;
/// Offset of positions \[counts\].
pub const HOMING_OFFSET: u16 = 31;
/// Operating mode.
pub const OPERATING_MODE: u16 = 33;
/// Torque limit after an overload \[1 %\].
pub const PROTECTIVE_TORQUE: u16 = 34;
/// Time of an overload \[10 ms\].
pub const PROTECTION_TIME: u16 = 35;
/// Duty cycle of an overload \[1 %\].
pub const OVERLOAD_TORQUE: u16 = 36;
/// Torque on or off; 128 makes the position the middle.
pub const TORQUE_ENABLE: u16 = 40;
/// Acceleration of the set-point \[100 counts/s²\].
pub const ACCELERATION: u16 = 41;
/// Goal of the position \[counts\].
pub const GOAL_POSITION: u16 = 42;
/// Goal of the duty cycle in PWM mode \[0.1 %\].
pub const GOAL_TIME: u16 = 44;
/// Greatest speed of the set-point, or the goal of the speed \[counts/s\].
pub const GOAL_VELOCITY: u16 = 46;
/// Greatest duty cycle \[0.1 %\].
pub const TORQUE_LIMIT: u16 = 48;
/// Whether writes to the EEPROM are lost at a restart.
pub const LOCK: u16 = 55;
/// Position of the shaft \[counts\].
pub const PRESENT_POSITION: u16 = 56;
/// Speed of the shaft \[counts/s\].
pub const PRESENT_VELOCITY: u16 = 58;
/// Duty cycle of the bridge, with the opposite sign \[0.1 %\].
pub const PRESENT_LOAD: u16 = 60;
/// Voltage of the supply \[0.1 V\].
pub const PRESENT_VOLTAGE: u16 = 62;
/// Temperature \[°C\].
pub const PRESENT_TEMPERATURE: u16 = 63;
/// Hardware errors.
pub const STATUS: u16 = 65;
/// Whether the shaft moves.
pub const MOVING: u16 = 66;
/// Current of the motor \[6.5 mA\].
pub const PRESENT_CURRENT: u16 = 69;
/// Set-point \[counts\].
pub const GOAL_POSITION_2: u16 = 71;
/// Speed from which on the shaft moves \[counts/s\].
pub const MOVING_VELOCITY_THRESHOLD: u16 = 80;
/// Greatest speed of the set-point \[0.732 rev/min\].
pub const MAXIMUM_VELOCITY_LIMIT: u16 = 84;

/// Registers of the SCS series at other addresses than in the STS series.
pub mod scs {
    /// Torque limit after an overload \[1 %\].
    pub const PROTECTIVE_TORQUE: u16 = 37;
    /// Time of an overload \[10 ms\].
    pub const PROTECTION_TIME: u16 = 38;
    /// Duty cycle of an overload \[1 %\].
    pub const OVERLOAD_TORQUE: u16 = 39;
    /// Whether writes to the EEPROM are lost at a restart.
    pub const LOCK: u16 = 48;
    /// Speed from which on the shaft moves \[50 counts/s\].
    pub const MOVING_VELOCITY_THRESHOLD: u16 = 79;
    /// Greatest speed of the set-point \[50 counts/s\].
    pub const MAXIMUM_VELOCITY_LIMIT: u16 = 82;
}
