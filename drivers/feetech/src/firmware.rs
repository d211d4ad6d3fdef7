//! The inner loops of the STS series.
//!
//! | operating mode | status |
//! |---|---|
//! | 0, position | duty cycle at rest and speed of the set-point compared with logs |
//! | 0, position, acceleration | documented, not compared |
//! | 1, speed | the set-point moves at the goal; ASSUMED |
//! | 2, PWM | documented, not compared |
//! | overload, limits of the supply and of the temperature | documented, not compared |

use serde::{Deserialize, Serialize};
use twinrig_dynamixel::{
    BridgeCommand, Profile, ProfileLimits, Registers, ServoFirmware, ServoMeasurements,
};
use twinrig_kernel::{LocalDuration, Snapshot, SnapshotError};

use crate::register as r;

/// Period of the loops. ASSUMED.
const PERIOD: LocalDuration = LocalDuration::from_nanos(1_000_000);
const PERIOD_S: f64 = 1e-3;

/// Counts of a turn of the shaft.
pub(crate) const COUNTS: f64 = 4_096.0;
/// Position of the shaft at angle 0.
pub(crate) const CENTRE: i32 = 2_048;
/// Duty cycle at 100 %.
const FULL: f64 = 1_000.0;
/// Duty cycle for an error of one count at a gain of 1 (logs of kscalelabs/sysid).
const PER_COUNT: f64 = 0.25;
/// Unit of the greatest speed: 0.732 rev/min, in counts per second.
const SPEED_LIMIT: f64 = 0.732 / 60.0 * COUNTS;
/// Unit of the acceleration: 100 counts per second squared, 8.8 °/s².
const ACCELERATION: f64 = 100.0;
/// Unit of the current \[A\].
const CURRENT: f64 = 6.5e-3;
/// Unit of the time of an overload, in periods.
const PROTECTION: i32 = 10;

/// Values of the register that turns the torque on.
const ON: i32 = 1;
const CALIBRATE: i32 = 128;

/// Bit of the phase: positions count turns.
const COUNTS_TURNS: i32 = 1 << 4;

/// Operating modes.
mod mode {
    pub(super) const SPEED: i32 = 1;
    pub(super) const PWM: i32 = 2;
}

/// Bits of the hardware error.
mod status {
    pub(super) const VOLTAGE: i32 = 1 << 0;
    pub(super) const TEMPERATURE: i32 = 1 << 2;
    pub(super) const OVERLOAD: i32 = 1 << 5;
}

/// Inner loops of a servo of the STS series.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StsFirmware {
    /// Mode in which the loops run; none with the torque off.
    running: Option<i32>,
    profile: Profile,
    /// Duty cycle.
    duty: f64,
    /// Periods of an overload.
    overload: i32,
}

impl StsFirmware {
    /// Returns the duty cycle that the position demands.
    fn position_loop(&mut self, registers: &Registers, position: f64) -> f64 {
        self.follow(registers);
        let get = |address| f64::from(registers.get(address));
        let error = libm::rint(self.profile.position) - position;
        let dead_zone = get(if error < 0.0 {
            r::CW_DEAD_ZONE
        } else {
            r::CCW_DEAD_ZONE
        });
        let beyond = error.abs() - dead_zone;
        if beyond <= 0.0 {
            return 0.0;
        }
        let duty = get(r::MINIMUM_STARTUP_FORCE) + PER_COUNT * get(r::P_COEFFICIENT) * beyond;
        libm::trunc(duty).copysign(error)
    }

    /// Moves the set-point towards the goal, at the greatest speed and acceleration.
    fn follow(&mut self, registers: &Registers) {
        let get = |address| f64::from(registers.get(address));
        let most = get(r::MAXIMUM_VELOCITY_LIMIT) * SPEED_LIMIT;
        let wanted = get(r::GOAL_VELOCITY);
        if registers.get(r::OPERATING_MODE) == mode::SPEED {
            self.profile.rate = wanted.clamp(-most, most);
            self.profile.position += self.profile.rate * PERIOD_S;
            return;
        }
        let [low, high] = [r::MIN_POSITION_LIMIT, r::MAX_POSITION_LIMIT].map(get);
        let goal = get(r::GOAL_POSITION);
        // Both limits are 0 in multi-turn mode.
        let goal = if high > low {
            goal.clamp(low, high)
        } else {
            goal
        };
        let speed = if wanted == 0.0 {
            most
        } else {
            wanted.abs().min(most)
        };
        let acceleration = get(r::ACCELERATION) * ACCELERATION;
        let limits = ProfileLimits {
            speed,
            acceleration,
        };
        self.profile.approach(goal, limits, PERIOD_S);
    }

