//! The inner loops of the STS and SCS series.
//!
//! | operating mode of STS | status |
//! |---|---|
//! | 0, position | duty cycle at rest and speed of the set-point compared with logs |
//! | 0, position, acceleration | documented, not compared |
//! | 1, speed | the set-point moves at the goal; ASSUMED |
//! | 2, PWM | documented, not compared |
//! | overload, limits of the supply and of the temperature | documented, not compared |
//!
//! Those of SCS are documented, not compared: the law of the position is ASSUMED to be that of STS,
//! in duty cycle per angle. With both angle limits at 0 the goal is a duty cycle.

use serde::{Deserialize, Serialize};
use twinrig_dynamixel::{
    BridgeCommand, Profile, ProfileLimits, Registers, ServoFirmware, ServoMeasurements,
};
use twinrig_kernel::{LocalDuration, Snapshot, SnapshotError};

use crate::register as r;

/// Period of the loops. ASSUMED.
const PERIOD: LocalDuration = LocalDuration::from_nanos(1_000_000);
const PERIOD_S: f64 = 1e-3;

/// Duty cycle at 100 %.
const FULL: f64 = 1_000.0;
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

/// Registers, units and laws in which the series differ.
#[derive(Debug)]
pub(crate) struct Series {
    /// Counts of a turn of the shaft.
    pub(crate) counts: f64,
    /// Position of the shaft at angle 0.
    pub(crate) centre: i32,
    /// Greatest position; none of an encoder, which turns on.
    pub(crate) end: Option<f64>,
    /// Duty cycle for an error of one count at a gain of 1.
    per_count: f64,
    /// Greatest duty cycle \[0.1 %\].
    torque_limit: u16,
    /// Torque limit after an overload \[1 %\].
    protective_torque: u16,
    /// Time of an overload \[10 ms\].
    protection_time: u16,
    /// Duty cycle of an overload \[1 %\].
    overload_torque: u16,
    /// Greatest speed of the set-point, and its unit \[counts/s\].
    velocity_limit: (u16, f64),
    /// Speed from which on the shaft moves, and its unit \[counts/s\].
    moving_threshold: (u16, f64),
}

pub(crate) static STS: Series = Series {
    counts: 4_096.0,
    centre: 2_048,
    end: None,
    // Logs of kscalelabs/sysid.
    per_count: 0.25,
    torque_limit: r::TORQUE_LIMIT,
    protective_torque: r::PROTECTIVE_TORQUE,
    protection_time: r::PROTECTION_TIME,
    overload_torque: r::OVERLOAD_TORQUE,
    // 0.732 rev/min.
    velocity_limit: (r::MAXIMUM_VELOCITY_LIMIT, 0.732 / 60.0 * 4_096.0),
    moving_threshold: (r::MOVING_VELOCITY_THRESHOLD, 1.0),
};

/// A potentiometer of 300°, whose middle is 511 (rustypot 1.13, `scs0009.rs`).
pub(crate) static SCS: Series = Series {
    counts: 1_024.0 * 360.0 / 300.0,
    centre: 511,
    end: Some(1_023.0),
    // As STS by the angle. ASSUMED.
    per_count: 0.25 * 4_096.0 * 300.0 / 360.0 / 1_024.0,
    torque_limit: r::MAX_TORQUE_LIMIT,
    protective_torque: r::scs::PROTECTIVE_TORQUE,
    protection_time: r::scs::PROTECTION_TIME,
    overload_torque: r::scs::OVERLOAD_TORQUE,
    velocity_limit: (r::scs::MAXIMUM_VELOCITY_LIMIT, 50.0),
    moving_threshold: (r::scs::MOVING_VELOCITY_THRESHOLD, 50.0),
};

/// Inner loops of a servo of the STS or SCS series.
#[derive(Clone, Debug)]
pub struct FeetechFirmware {
    series: &'static Series,
    state: State,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct State {
    /// Mode in which the loops run; none with the torque off.
    running: Option<i32>,
    profile: Profile,
    /// Duty cycle.
    duty: f64,
    /// Periods of an overload.
    overload: i32,
}

impl FeetechFirmware {
    /// The firmware of the STS series at power-on.
    pub fn sts() -> Self {
        Self::of(&STS)
    }

    /// The firmware of the SCS series at power-on.
    pub fn scs() -> Self {
        Self::of(&SCS)
    }

    fn of(series: &'static Series) -> Self {
        let state = State::default();
        Self { series, state }
    }

