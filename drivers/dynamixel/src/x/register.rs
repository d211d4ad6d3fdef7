//! Addresses of registers that all servos of the series have.

/// Drive mode; bit 0 reverses the direction.
pub const DRIVE_MODE: u16 = 10;
/// Operating mode.
pub const OPERATING_MODE: u16 = 11;
/// Offset of positions.
pub const HOMING_OFFSET: u16 = 20;
/// Velocity from which on the shaft moves.
pub const MOVING_THRESHOLD: u16 = 24;
/// Greatest temperature.
pub const TEMPERATURE_LIMIT: u16 = 31;
/// Greatest voltage of the supply.
pub const MAX_VOLTAGE_LIMIT: u16 = 32;
/// Least voltage of the supply.
pub const MIN_VOLTAGE_LIMIT: u16 = 34;
/// Greatest duty cycle.
pub const PWM_LIMIT: u16 = 36;
/// Greatest current.
pub const CURRENT_LIMIT: u16 = 38;
/// Greatest velocity.
pub const VELOCITY_LIMIT: u16 = 44;
/// Greatest position.
pub const MAX_POSITION_LIMIT: u16 = 48;
/// Least position.
pub const MIN_POSITION_LIMIT: u16 = 52;
/// Slope of the duty cycle.
pub const PWM_SLOPE: u16 = 62;
/// Hardware errors that turn the torque off.
pub const SHUTDOWN: u16 = 63;
/// Torque on or off.
pub const TORQUE_ENABLE: u16 = 64;
/// Hardware errors since the start.
pub const HARDWARE_ERROR_STATUS: u16 = 70;
/// Integral gain of the velocity controller.
pub const VELOCITY_I_GAIN: u16 = 76;
/// Proportional gain of the velocity controller.
pub const VELOCITY_P_GAIN: u16 = 78;
/// Derivative gain of the position controller.
pub const POSITION_D_GAIN: u16 = 80;
/// Integral gain of the position controller.
pub const POSITION_I_GAIN: u16 = 82;
/// Proportional gain of the position controller.
pub const POSITION_P_GAIN: u16 = 84;
/// Gain of the acceleration of the profile.
pub const FEEDFORWARD_2ND_GAIN: u16 = 88;
/// Gain of the velocity of the profile.
pub const FEEDFORWARD_1ST_GAIN: u16 = 90;
/// Silence of the bus after which the servo stops.
pub const BUS_WATCHDOG: u16 = 98;
/// Goal of the duty cycle, or its limit.
pub const GOAL_PWM: u16 = 100;
/// Goal of the current, or its limit.
pub const GOAL_CURRENT: u16 = 102;
/// Goal of the velocity.
pub const GOAL_VELOCITY: u16 = 104;
/// Acceleration of the profile.
pub const PROFILE_ACCELERATION: u16 = 108;
/// Velocity of the profile.
pub const PROFILE_VELOCITY: u16 = 112;
/// Goal of the position.
pub const GOAL_POSITION: u16 = 116;
/// Time since the start.
pub const REALTIME_TICK: u16 = 120;
/// Whether the shaft moves.
pub const MOVING: u16 = 122;
/// Duty cycle of the bridge.
pub const PRESENT_PWM: u16 = 124;
/// Current of the motor.
pub const PRESENT_CURRENT: u16 = 126;
/// Velocity of the shaft.
pub const PRESENT_VELOCITY: u16 = 128;
/// Position of the shaft.
pub const PRESENT_POSITION: u16 = 132;
/// Velocity of the profile.
pub const VELOCITY_TRAJECTORY: u16 = 136;
/// Set-point of the profile.
pub const POSITION_TRAJECTORY: u16 = 140;
/// Voltage of the supply.
pub const PRESENT_INPUT_VOLTAGE: u16 = 144;
/// Temperature.
pub const PRESENT_TEMPERATURE: u16 = 146;
