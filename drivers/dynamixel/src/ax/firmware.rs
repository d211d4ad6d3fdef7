//! The inner loops of the AX series.
//!
//! | part | status |
//! |---|---|
//! | duty cycle by margin, slope and punch | documented, not compared |
//! | speed of the set-point | documented, not compared |
//! | both angle limits 0: duty cycle by the moving speed | documented, not compared |
//! | shutdown | documented, not compared; duration of an overload ASSUMED |
//!
//! That the counterclockwise margin and slope are those of positive errors is ASSUMED, and that a
//! position beyond the range of 300° is that of its end.

use serde::{Deserialize, Serialize};
use twinrig_kernel::{LocalDuration, Snapshot, SnapshotError};

use super::register as r;
use crate::firmware::{BridgeCommand, ServoFirmware, ServoMeasurements};
use crate::profile::{Profile, ProfileLimits};
use crate::registers::Registers;

/// Period of the loops. ASSUMED.
const PERIOD: LocalDuration = LocalDuration::from_nanos(1_000_000);
const PERIOD_S: f64 = 1e-3;

/// Greatest position.
pub(super) const GREATEST: i32 = 1_023;
/// Counts of a turn, of which the position covers 300°.
pub(super) const COUNTS: f64 = 1_024.0 * 360.0 / 300.0;
/// Position of the shaft at angle 0.
pub(super) const CENTRE: i32 = 512;
/// Duty cycle at 100 %.
const FULL: f64 = 1_023.0;
/// Unit of speeds: 0.111 rev/min, in counts per second.
const SPEED: f64 = 0.111 / 60.0 * COUNTS;
/// Time for which the duty cycle is at its limit without motion before it is an overload, in
/// periods. ASSUMED.
const OVERLOAD: u32 = 1_000;

/// Bits of the hardware error.
mod error {
    pub(super) const INPUT_VOLTAGE: u8 = 1 << 0;
    pub(super) const OVERHEATING: u8 = 1 << 2;
    pub(super) const OVERLOAD: u8 = 1 << 5;
}

/// Inner loops of a servo of the AX series.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AxFirmware {
    /// Whether the loops run.
    runs: bool,
    profile: Profile,
    /// Duty cycle.
    duty: f64,
    /// Periods at the limit without motion.
    overload: u32,
}

impl AxFirmware {
    /// Returns the duty cycle that the position demands.
    fn position_loop(&mut self, registers: &Registers, position: f64) -> f64 {
        let get = |address| f64::from(registers.get(address));
        let goal = get(r::GOAL_POSITION);
        let speed = get(r::MOVING_SPEED).abs() * SPEED;
        if speed == 0.0 {
            self.profile = Profile::at(goal);
        } else {
            let limits = ProfileLimits {
                speed,
                acceleration: 0.0,
            };
            self.profile.approach(goal, limits, PERIOD_S);
        }
        let error = libm::rint(self.profile.position) - position;
        let [margin, slope] = if error < 0.0 {
            [r::CW_COMPLIANCE_MARGIN, r::CW_COMPLIANCE_SLOPE]
        } else {
            [r::CCW_COMPLIANCE_MARGIN, r::CCW_COMPLIANCE_SLOPE]
        };
        let beyond = error.abs() - get(margin);
        if beyond <= 0.0 {
            return 0.0;
        }
        let punch = get(r::PUNCH);
        let share = beyond / f64::from(representative(registers.get(slope)));
        (punch + (FULL - punch) * share.min(1.0)).copysign(error)
    }

    /// Finds hardware errors, and sets the torque limit to 0 for those that it watches for.
    fn check_hardware(
        &mut self,
        registers: &mut Registers,
        measured: &ServoMeasurements,
        velocity: f64,
    ) {
        let get = |address| f64::from(registers.get(address));
        let decivolts = libm::rint(10.0 * measured.voltage);
        let mut found = 0;
        if !(get(r::MIN_VOLTAGE_LIMIT)..=get(r::MAX_VOLTAGE_LIMIT)).contains(&decivolts) {
            found |= error::INPUT_VOLTAGE;
        }
        if measured.temperature > get(r::TEMPERATURE_LIMIT) {
            found |= error::OVERHEATING;
        }
        let limit = get(r::TORQUE_LIMIT);
        let stalls = limit > 0.0 && self.duty.abs() >= limit && velocity.abs() < SPEED;
        if stalls {
            self.overload = self.overload.saturating_add(1);
        } else if limit > 0.0 {
            self.overload = 0;
        }
        // After a shutdown it lasts until the torque limit is set again.
        if self.overload > OVERLOAD {
            found |= error::OVERLOAD;
        }
        registers.set_alarms(found);
        if i32::from(found) & registers.get(r::SHUTDOWN) != 0 {
            registers.set(r::TORQUE_LIMIT, 0);
        }
    }
}

/// Returns the width of the proportional range for a value of its register: a power of 2.
fn representative(slope: i32) -> i32 {
    1 << slope.clamp(2, 128).ilog2()
}

impl ServoFirmware for AxFirmware {
    fn period(&self) -> LocalDuration {
        PERIOD
    }

    fn step(
        &mut self,
        registers: &mut Registers,
        measured: &ServoMeasurements,
        _: u64,
    ) -> BridgeCommand {
        let encoder = measured.angle / core::f64::consts::TAU * COUNTS + f64::from(CENTRE);
        let position = libm::rint(encoder).clamp(0.0, f64::from(GREATEST));
        let velocity = measured.rate / core::f64::consts::TAU * COUNTS;
        self.check_hardware(registers, measured, velocity);
        let turns = [r::CW_ANGLE_LIMIT, r::CCW_ANGLE_LIMIT].map(|it| registers.get(it)) == [0, 0];
        let runs = registers.get(r::TORQUE_ENABLE) != 0;
        if !runs || !self.runs || turns {
            self.profile = Profile::at(position);
        }
        self.runs = runs;
        let bridge = if runs {
            let demanded = if turns {
                f64::from(registers.get(r::MOVING_SPEED))
            } else {
                self.position_loop(registers, position)
            };
            let limit = f64::from(registers.get(r::TORQUE_LIMIT));
            self.duty = demanded.clamp(-limit, limit);
            BridgeCommand::Duty(self.duty / FULL)
        } else {
            self.duty = 0.0;
            BridgeCommand::Open
        };
        let goal = f64::from(registers.get(r::GOAL_POSITION));
        let moves = runs && !turns && self.profile.position != goal || velocity.abs() >= SPEED;
        registers.set_nearest(r::PRESENT_POSITION, position);
        let speed = if turns { self.duty } else { velocity / SPEED };
        registers.set_nearest(r::PRESENT_SPEED, speed);
        registers.set_nearest(r::PRESENT_LOAD, self.duty);
        registers.set_nearest(r::PRESENT_VOLTAGE, 10.0 * measured.voltage);
        registers.set_nearest(r::PRESENT_TEMPERATURE, measured.temperature);
        registers.set(r::MOVING, moves.into());
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