    /// Returns the greatest duty cycle, less after an overload.
    fn limit(&mut self, registers: &mut Registers) -> f64 {
        let get = |address| registers.get(address);
        let threshold = 10 * get(r::OVERLOAD_TORQUE);
        let is_over = libm::fabs(self.duty) > f64::from(threshold);
        let time = PROTECTION * get(r::PROTECTION_TIME);
        let limit = f64::from(get(r::TORQUE_LIMIT));
        if self.overload > time {
            // Until the torque is turned off. ASSUMED.
            let status = get(r::STATUS) | status::OVERLOAD;
            let protective = 10.0 * f64::from(get(r::PROTECTIVE_TORQUE));
            registers.set(r::STATUS, status);
            return limit.min(protective);
        }
        self.overload = if is_over { self.overload + 1 } else { 0 };
        limit
    }

    /// Looks for hardware errors, and releases the motor for those that it watches for.
    fn check_hardware(registers: &mut Registers, measured: &ServoMeasurements) {
        let decivolts = libm::rint(10.0 * measured.voltage);
        let [low, high] = [r::MIN_VOLTAGE_LIMIT, r::MAX_VOLTAGE_LIMIT].map(|it| registers.get(it));
        let mut found = registers.get(r::STATUS) & status::OVERLOAD;
        if !(f64::from(low)..=f64::from(high)).contains(&decivolts) {
            found |= status::VOLTAGE;
        }
        if measured.temperature > f64::from(registers.get(r::MAX_TEMPERATURE_LIMIT)) {
            found |= status::TEMPERATURE;
        }
        registers.set(r::STATUS, found);
        let watched = registers.get(r::UNLOADING_CONDITION) & !status::OVERLOAD;
        if found & watched != 0 {
            registers.set(r::TORQUE_ENABLE, 0);
        }
    }
}

impl ServoFirmware for StsFirmware {
    fn period(&self) -> LocalDuration {
        PERIOD
    }

    fn step(
        &mut self,
        registers: &mut Registers,
        measured: &ServoMeasurements,
        _: u64,
    ) -> BridgeCommand {
        let encoder =
            libm::rint(measured.angle / core::f64::consts::TAU * COUNTS + f64::from(CENTRE));
        let in_turn = |counts: f64| counts - libm::floor(counts / COUNTS) * COUNTS;
        if registers.get(r::TORQUE_ENABLE) == CALIBRATE {
            registers.set_nearest(r::HOMING_OFFSET, in_turn(encoder) - f64::from(CENTRE));
            registers.set(r::TORQUE_ENABLE, 0);
        }
        let in_mode = registers.get(r::OPERATING_MODE);
        let turning = encoder - f64::from(registers.get(r::HOMING_OFFSET));
        let counts_turns = registers.get(r::PHASE) & COUNTS_TURNS != 0;
        let shown = if counts_turns {
            turning
        } else {
            in_turn(turning)
        };
        // A set-point that moves on and on is followed from turn to turn. ASSUMED.
        let position = if in_mode == mode::SPEED {
            turning
        } else {
            shown
        };
        let velocity = measured.rate / core::f64::consts::TAU * COUNTS;
        Self::check_hardware(registers, measured);
        let runs = registers.get(r::TORQUE_ENABLE) == ON;
        if self.running != runs.then_some(in_mode) {
            self.running = runs.then_some(in_mode);
            self.profile = Profile::at(position);
            (self.duty, self.overload) = (0.0, 0);
            if !runs {
                registers.set(r::STATUS, registers.get(r::STATUS) & !status::OVERLOAD);
            }
        }
        let bridge = if runs {
            let demanded = match in_mode {
                mode::PWM => f64::from(registers.get(r::GOAL_TIME)),
                _ => self.position_loop(registers, position),
            };
            let limit = self.limit(registers);
            self.duty = demanded.clamp(-limit, limit);
            BridgeCommand::Duty(self.duty / FULL)
        } else {
            (self.profile.position, self.duty) = (position, 0.0);
            BridgeCommand::Open
        };
        let moving = velocity.abs() > f64::from(registers.get(r::MOVING_VELOCITY_THRESHOLD));
        registers.set_nearest(r::PRESENT_POSITION, shown);
        registers.set_nearest(r::PRESENT_VELOCITY, velocity);
        registers.set_nearest(r::PRESENT_LOAD, -self.duty);
        registers.set_nearest(r::PRESENT_VOLTAGE, 10.0 * measured.voltage);
        registers.set_nearest(r::PRESENT_TEMPERATURE, measured.temperature);
        registers.set_nearest(r::PRESENT_CURRENT, measured.current / CURRENT);
        registers.set(r::MOVING, i32::from(moving));
        registers.set_nearest(r::GOAL_POSITION_2, self.profile.position);
        bridge
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(self)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        *self = snapshot.read()?;
        Ok(())
    }
}
