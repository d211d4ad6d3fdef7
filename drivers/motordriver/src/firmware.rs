use serde::{Deserialize, Serialize};

use crate::assumed::CALIBRATION_TICKS;
use crate::config::{FirmwareConfig, Interpolation};
use crate::pid::{Gains, Pid};
use crate::registers::{Mode, MotorRegister, RUNTIME_CALIBRATED, SMOOTH_POSITION_UPDATE};
use crate::smooth::{FRACTION_BITS, Interpolator, SmoothCounts};
use crate::units::LIMIT_MASK;
use crate::watchdog::Watchdog;

/// Firmware of a board, executed once per tick, without clock, bus and sensors.
///
/// Commands and register writes received since the last tick take effect in the next one.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Firmware {
    motors: [Motor; 2],
    smooth: Interpolator,
    watchdog: Watchdog,
    /// A command was received since the last tick.
    commanded: bool,
    /// The watchdog has dropped the motors.
    dropped: bool,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Motor {
    mode: Mode,
    calibrated: bool,
    /// Ticks until the end of calibration.
    calibrating: u32,
    /// The motor is activated in the next tick, at its position then.
    start_pending: bool,
    gains: Gains,
    /// Maximum set-point \[counts\].
    limit: u16,
    /// Last set-point, if any.
    goal: Option<u16>,
    /// Position at the last activation \[counts\].
    start_position: i32,
    pid: Pid,
}

impl Motor {
    fn new(limit: u16) -> Self {
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
            goal: None,
            start_position: 0,
            pid: Pid::default(),
        }
    }

    fn set_mode(&mut self, mode: Mode) {
        // An uncalibrated motor, whose position is unknown, is not driven.
        self.mode = if mode.is_driven() && !self.calibrated {
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
            Mode::Coast => {}
        }
    }

    /// Activates the motor at its present position.
    fn start(&mut self, position: i32) {
        self.start_pending = false;
        self.start_position = position;
        self.pid = Pid::resting_at(position);
    }
}

impl Firmware {
    pub(crate) fn new(config: FirmwareConfig, limits: [u16; 2]) -> Self {
        let heuristics = config.interpolation == Interpolation::Smooth;
        Self {
            motors: limits.map(Motor::new),
            smooth: Interpolator::new(2, heuristics),
            watchdog: Watchdog::default(),
            commanded: false,
            dropped: false,
        }
    }

    /// Receives set-points of both motors \[counts\], limited to their ranges.
    pub(crate) fn command(&mut self, goals: [u16; 2]) {
        self.commanded = true;
        for (motor, goal) in self.motors.iter_mut().zip(goals) {
            motor.goal = Some(goal.min(motor.limit));
        }
        if self
            .motors
            .iter()
            .any(|motor| motor.mode == Mode::SmoothPosition)
        {
            self.push_goals();
        }
    }

    fn push_goals(&mut self) {
        // A motor without a set-point keeps its position.
        let point = [0, 1].map(|n| match self.motors[n].goal {
            Some(goal) => i32::from(goal) << FRACTION_BITS,
            None => self.smooth.at()[n],
        });
        self.smooth.push(point);
    }

    /// Processes a register write of the master.
    pub(crate) fn written(&mut self, address: u8, value: u16) {
        if address == SMOOTH_POSITION_UPDATE {
            self.smooth.set_period(value);
            return;
        }
        for n in 0..2 {
            let is = |register: MotorRegister| address == register.address(n);
            let motor = &mut self.motors[n];
            if is(MotorRegister::Mode) {
                motor.set_mode(Mode::from_register(value));
            } else if is(MotorRegister::GoalPosition) {
                motor.goal = Some(value.min(motor.limit));
                self.commanded = true;
                if motor.mode == Mode::SmoothPosition {
                    self.push_goals();
                }
            } else if is(MotorRegister::PGain) {
                motor.gains.p = value;
            } else if is(MotorRegister::IGain) {
                motor.gains.i = value;
            } else if is(MotorRegister::DGain) {
                motor.gains.d = value;
            } else if is(MotorRegister::MaxTorque) {
                motor.gains.torque_max = value;
            } else if is(MotorRegister::MaxSpeed) {
                self.smooth.set_speed_max(n, value);
            } else if is(MotorRegister::PositionLimit) {
                motor.limit = value & LIMIT_MASK;
            }
        }
    }

    /// Returns the value of a motor's mode register.
    pub(crate) fn mode_register(&self, motor: usize) -> u16 {
        let Motor {
            mode, calibrated, ..
        } = self.motors[motor];
        mode as u16 | if calibrated { RUNTIME_CALIBRATED } else { 0 }
    }

    /// Returns whether a motor is being calibrated, so that its mode will change without a write.
    pub(crate) fn is_calibrating(&self) -> bool {
        self.motors
            .iter()
            .any(|motor| motor.mode == Mode::Calibrate)
    }

    pub(crate) fn smooth_counts(&self) -> SmoothCounts {
        self.smooth.counts()
    }

    pub(crate) fn watchdog_drops(&self) -> u64 {
        self.watchdog.drops()
    }

    /// Executes a tick for the positions \[counts\]. Returns the duties of the motors; `None` for
    /// an open bridge.
    pub(crate) fn tick(&mut self, positions: [i32; 2]) -> [Option<i32>; 2] {
        self.calibrate();
        if !self.motors.iter().any(|motor| motor.mode.is_driven()) {
            self.commanded = false;
            self.watchdog.feed();
            return [None; 2];
        }
        self.start(positions);
        self.update_watchdog(positions);
        if self.dropped {
            return [None; 2];
        }
        let smooth = self.smooth.tick();
        let mut duties = [None; 2];
        for (n, motor) in self.motors.iter_mut().enumerate() {
            let set_point = match motor.mode {
                Mode::Coast | Mode::Calibrate => continue,
                Mode::SmoothPosition => smooth[n],
                Mode::Position => {
                    motor.goal.map_or(motor.start_position, i32::from) << FRACTION_BITS
                }
            };
            duties[n] = Some(motor.pid.tick(motor.gains, set_point, positions[n]));
        }
        duties
    }

