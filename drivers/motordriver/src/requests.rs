//! Register transfers of a session, as sequences of steps.

use crate::config::SessionConfig;
use crate::registers::{FORCE, MAGNETIC, MotorRegister, SMOOTH_POSITION_UPDATE};

/// A single request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Job {
    Ping,
    Get(u8),
    Set(u8, u16),
}

/// Registers written per motor.
const SETTINGS: usize = 9;

/// Returns the request of a configuration step of a board with one motor or two: register writes,
/// then reads, before calibration.
pub(crate) fn configuration(config: &SessionConfig, motors: usize, step: usize) -> Option<Job> {
    let gains = &config.gains;
    let (motor, setting) = (step / SETTINGS, step % SETTINGS);
    let last = motors * SETTINGS;
    let (register, value) = match setting {
        _ if step == last => return Some(Job::Set(SMOOTH_POSITION_UPDATE, ticks(config))),
        _ if step > last => {
            let read = step - last - 1;
            let register = match read / motors {
                0 => MotorRegister::PositionLimit,
                1 => MotorRegister::Mode,
                _ => return None,
            };
            return Some(Job::Get(register.address(read % motors)));
        }
        0 => (MotorRegister::PGain, gains.p),
        1 => (MotorRegister::IGain, gains.i),
        2 => (MotorRegister::DGain, gains.d),
        3 => (MotorRegister::Stiffness, gains.stiffness),
        4 => (MotorRegister::Damping, gains.damping),
        5 => (MotorRegister::Preload, gains.preload),
        6 => (MotorRegister::MaxTorque, gains.max_torque),
        7 => (MotorRegister::MaxSpeed, gains.max_speed),
        _ => (MotorRegister::MaxAcceleration, gains.max_acceleration),
    };
    Some(Job::Set(register.address(motor), value))
}

/// Returns the interpolation period of the boards \[ms\].
fn ticks(config: &SessionConfig) -> u16 {
    let millis = (config.period.as_nanos() + 500_000) / 1_000_000;
    u16::try_from(millis.clamp(2, 1_000)).unwrap_or(1_000)
}

/// Returns the register of a sensor, in the order of a cycle's reply.
pub(crate) fn sensor(step: usize) -> Option<u8> {
    let register = match step {
        0 | 1 => MotorRegister::PresentPosition.address(step),
        2 => MAGNETIC,
        3 => MAGNETIC + 1,
        4 => MAGNETIC + 2,
        5 => FORCE,
        6 => FORCE + 1,
        7 => FORCE + 2,
        _ => return None,
    };
    Some(register)
}
