//! Data that the tables of all models share.

use super::firmware::{CENTRE, COUNTS};
use super::register as r;
use crate::register::Bounds;
use crate::table::{CommonRegisters, Derived, EepromLock, PositionScale, ReturnDelay};

/// Position control, the operating mode in which the limits of the position hold.
const POSITION_CONTROL: i32 = 3;
/// Greatest goal of the position in other modes: 256 turns.
const TURNS: i32 = 1_048_575;
/// Operating modes: current, velocity, position, extended position, current-based position, PWM.
pub(super) const MODES: &[i32] = &[0, 1, 3, 4, 5, 16];
/// Bounds of all gains.
pub(super) const GAIN: Bounds = Bounds::Between(0, 16_383);

/// Bounds of the goal of the position.
pub(super) const GOAL_POSITIONS: Bounds = Bounds::Positions {
    limits: [r::MIN_POSITION_LIMIT, r::MAX_POSITION_LIMIT],
    mode: r::OPERATING_MODE,
    in_mode: POSITION_CONTROL,
    otherwise: TURNS,
};

/// Registers of the communication.
pub(super) const ROLES: CommonRegisters = CommonRegisters {
    model: 0,
    firmware: 6,
    id: 7,
    baud_rate: 8,
    return_delay: ReturnDelay::Register(9),
    status_level: 68,
    status_offset: 0,
    torque: r::TORQUE_ENABLE,
    lock: EepromLock::Torque,
    registered: Some(69),
    hardware_error: Some(r::HARDWARE_ERROR_STATUS),
    moving: r::MOVING,
    watchdog: Some((
        r::BUS_WATCHDOG,
        &[
            r::GOAL_PWM,
            r::GOAL_CURRENT,
            r::GOAL_VELOCITY,
            r::GOAL_POSITION,
        ],
    )),
};

/// Registers of the position.
pub(super) const POSITION: PositionScale = PositionScale {
    goal: r::GOAL_POSITION,
    present: r::PRESENT_POSITION,
    counts_per_turn: COUNTS,
    centre: CENTRE,
    greatest: 4_095,
};

/// Another operating mode has the initial gains, no profile, and duty cycle and current at their
/// limits (manual, note on the operating mode).
pub(super) const DERIVED: &[Derived] = &[
    limit(r::GOAL_PWM, r::PWM_LIMIT),
    limit(r::GOAL_CURRENT, r::CURRENT_LIMIT),
    initial(r::VELOCITY_I_GAIN),
    initial(r::VELOCITY_P_GAIN),
    initial(r::POSITION_D_GAIN),
    initial(r::POSITION_I_GAIN),
    initial(r::POSITION_P_GAIN),
    initial(r::FEEDFORWARD_2ND_GAIN),
    initial(r::FEEDFORWARD_1ST_GAIN),
    initial(r::PROFILE_ACCELERATION),
    initial(r::PROFILE_VELOCITY),
];

const fn limit(register: u16, from: u16) -> Derived {
    Derived {
        register,
        from: Some(from),
        at_start: true,
        by_write: Some(r::OPERATING_MODE),
    }
}

const fn initial(register: u16) -> Derived {
    Derived {
        register,
        from: None,
        at_start: false,
        by_write: Some(r::OPERATING_MODE),
    }
}
