//! Addresses of registers that all servos of the series have.

/// Drive mode; bit 0 reverses the direction.
pub const DRIVE_MODE: u16 = 10;
/// Operating mode.
pub const OPERATING_MODE: u16 = 11;
/// Offset of positions \[counts\].
pub const HOMING_OFFSET: u16 = 20;
/// Velocity from which on the shaft moves \[0.229 rev/min\].
pub const MOVING_THRESHOLD: u16 = 24;
/// Greatest temperature \[°C\].
pub const TEMPERATURE_LIMIT: u16 = 31;
/// Greatest voltage of the supply \[0.1 V\].
pub const MAX_VOLTAGE_LIMIT: u16 = 32;
/// Least voltage of the supply \[0.1 V\].
pub const MIN_VOLTAGE_LIMIT: u16 = 34;
/// Greatest duty cycle, 885 for 100 %.
pub const PWM_LIMIT: u16 = 36;
/// Greatest current \[mA\].
pub const CURRENT_LIMIT: u16 = 38;
/// Greatest velocity \[0.229 rev/min\].
pub const VELOCITY_LIMIT: u16 = 44;
/// Greatest position \[counts\].
pub const MAX_POSITION_LIMIT: u16 = 48;
/// Least position \[counts\].
pub const MIN_POSITION_LIMIT: u16 = 52;
/// Slope of the duty cycle \[1.977 V/s\].
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
/// Silence of the bus after which the servo stops \[20 ms\].
pub const BUS_WATCHDOG: u16 = 98;
/// Goal of the duty cycle, or its limit, 885 for 100 %.
pub const GOAL_PWM: u16 = 100;
/// Goal of the current, or its limit \[mA\].
pub const GOAL_CURRENT: u16 = 102;
/// Goal of the velocity \[0.229 rev/min\].
pub const GOAL_VELOCITY: u16 = 104;
/// Acceleration of the profile \[214.577 rev/min²\].
pub const PROFILE_ACCELERATION: u16 = 108;
/// Velocity of the profile \[0.229 rev/min\].
pub const PROFILE_VELOCITY: u16 = 112;
/// Goal of the position \[counts\].
pub const GOAL_POSITION: u16 = 116;
/// Time since the start \[ms\], modulo 32 768.
pub const REALTIME_TICK: u16 = 120;
/// Whether the shaft moves.
pub const MOVING: u16 = 122;
/// Duty cycle of the bridge, 885 for 100 %.
pub const PRESENT_PWM: u16 = 124;
/// Current of the motor \[mA\].
pub const PRESENT_CURRENT: u16 = 126;
/// Velocity of the shaft \[0.229 rev/min\].
pub const PRESENT_VELOCITY: u16 = 128;
/// Position of the shaft \[counts\].
pub const PRESENT_POSITION: u16 = 132;
/// Velocity of the profile \[0.229 rev/min\].
pub const VELOCITY_TRAJECTORY: u16 = 136;
/// Set-point of the profile \[counts\].
pub const POSITION_TRAJECTORY: u16 = 140;
/// Voltage of the supply \[0.1 V\].
pub const PRESENT_INPUT_VOLTAGE: u16 = 144;
/// Temperature \[°C\].
pub const PRESENT_TEMPERATURE: u16 = 146;
