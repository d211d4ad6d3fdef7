use serde::{Deserialize, Serialize};

use crate::assumed::CALIBRATION_TICKS;
use crate::config::{FirmwareConfig, Interpolation};
use crate::pid::{Gains, Pid};
use crate::registers::{Mode, MotorRegister, RUNTIME_CALIBRATED, SMOOTH_POSITION_UPDATE};
use crate::smooth::{FRACTION_BITS, Interpolator, SmoothCounts};
use crate::units::LIMIT_MASK;
use crate::watchdog::Watchdog;

/// What the processor of a board does once a tick, without its clock, its bus and its sensors.
///
/// Commands and registers that came since the last tick count from the next one on.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Firmware {
    motors: [Motor; 2],
    smooth: Interpolator,
    watchdog: Watchdog,
    /// A command has come since the last tick.
    commanded: bool,
    /// No command came for so long that the motors were let go.
    dropped: bool,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Motor {
    mode: Mode,
    calibrated: bool,
    /// Ticks until calibration is over.
    calibrating: u32,
    /// The motor is to be driven from the next tick on, from where it is then.
    starts: bool,
    gains: Gains,
    /// Greatest set-point \[counts\].
    limit: u16,
    /// The last set-point, once there is one.
    goal: Option<u16>,
    /// Where it was when it was last switched on \[counts\].
    hold: i32,
    pid: Pid,
}

impl Motor {
    fn new(limit: u16) -> Self {
        Self {
            mode: Mode::Coast,
            calibrated: false,
            calibrating: 0,
            starts: false,
            gains: Gains {
                p: 0,
                i: 0,
                d: 0,
                torque_max: 0,
            },
            limit: limit & LIMIT_MASK,
            goal: None,
            hold: 0,
            pid: Pid::default(),
        }
    }

    fn set_mode(&mut self, mode: Mode) {
        // A motor that does not know where it is is not driven anywhere.
        self.mode = if mode.is_driven() && !self.calibrated {
            Mode::Coast
        } else {
            mode
        };
        match self.mode {
            Mode::Calibrate => self.calibrating = CALIBRATION_TICKS,
            Mode::Position | Mode::SmoothPosition => {
                self.starts = true;
                self.goal = None;
            }
            Mode::Coast => {}
        }
    }

    /// Begins to drive from where it is.
    fn start(&mut self, position: i32) {
        self.starts = false;
        self.hold = position;
        self.pid = Pid::rest(position);
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

    /// Set-points for both motors have come \[counts\]; those out of range become its nearest end.
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
        // What has no set-point yet stays where it is.
        let point = [0, 1].map(|n| match self.motors[n].goal {
            Some(goal) => i32::from(goal) << FRACTION_BITS,
            None => self.smooth.at()[n],
        });
        self.smooth.push(point);
    }