    fn calibrate(&mut self) {
        for motor in &mut self.motors {
            if motor.mode == Mode::Calibrate {
                motor.calibrating -= 1;
                if motor.calibrating == 0 {
                    motor.calibrated = true;
                    motor.mode = Mode::Coast;
                }
            }
        }
    }

    /// Activates the motors that were switched on.
    fn start(&mut self, positions: [i32; 2]) {
        let mut any = false;
        for (motor, position) in self.motors.iter_mut().zip(positions) {
            if motor.start_pending {
                motor.start(position);
                any = true;
            }
        }
        if any {
            self.smooth
                .rest_at(positions.map(|position| position << FRACTION_BITS));
            // A set-point may have been received after the mode was written.
            let has_goal = |motor: &Motor| motor.mode.is_driven() && motor.goal.is_some();
            if self.motors.iter().any(has_goal) {
                self.push_goals();
            }
            self.watchdog.feed();
            self.dropped = false;
        }
    }

    fn update_watchdog(&mut self, positions: [i32; 2]) {
        if !std::mem::take(&mut self.commanded) {
            if self.watchdog.count_silent_tick(self.smooth.period()) {
                self.dropped = true;
            }
            return;
        }
        self.watchdog.feed();
        if std::mem::take(&mut self.dropped) {
            // ASSUMED: the next command re-engages the motors at their present position.
            for (motor, position) in self.motors.iter_mut().zip(positions) {
                motor.pid = Pid::resting_at(position);
            }
            self.smooth
                .resume(positions.map(|position| position << FRACTION_BITS));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: [u16; 2] = [1_200, 1_350 + 0x8000];

    fn firmware() -> Firmware {
        let mut firmware = Firmware::new(FirmwareConfig::default(), LIMITS);
        for motor in 0..2 {
            firmware.written(MotorRegister::PGain.address(motor), 400);
            firmware.written(MotorRegister::MaxTorque.address(motor), 1_100);
            firmware.written(MotorRegister::MaxSpeed.address(motor), 32_000);
        }
        firmware
    }

    fn set_modes(firmware: &mut Firmware, mode: Mode) {
        for motor in 0..2 {
            firmware.written(MotorRegister::Mode.address(motor), mode as u16);
        }
    }

    fn calibrated() -> Firmware {
        let mut firmware = firmware();
        set_modes(&mut firmware, Mode::Calibrate);
        for _ in 0..CALIBRATION_TICKS {
            assert_eq!(firmware.tick([600, 0]), [None; 2]);
        }
        firmware
    }

    #[test]
    fn uncalibrated_motor_is_not_driven() {
        let mut firmware = firmware();
        for mode in [Mode::Position, Mode::SmoothPosition] {
            set_modes(&mut firmware, mode);
            firmware.command([700, 100]);
            assert_eq!(firmware.tick([600, 0]), [None; 2]);
            assert_eq!(firmware.mode_register(0), Mode::Coast as u16);
        }
    }

    #[test]
    fn calibration_ends_coasting_with_its_flag_set() {
        let mut firmware = firmware();
        set_modes(&mut firmware, Mode::Calibrate);
        for _ in 1..CALIBRATION_TICKS {
            firmware.tick([600, 0]);
        }
        assert_eq!(firmware.mode_register(1), Mode::Calibrate as u16);
        firmware.tick([600, 0]);
        assert_eq!(firmware.mode_register(1), RUNTIME_CALIBRATED);
    }

    #[test]
    fn activated_motor_holds_position_until_a_set_point() {
        for mode in [Mode::Position, Mode::SmoothPosition] {
            let mut firmware = calibrated();
            set_modes(&mut firmware, mode);
            assert_eq!(firmware.tick([-70, 1_400]), [Some(0); 2]);
            firmware.command([600, 600]);
            let [hip, knee] = firmware.tick([-70, 1_400]).map(Option::unwrap);
            assert!(hip > 0 && knee < 0);
        }
    }

    #[test]
    fn set_point_in_the_tick_of_activation_is_followed() {
        for mode in [Mode::Position, Mode::SmoothPosition] {
            let mut firmware = calibrated();
            set_modes(&mut firmware, mode);
            firmware.command([600, 600]);
            let [hip, knee] = firmware.tick([-70, 1_400]).map(Option::unwrap);
            assert!(hip > 0 && knee < 0, "{mode:?}: {hip}, {knee}");
        }
    }

    #[test]
    fn set_points_saturate_at_the_range_limits() {
        let mut firmware = calibrated();
        set_modes(&mut firmware, Mode::Position);
        firmware.tick([1_200, 1_350]);
        firmware.command([4_095, 4_095]);
        assert_eq!(firmware.tick([1_200, 1_350]), [Some(0); 2]);
        firmware.written(MotorRegister::GoalPosition.address(0), 4_000);
        assert_eq!(firmware.tick([1_200, 1_350])[0], Some(0));
    }

    #[test]
    fn coasting_motor_does_not_affect_the_other() {
        let mut firmware = calibrated();
        firmware.written(MotorRegister::Mode.address(1), Mode::SmoothPosition as u16);
        firmware.command([0, 100]);
        let duties = firmware.tick([600, 0]);
        assert_eq!((duties[0], duties[1].is_some()), (None, true));
    }
}
