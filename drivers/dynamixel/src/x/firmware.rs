//! The inner loops of the firmware.
//!
//! | operating mode | status |
//! |---|---|
//! | 3, position | proportional gain compared with logs of a real servo |
//! | 3, position, other gains | documented, not compared |
//! | 4, extended position | as 3 |
//! | 5, current-based position | documented, not compared |
//! | 1, velocity | documented, not compared |
//! | 0, current | the manual has no gains: ASSUMED |
//! | 16, PWM | documented, not compared |
//! | profiles, slope of the duty cycle, bus watchdog, shutdown | documented, not compared |
//!
//! The unit of the duty cycle is that of its register: 885 are 100 %. The manual gives the
//! controller's gain as `K/128`; logs of a real XL330 show `K/256` of the error in counts, so that
//! its factor of all gains is ½. That it is the same for the other gains is ASSUMED, and so is that
//! the XM430 has the manual's.
//!
//! Registers without effect: bits 2 and 3 of the drive mode (time-based profile, torque on by a
//! goal), startup configuration, moving status, LED.

use serde::{Deserialize, Serialize};
use twinrig_kernel::{LocalDuration, Snapshot, SnapshotError};

use super::register as r;
use crate::firmware::{BridgeCommand, ServoFirmware, ServoMeasurements};
use crate::profile::{Profile, ProfileLimits};
use crate::registers::Registers;
use crate::table::CommonRegisters;

/// Period of the loops. ASSUMED.
const PERIOD: LocalDuration = LocalDuration::from_nanos(1_000_000);
const PERIOD_S: f64 = 1e-3;

/// Counts of a turn of the shaft.
pub(super) const COUNTS: f64 = 4_096.0;
/// Position of the shaft at angle 0, in both directions of rotation. ASSUMED for the reverse one.
pub(super) const CENTRE: i32 = 2_048;
/// Register of the duty cycle at 100 %.
const FULL: f64 = 885.0;
/// Unit of velocities: 0.229 rev/min, in counts per second.
const VELOCITY: f64 = 0.229 / 60.0 * COUNTS;
/// Unit of accelerations: 214.577 rev/min², in counts per second squared.
const ACCELERATION: f64 = 214.577 / 3_600.0 * COUNTS;
/// Gains of the controllers for 1 in their registers (manual, "Position PID Gain" and "Velocity PI
/// Gain"), before [`Scales::gain`].
const POSITION_P: f64 = 1.0 / 128.0;
const POSITION_I: f64 = 1.0 / 65_536.0;
const POSITION_D: f64 = 1.0 / 16.0;
const FEEDFORWARD: f64 = 1.0 / 4.0;
const VELOCITY_P: f64 = 1.0 / 128.0;
const VELOCITY_I: f64 = 1.0 / 65_536.0;
/// Duty cycle for each milliampere of an error of the current in each period. ASSUMED.
const CURRENT_I: f64 = 0.05;
/// Unit of the slope of the duty cycle \[V/s\].
const SLOPE: f64 = 1.977;
/// Unit of the bus watchdog, in periods.
const WATCHDOG: i32 = 20;
/// Time for which the duty cycle is at its limit without motion before it is an overload, in
/// periods. ASSUMED.
const OVERLOAD: u32 = 1_000;

/// Bits of the hardware error.
pub mod hardware_error {
    /// The supply is outside of its limits.
    pub const INPUT_VOLTAGE: i32 = 1 << 0;
    /// The temperature is above its limit.
    pub const OVERHEATING: i32 = 1 << 2;
    /// The load exceeds the greatest output for long.
    pub const OVERLOAD: i32 = 1 << 5;
}

/// Scales of a model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scales {
    /// Factor of all gains.
    pub gain: f64,
    /// Unit of currents \[mA\].
    pub milliamperes: f64,
}

/// Inner loops of a servo of the X series.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct XFirmware {
    scales: Scales,
    /// Mode in which the loops run; none with the torque off.
    running: Option<i32>,
    profile: Profile,
    /// Sum of errors over periods.
    integral: f64,
    /// Duty cycle.
    pwm: f64,
    /// Counts by which the position differs from that of the encoder: whole turns.
    turns: f64,
    /// Whether the position is to be within one turn, as at power-on.
    wraps: bool,
    ticks: u64,
    /// Periods without an instruction, and the number of instructions before.
    silence: i32,
    instructions: u64,
    /// Periods at the limit without motion.
    overload: u32,
}