    /// The master has written a register.
    pub(crate) fn written(&mut self, address: u8, value: u16) {
        if address == SMOOTH_POSITION_UPDATE {
            self.smooth.set_period(value);
            return;
        }
        for n in 0..2 {
            let is = |register: MotorRegister| address == register.of(n);
            let motor = &mut self.motors[n];
            if is(MotorRegister::Mode) {
                motor.set_mode(Mode::of(value));
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

    /// What the mode register of a motor says.
    pub(crate) fn mode_register(&self, motor: usize) -> u16 {
        let Motor {
            mode, calibrated, ..
        } = self.motors[motor];
        mode as u16 | if calibrated { RUNTIME_CALIBRATED } else { 0 }
    }

    /// Whether a motor is being calibrated, so that its mode will change by itself.
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

    /// A tick: the duties of the motors, of their positions \[counts\]; none for one whose bridge is open.
    pub(crate) fn tick(&mut self, positions: [i32; 2]) -> [Option<i32>; 2] {
        self.calibrate();
        if !self.motors.iter().any(|motor| motor.mode.is_driven()) {
            self.commanded = false;
            self.watchdog.feed();
            return [None; 2];
        }
        self.start(positions);
        self.watch(positions);
        if self.dropped {
            return [None; 2];
        }
        let smooth = self.smooth.tick();
        let mut duties = [None; 2];
        for (n, motor) in self.motors.iter_mut().enumerate() {
            let set_point = match motor.mode {
                Mode::Coast | Mode::Calibrate => continue,
                Mode::SmoothPosition => smooth[n],
                Mode::Position => motor.goal.map_or(motor.hold, i32::from) << FRACTION_BITS,
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

    /// Motors that were switched on begin where they are.
    fn start(&mut self, positions: [i32; 2]) {
        let mut any = false;
        for (motor, position) in self.motors.iter_mut().zip(positions) {
            if motor.starts {
                motor.start(position);
                any = true;
            }
        }
        if any {
            self.smooth
                .rest(positions.map(|position| position << FRACTION_BITS));
            // A set-point may have come since the mode was written.
            let has_come = |motor: &Motor| motor.mode.is_driven() && motor.goal.is_some();
            if self.motors.iter().any(has_come) {
                self.push_goals();
            }
            self.watchdog.feed();
            self.dropped = false;
        }
    }

    fn watch(&mut self, positions: [i32; 2]) {
        if !std::mem::take(&mut self.commanded) {
            if self.watchdog.starve(self.smooth.period()) {
                self.dropped = true;
            }
            return;
        }
        self.watchdog.feed();
        if std::mem::take(&mut self.dropped) {
            // ASSUMED: the next command takes the motors up again, from where they have fallen to.
            for (motor, position) in self.motors.iter_mut().zip(positions) {
                motor.pid = Pid::rest(position);
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
            firmware.written(MotorRegister::PGain.of(motor), 400);
            firmware.written(MotorRegister::MaxTorque.of(motor), 1_100);
            firmware.written(MotorRegister::MaxSpeed.of(motor), 32_000);
        }
        firmware
    }

    fn set_modes(firmware: &mut Firmware, mode: Mode) {
        for motor in 0..2 {
            firmware.written(MotorRegister::Mode.of(motor), mode as u16);
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
    fn a_motor_that_was_not_calibrated_is_not_driven() {
        let mut firmware = firmware();
        for mode in [Mode::Position, Mode::SmoothPosition] {
            set_modes(&mut firmware, mode);
            firmware.command([700, 100]);
            assert_eq!(firmware.tick([600, 0]), [None; 2]);
            assert_eq!(firmware.mode_register(0), Mode::Coast as u16);
        }
    }

    #[test]
    fn calibration_takes_its_time_then_says_so_and_coasts() {
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
    fn what_is_switched_on_stays_where_it_is_until_a_set_point_comes() {
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
    fn a_set_point_that_comes_within_the_tick_of_switching_on_is_followed() {
        for mode in [Mode::Position, Mode::SmoothPosition] {
            let mut firmware = calibrated();
            set_modes(&mut firmware, mode);
            firmware.command([600, 600]);
            let [hip, knee] = firmware.tick([-70, 1_400]).map(Option::unwrap);
            assert!(hip > 0 && knee < 0, "{mode:?}: {hip}, {knee}");
        }
    }

    #[test]
    fn set_points_out_of_range_become_its_end() {
        let mut firmware = calibrated();
        set_modes(&mut firmware, Mode::Position);
        firmware.tick([1_200, 1_350]);
        firmware.command([4_095, 4_095]);
        assert_eq!(firmware.tick([1_200, 1_350]), [Some(0); 2]);
        firmware.written(MotorRegister::GoalPosition.of(0), 4_000);
        assert_eq!(firmware.tick([1_200, 1_350])[0], Some(0));
    }

    #[test]
    fn a_motor_that_coasts_leaves_the_other_one_alone() {
        let mut firmware = calibrated();
        firmware.written(MotorRegister::Mode.of(1), Mode::SmoothPosition as u16);
        firmware.command([0, 100]);
        let duties = firmware.tick([600, 0]);
        assert_eq!((duties[0], duties[1].is_some()), (None, true));
    }
}
