use serde::{Deserialize, Serialize};

use crate::assumed::CALIBRATION_TICKS;
use crate::pid::{Gains, Pid};
use crate::registers::Mode;
use crate::units::{CONTINUOUS, LIMIT_MASK, POSITION_MASK};
use crate::velocity::Velocity;

/// Motor of a board as the firmware sees it.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct Motor {
    pub(crate) mode: Mode,
    pub(crate) calibrated: bool,
    /// Ticks until the end of calibration.
    pub(crate) calibrating: u32,
    /// The motor is activated in the next tick, at its position then.
    pub(crate) start_pending: bool,
    pub(crate) gains: Gains,
    /// Maximum set-point \[counts\].
    pub(crate) limit: u16,
    /// Whether the motor rotates without limit, so that velocity mode is permitted.
    pub(crate) continuous: bool,
    /// Last set-point, if any.
    pub(crate) goal: Option<u16>,
    /// Position at the last activation \[counts\].
    pub(crate) start_position: i32,
    pub(crate) pid: Pid,
    pub(crate) velocity: Velocity,
}

impl Motor {
    pub(crate) fn new(limit: u16) -> Self {
        Self {
            mode: Mode::Coast,
            calibrated: false,
            calibrating: 0,
            start_pending: false,
            gains: Gains {
                p: 0,
                i: 0,
                d: 0,
                torque_max: 0,
            },
            limit: limit & LIMIT_MASK,
            continuous: limit & CONTINUOUS != 0,
            goal: None,
            start_position: 0,
            pid: Pid::default(),
            velocity: Velocity::default(),
        }
    }

    pub(crate) fn set_mode(&mut self, mode: Mode) {
        // An uncalibrated motor, whose position is unknown, is not driven, and a motor with a range
        // does not leave it.
        let refused = mode.is_driven() && !self.calibrated;
        self.mode = if refused || mode == Mode::Velocity && !self.continuous {
            Mode::Coast
        } else {
            mode
        };
        match self.mode {
            Mode::Calibrate => self.calibrating = CALIBRATION_TICKS,
            Mode::Position | Mode::SmoothPosition => {
                self.start_pending = true;
                self.goal = None;
            }
            Mode::Velocity => {
                self.start_pending = true;
                self.velocity.stop();
            }
            Mode::Coast => {}
        }
    }

    /// Receives the word of a set-point: a speed in velocity mode, otherwise a position.
    pub(crate) fn command(&mut self, word: u16) {
        if self.mode == Mode::Velocity {
            self.velocity.command(word);
        } else {
            self.goal = Some((word & POSITION_MASK).min(self.limit));
        }
    }

    /// Activates the motor at its present position.
    pub(crate) fn start(&mut self, position: i32) {
        self.start_pending = false;
        self.start_position = position;
        self.engage(position);
    }

    /// Starts the controllers at the present position.
    pub(crate) fn engage(&mut self, position: i32) {
        self.pid = Pid::resting_at(position);
        self.velocity.resume();
    }
}