/// Operating modes.
mod mode {
    pub(super) const CURRENT: i32 = 0;
    pub(super) const VELOCITY: i32 = 1;
    pub(super) const POSITION: i32 = 3;
    pub(super) const EXTENDED: i32 = 4;
    pub(super) const CURRENT_BASED: i32 = 5;
    pub(super) const PWM: i32 = 16;
}

impl XFirmware {
    /// Creates the firmware at power-on.
    pub fn new(scales: Scales) -> Self {
        Self {
            scales,
            running: None,
            profile: Profile::default(),
            integral: 0.0,
            pwm: 0.0,
            turns: 0.0,
            wraps: true,
            ticks: 0,
            silence: 0,
            instructions: 0,
            overload: 0,
        }
    }

    /// Forgets whole turns, also of goal and set-point: at power-on, when position control begins,
    /// and by an instruction (manual, "Homing Offset" and "Present Position"; that goal and
    /// set-point follow is ASSUMED).
    fn wrap(&mut self, registers: &mut Registers, encoder: f64) {
        self.wraps = false;
        let turns = -libm::floor(encoder / COUNTS) * COUNTS;
        let change = turns - self.turns;
        self.turns = turns;
        if change != 0.0 {
            self.profile.position += change;
            let goal = f64::from(registers.get(r::GOAL_POSITION));
            registers.set_nearest(r::GOAL_POSITION, goal + change);
        }
    }

    /// Begins to run in another mode: the profile begins at the position.
    fn enter_mode(&mut self, position: f64, running: Option<i32>) {
        self.running = running;
        self.profile = Profile::at(position);
        (self.integral, self.overload) = (0.0, 0);
    }

    /// Returns the duty cycle that the loops of a mode demand.
    fn duty(
        &mut self,
        registers: &Registers,
        in_mode: i32,
        position: f64,
        velocity: f64,
        current: f64,
    ) -> f64 {
        let get = |address| f64::from(registers.get(address));
        let limit = |address, by: f64| by.min(get(address));
        let demanded = match in_mode {
            mode::POSITION | mode::EXTENDED => self.position_loop(registers, position, velocity),
            mode::CURRENT_BASED => {
                let demanded = self.position_loop(registers, position, velocity);
                // Beyond the goal of the current the duty cycle recedes from where it is.
                let most = limit(r::CURRENT_LIMIT, get(r::GOAL_CURRENT).abs());
                let excess = current.abs() - most;
                if excess > 0.0 {
                    let change = CURRENT_I * self.scales.milliamperes * excess;
                    let reduced = (self.pwm.abs() - change).max(0.0);
                    demanded.clamp(-reduced, reduced)
                } else {
                    demanded
                }
            }
            mode::VELOCITY => self.velocity_loop(registers, velocity),
            mode::CURRENT => {
                let most = get(r::CURRENT_LIMIT);
                let goal = get(r::GOAL_CURRENT).clamp(-most, most);
                self.pwm + CURRENT_I * self.scales.milliamperes * (goal - current)
            }
            mode::PWM => get(r::GOAL_PWM),
            _ => 0.0,
        };
        let most = match in_mode {
            mode::PWM | mode::CURRENT | mode::VELOCITY => get(r::PWM_LIMIT),
            _ => limit(r::PWM_LIMIT, get(r::GOAL_PWM).abs()),
        };
        demanded.clamp(-most, most)
    }

    fn position_loop(&mut self, registers: &Registers, position: f64, velocity: f64) -> f64 {
        let get = |address| f64::from(registers.get(address));
        let before = self.profile.rate;
        self.follow_profile(registers);
        let error = libm::rint(self.profile.position) - position;
        let [p, i, d] = [r::POSITION_P_GAIN, r::POSITION_I_GAIN, r::POSITION_D_GAIN].map(get);
        if i == 0.0 {
            self.integral = 0.0;
        } else {
            // Bounded, so that it does not wind up.
            let most = FULL / (self.scales.gain * POSITION_I * i);
            self.integral = (self.integral + error).clamp(-most, most);
        }
        let change = (self.profile.rate - velocity) * PERIOD_S;
        let acceleration = (self.profile.rate - before) / PERIOD_S;
        let duty = POSITION_P * p * error
            + POSITION_I * i * self.integral
            + POSITION_D * d * change
            + FEEDFORWARD * get(r::FEEDFORWARD_1ST_GAIN) * self.profile.rate * PERIOD_S
            + FEEDFORWARD * get(r::FEEDFORWARD_2ND_GAIN) * acceleration * PERIOD_S * PERIOD_S;
        self.scales.gain * duty
    }

