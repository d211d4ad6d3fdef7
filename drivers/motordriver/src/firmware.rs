use serde::{Deserialize, Serialize};
use twinrig_kernel::LocalDuration;

use crate::config::{FirmwareConfig, Interpolation};
use crate::motor::Motor;
use crate::registers::{Mode, MotorRegister, RUNTIME_CALIBRATED, SMOOTH_POSITION_UPDATE};
use crate::smooth::{FRACTION_BITS, Interpolator, SmoothCounts};
use crate::units::{CONTINUOUS, LIMIT_MASK};
use crate::velocity::Velocity;
use crate::watchdog::Watchdog;

/// Tick of the firmware, by the board's own clock.
pub(crate) const TICK: LocalDuration = LocalDuration::from_nanos(1_000_000);

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

    /// Starts anew; the counters go on.
    pub(crate) fn power_cycle(&mut self, config: FirmwareConfig, limits: [u16; 2]) {
        let before = std::mem::replace(self, Self::new(config, limits));
        self.smooth.continue_counts(before.smooth.counts());
        self.watchdog.continue_drops(before.watchdog.drops());
    }

    /// Receives the words of the set-points of both motors: positions \[counts\], which are
    /// limited to their ranges, or speeds.
    pub(crate) fn command(&mut self, goals: [u16; 2]) {
        self.commanded = true;
        for (motor, goal) in self.motors.iter_mut().zip(goals) {
            motor.command(goal);
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
                motor.command(value);
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
                motor.velocity.set_speed_max(value);
            } else if is(MotorRegister::MaxAcceleration) {
                motor.velocity.set_acceleration_max(value);
            } else if is(MotorRegister::PositionLimit) {
                motor.limit = value & LIMIT_MASK;
                motor.continuous = value & CONTINUOUS != 0;
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

    /// Returns the interpolation period \[ticks\].
    pub(crate) fn smooth_period(&self) -> u16 {
        self.smooth.period()
    }

    pub(crate) fn smooth_counts(&self) -> SmoothCounts {
        self.smooth.counts()
    }

    /// Returns the state of a motor's velocity mode.
    pub(crate) fn velocity(&self, motor: usize) -> &Velocity {
        &self.motors[motor].velocity
    }

    pub(crate) fn watchdog_drops(&self) -> u64 {
        self.watchdog.drops()
    }

    /// Executes a tick for the positions \[counts\]. Returns the duties of the motors; `None` for
    /// an open bridge.
    pub(crate) fn tick(&mut self, positions: [i32; 2]) -> [Option<i32>; 2] {
        self.calibrate();
        for (motor, position) in self.motors.iter_mut().zip(positions) {
            motor.velocity.observe(position);
        }
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
                Mode::Velocity => {
                    let (lag, travel) = motor.velocity.tick();
                    duties[n] = Some(motor.pid.correct(motor.gains, lag, travel));
                    continue;
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
                motor.engage(position);
            }
            self.smooth
                .resume(positions.map(|position| position << FRACTION_BITS));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assumed::CALIBRATION_TICKS;

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
    fn velocity_mode_requires_continuous_rotation() {
        // The first motor has a range, the second rotates without limit.
        let mut firmware = calibrated();
        set_modes(&mut firmware, Mode::Velocity);
        firmware.written(MotorRegister::MaxAcceleration.address(1), 32_000);
        firmware.command([2_048, 2_048]);
        let mut duties = [None; 2];
        for _ in 0..20 {
            duties = firmware.tick([600, 0]);
        }
        assert!(duties[0].is_none() && duties[1] > Some(0), "{duties:?}");
        assert_eq!(
            firmware.mode_register(0),
            Mode::Coast as u16 | RUNTIME_CALIBRATED
        );
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