    /// Returns the duty cycle that the position demands.
    fn position_loop(&mut self, registers: &Registers, position: f64) -> f64 {
        self.follow(registers);
        let get = |address| f64::from(registers.get(address));
        let error = libm::rint(self.state.profile.position) - position;
        let dead_zone = get(if error < 0.0 {
            r::CW_DEAD_ZONE
        } else {
            r::CCW_DEAD_ZONE
        });
        let beyond = error.abs() - dead_zone;
        if beyond <= 0.0 {
            return 0.0;
        }
        let duty =
            get(r::MINIMUM_STARTUP_FORCE) + self.series.per_count * get(r::P_COEFFICIENT) * beyond;
        libm::trunc(duty).copysign(error)
    }

    /// Moves the set-point towards the goal, at the greatest speed and acceleration.
    fn follow(&mut self, registers: &Registers) {
        let get = |address| f64::from(registers.get(address));
        let (limit, unit) = self.series.velocity_limit;
        let most = get(limit) * unit;
        let wanted = get(r::GOAL_VELOCITY);
        if registers.get(r::OPERATING_MODE) == mode::SPEED {
            self.state.profile.rate = wanted.clamp(-most, most);
            self.state.profile.position += self.state.profile.rate * PERIOD_S;
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
        self.state.profile.approach(goal, limits, PERIOD_S);
    }

    fn operating_mode(&self, registers: &Registers) -> i32 {
        let limits = [r::MIN_POSITION_LIMIT, r::MAX_POSITION_LIMIT];
        let is_motor = self.series.end.is_some() && limits.map(|it| registers.get(it)) == [0, 0];
        if is_motor {
            return mode::PWM;
        }
        // The SCS series has no such register.
        registers.get(r::OPERATING_MODE)
    }

    /// Returns the greatest duty cycle, less after an overload.
    fn limit(&mut self, registers: &mut Registers) -> f64 {
        let get = |address| registers.get(address);
        let threshold = 10 * get(self.series.overload_torque);
        let is_over = libm::fabs(self.state.duty) > f64::from(threshold);
        let time = PROTECTION * get(self.series.protection_time);
        let limit = f64::from(get(self.series.torque_limit));
        if self.state.overload > time {
            // Until the torque is turned off. ASSUMED.
            let status = get(r::STATUS) | status::OVERLOAD;
            let protective = 10.0 * f64::from(get(self.series.protective_torque));
            registers.set(r::STATUS, status);
            return limit.min(protective);
        }
        self.state.overload = if is_over { self.state.overload + 1 } else { 0 };
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

impl ServoFirmware for FeetechFirmware {
    fn period(&self) -> LocalDuration {
        PERIOD
    }

    fn step(
        &mut self,
        registers: &mut Registers,
        measured: &ServoMeasurements,
        _: u64,
    ) -> BridgeCommand {
        let &Series { counts, centre, .. } = self.series;
        let encoder =
            libm::rint(measured.angle / core::f64::consts::TAU * counts + f64::from(centre));
        let end = self.series.end;
        let in_turn = |position: f64| match end {
            Some(end) => position.clamp(0.0, end),
            None => position - libm::floor(position / counts) * counts,
        };
        if registers.get(r::TORQUE_ENABLE) == CALIBRATE {
            registers.set_nearest(r::HOMING_OFFSET, in_turn(encoder) - f64::from(centre));
            registers.set(r::TORQUE_ENABLE, 0);
        }
        let in_mode = self.operating_mode(registers);
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
        let velocity = measured.rate / core::f64::consts::TAU * counts;
        Self::check_hardware(registers, measured);
        let runs = registers.get(r::TORQUE_ENABLE) == ON;
        if self.state.running != runs.then_some(in_mode) {
            self.state.running = runs.then_some(in_mode);
            self.state.profile = Profile::at(position);
            (self.state.duty, self.state.overload) = (0.0, 0);
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
            self.state.duty = demanded.clamp(-limit, limit);
            BridgeCommand::Duty(self.state.duty / FULL)
        } else {
            (self.state.profile.position, self.state.duty) = (position, 0.0);
            BridgeCommand::Open
        };
        let (threshold, unit) = self.series.moving_threshold;
        let moving = velocity.abs() > unit * f64::from(registers.get(threshold));
        registers.set_nearest(r::PRESENT_POSITION, shown);
        registers.set_nearest(r::PRESENT_VELOCITY, velocity);
        registers.set_nearest(r::PRESENT_LOAD, -self.state.duty);
        registers.set_nearest(r::PRESENT_VOLTAGE, 10.0 * measured.voltage);
        registers.set_nearest(r::PRESENT_TEMPERATURE, measured.temperature);
        registers.set_nearest(r::PRESENT_CURRENT, measured.current / CURRENT);
        registers.set(r::MOVING, i32::from(moving));
        registers.set_nearest(r::GOAL_POSITION_2, self.state.profile.position);
        bridge
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&self.state)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.state = snapshot.read()?;
        Ok(())
    }
}