    fn velocity_loop(&mut self, registers: &Registers, velocity: f64) -> f64 {
        let get = |address| f64::from(registers.get(address));
        let goal = get(r::GOAL_VELOCITY) * VELOCITY;
        let acceleration = get(r::PROFILE_ACCELERATION) * ACCELERATION;
        self.profile.rate = if acceleration > 0.0 {
            let most = acceleration * PERIOD_S;
            self.profile.rate + (goal - self.profile.rate).clamp(-most, most)
        } else {
            goal
        };
        let error = (self.profile.rate - velocity) / VELOCITY;
        let [p, i] = [r::VELOCITY_P_GAIN, r::VELOCITY_I_GAIN].map(get);
        if i > 0.0 {
            let most = FULL / (self.scales.gain * VELOCITY_I * i);
            self.integral = (self.integral + error).clamp(-most, most);
        }
        self.scales.gain * (VELOCITY_P * p * error + VELOCITY_I * i * self.integral)
    }

    /// Moves the set-point towards the goal: at once, or at the greatest speed and acceleration of
    /// the profile.
    fn follow_profile(&mut self, registers: &Registers) {
        let goal = f64::from(registers.get(r::GOAL_POSITION));
        let speed = f64::from(registers.get(r::PROFILE_VELOCITY)) * VELOCITY;
        let acceleration = f64::from(registers.get(r::PROFILE_ACCELERATION)) * ACCELERATION;
        if speed == 0.0 {
            self.profile = Profile::at(goal);
            return;
        }
        let limits = ProfileLimits {
            speed,
            acceleration,
        };
        self.profile.approach(goal, limits, PERIOD_S);
    }

    /// Moves the duty cycle towards `goal` at its greatest slope.
    fn approach(&mut self, registers: &Registers, goal: f64, voltage: f64) {
        // A model without the register has no limit.
        if registers.model().item(r::PWM_SLOPE).is_none() {
            self.pwm = goal;
            return;
        }
        let slope = f64::from(registers.get(r::PWM_SLOPE)) * SLOPE;
        let change = slope * PERIOD_S / voltage.max(1.0) * FULL;
        self.pwm += (goal - self.pwm).clamp(-change, change);
    }

    /// Shuts the servo down, if an error is found that it watches for.
    fn check_hardware(
        &mut self,
        registers: &mut Registers,
        measured: &ServoMeasurements,
        velocity: f64,
    ) {
        let decivolts = libm::rint(10.0 * measured.voltage);
        let [low, high] = [r::MIN_VOLTAGE_LIMIT, r::MAX_VOLTAGE_LIMIT].map(|it| registers.get(it));
        let mut found = 0;
        if !(f64::from(low)..=f64::from(high)).contains(&decivolts) {
            found |= hardware_error::INPUT_VOLTAGE;
        }
        if measured.temperature > f64::from(registers.get(r::TEMPERATURE_LIMIT)) {
            found |= hardware_error::OVERHEATING;
        }
        let limit = f64::from(registers.get(r::PWM_LIMIT));
        let at_limit = self.running.is_some() && limit > 0.0 && self.pwm.abs() >= limit;
        let stalls = at_limit && velocity.abs() < VELOCITY;
        self.overload = if stalls { self.overload + 1 } else { 0 };
        if self.overload > OVERLOAD {
            found |= hardware_error::OVERLOAD;
        }
        let error = registers.get(r::HARDWARE_ERROR_STATUS) | found;
        registers.set(r::HARDWARE_ERROR_STATUS, error);
        if error & registers.get(r::SHUTDOWN) != 0 {
            registers.set(r::TORQUE_ENABLE, 0);
        }
    }

    /// Stops the servo without an instruction for too long.
    fn watch_bus(&mut self, registers: &mut Registers, instructions: u64) {
        self.silence = if instructions == self.instructions {
            self.silence + 1
        } else {
            0
        };
        self.instructions = instructions;
        let watchdog = registers.get(r::BUS_WATCHDOG);
        let enabled = registers.get(r::TORQUE_ENABLE) != 0;
        if (1..=127).contains(&watchdog) && enabled && self.silence > watchdog * WATCHDOG {
            registers.set(r::BUS_WATCHDOG, CommonRegisters::SILENCE);
            registers.set(r::GOAL_VELOCITY, 0);
            registers.set(r::GOAL_POSITION, registers.get(r::PRESENT_POSITION));
            // In the other modes these are limits.
            match registers.get(r::OPERATING_MODE) {
                mode::PWM => registers.set(r::GOAL_PWM, 0),
                mode::CURRENT => registers.set(r::GOAL_CURRENT, 0),
                _ => {}
            }
            registers.set(r::PROFILE_ACCELERATION, 0);
            registers.set(r::PROFILE_VELOCITY, 0);
        }
    }

    fn report(
        &self,
        registers: &mut Registers,
        position: f64,
        velocity: f64,
        current: f64,
        measured: &ServoMeasurements,
    ) {
        let velocity = libm::rint(velocity / VELOCITY);
        let threshold = f64::from(registers.get(r::MOVING_THRESHOLD));
        let ticks = i32::try_from(self.ticks % 32_768).unwrap_or_default();
        registers.set(r::REALTIME_TICK, ticks);
        registers.set(r::MOVING, i32::from(velocity.abs() > threshold));
        registers.set_nearest(r::PRESENT_PWM, self.pwm);
        registers.set_nearest(r::PRESENT_CURRENT, current);
        registers.set_nearest(r::PRESENT_VELOCITY, velocity);
        registers.set_nearest(r::PRESENT_POSITION, position);
        registers.set_nearest(r::VELOCITY_TRAJECTORY, self.profile.rate / VELOCITY);
        registers.set_nearest(r::POSITION_TRAJECTORY, self.profile.position);
        registers.set_nearest(r::PRESENT_INPUT_VOLTAGE, 10.0 * measured.voltage);
        registers.set_nearest(r::PRESENT_TEMPERATURE, measured.temperature);
    }
}

impl ServoFirmware for XFirmware {
    fn period(&self) -> LocalDuration {
        PERIOD
    }

    fn clear_turns(&mut self) {
        self.wraps = true;
    }

    fn step(
        &mut self,
        registers: &mut Registers,
        measured: &ServoMeasurements,
        instructions: u64,
    ) -> BridgeCommand {
        self.ticks += 1;
        let sign = if registers.get(r::DRIVE_MODE) & 1 == 0 {
            1.0
        } else {
            -1.0
        };
        let encoder =
            libm::rint(sign * measured.angle / core::f64::consts::TAU * COUNTS) + f64::from(CENTRE);
        let offset = f64::from(registers.get(r::HOMING_OFFSET));
        let enabled = registers.get(r::TORQUE_ENABLE) != 0;
        let in_mode = registers.get(r::OPERATING_MODE);
        let enters = self.running != enabled.then_some(in_mode);
        if self.wraps || enters && in_mode == mode::POSITION {
            self.wrap(registers, encoder);
        }
        let position = encoder + self.turns + offset;
        let velocity = sign * measured.rate / core::f64::consts::TAU * COUNTS;
        let current = sign * 1e3 * measured.current / self.scales.milliamperes;
        self.check_hardware(registers, measured, velocity);
        self.watch_bus(registers, instructions);
        let enabled = registers.get(r::TORQUE_ENABLE) != 0;
        if self.running != enabled.then_some(in_mode) {
            self.enter_mode(position, enabled.then_some(in_mode));
        }
        let bridge = if enabled {
            let goal = self.duty(registers, in_mode, position, velocity, current);
            self.approach(registers, goal, measured.voltage);
            BridgeCommand::Duty(sign * self.pwm / FULL)
        } else {
            (self.profile, self.pwm) = (Profile::at(position), 0.0);
            BridgeCommand::Open
        };
        self.report(registers, position, velocity, current, measured);
        bridge
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(self)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let saved: Self = snapshot.read()?;
        if saved.scales != self.scales {
            return Err(SnapshotError::Mismatch {
                expected: format!("{:?}", self.scales),
                found: format!("{:?}", saved.scales),
            });
        }
        *self = saved;
        Ok(())
    }
}
