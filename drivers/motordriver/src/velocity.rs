use serde::{Deserialize, Serialize};

use crate::assumed::LAG_MAX;
use crate::smooth::FRACTION_BITS;
use crate::units::speed;

/// Ticks per second.
const TICKS: i32 = 1_000;
/// Maximum following error \[counts × 2^`FRACTION_BITS`\].
const LAG_LIMIT: i32 = LAG_MAX << FRACTION_BITS;

/// Set-point generator of velocity mode, in integer arithmetic, executed once per tick.
///
/// The speed approaches the commanded one at the rate of the register `MaxAcceleration`, within the
/// register `MaxSpeed`. The position set-point advances by the speed, without rounding: the
/// remainder of each tick is carried to the next. A shaft that follows therefore rotates at the
/// commanded speed by the clock of the board, without drift.
///
/// Only the following error is stored, not the set-point, which would overflow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Velocity {
    /// Commanded speed \[10⁻³ counts/s\].
    target: i32,
    /// Speed of the set-point \[10⁻³ counts/s\].
    speed: i32,
    /// Register `MaxSpeed` \[counts/s\].
    speed_max: u16,
    /// Register `MaxAcceleration` \[counts/s²\].
    acceleration_max: u16,
    /// Part of the set-point below its resolution \[10⁻⁶ counts × 2^`FRACTION_BITS`\].
    remainder: i64,
    /// Set-point minus position \[counts × 2^`FRACTION_BITS`\].
    lag: i32,
    /// Position of the last tick \[counts\], modulo 2³².
    position: i32,
    /// Displacement in the last tick \[counts\].
    travel: i32,
    /// Ticks at which the set-point waited for the shaft.
    stalled: u64,
}

impl Velocity {
    pub(crate) fn set_speed_max(&mut self, counts_per_second: u16) {
        self.speed_max = counts_per_second;
    }

    pub(crate) fn set_acceleration_max(&mut self, counts_per_second_squared: u16) {
        self.acceleration_max = counts_per_second_squared;
    }

    /// Receives the word of a speed.
    pub(crate) fn command(&mut self, word: u16) {
        let most = i32::from(self.speed_max);
        self.target = speed(word).clamp(-most, most) * TICKS;
    }

    /// Measures the displacement. Called once per tick, in every mode.
    pub(crate) fn observe(&mut self, position: i32) {
        self.travel = position.wrapping_sub(self.position);
        self.position = position;
    }

    /// Sets the commanded speed to 0 until the next command.
    pub(crate) fn stop(&mut self) {
        self.target = 0;
    }

    /// Sets the set-point to the present position and speed.
    pub(crate) fn resume(&mut self) {
        let most = i32::from(self.speed_max) * TICKS;
        let speed = self.travel.saturating_mul(TICKS * TICKS);
        self.speed = speed.clamp(-most, most);
        self.remainder = 0;
        self.lag = 0;
    }

    /// Advances the set-point by one tick. Returns the following error
    /// \[counts × 2^`FRACTION_BITS`\] and the displacement in this tick \[counts\].
    pub(crate) fn tick(&mut self) -> (i32, i32) {
        let change_max = i32::from(self.acceleration_max);
        self.speed += (self.target - self.speed).clamp(-change_max, change_max);
        let per_tick = i64::from(TICKS) * i64::from(TICKS);
        let advance = (i64::from(self.speed) << FRACTION_BITS) + self.remainder;
        self.remainder = advance.rem_euclid(per_tick);
        let lag = i64::from(self.lag) + advance.div_euclid(per_tick)
            - (i64::from(self.travel) << FRACTION_BITS);
        let limit = i64::from(LAG_LIMIT);
        let within = lag.clamp(-limit, limit);
        self.stalled += u64::from(within != lag);
        #[expect(clippy::cast_possible_truncation, reason = "within the clamp")]
        let within = within as i32;
        self.lag = within;
        (within, self.travel)
    }

    /// Returns the following error \[counts\].
    pub(crate) fn lag(&self) -> f64 {
        f64::from(self.lag) / f64::from(1 << FRACTION_BITS)
    }

    /// Returns the number of ticks at which the set-point waited for the shaft.
    pub(crate) fn stalled(&self) -> u64 {
        self.stalled
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn velocity(speed_max: u16, acceleration_max: u16) -> Velocity {
        let mut velocity = Velocity::default();
        velocity.set_speed_max(speed_max);
        velocity.set_acceleration_max(acceleration_max);
        velocity
    }

    /// Follows the set-point exactly, to whole counts. Returns the final position \[counts\].
    fn follow(velocity: &mut Velocity, ticks: u32) -> i64 {
        let (mut at, mut lag) = (i64::from(velocity.position), velocity.lag);
        for _ in 0..ticks {
            at += i64::from(lag >> FRACTION_BITS);
            #[expect(clippy::cast_possible_truncation, reason = "modulo 2³²")]
            velocity.observe(at as i32);
            lag = velocity.tick().0;
        }
        at + i64::from(lag >> FRACTION_BITS)
    }

    proptest! {
        /// The set-point advances by speed × time, whatever the speed and however long.
        #[test]
        fn set_point_has_no_drift(word in any::<i16>(), seconds in 1_u32..100) {
            let mut velocity = velocity(u16::MAX, u16::MAX);
            velocity.command(word.cast_unsigned());
            // From 0 to the speed takes at most a second.
            let begin = follow(&mut velocity, 1_001);
            let end = follow(&mut velocity, 1_000 * seconds);
            let expected = i64::from(word) * 2 * i64::from(seconds);
            // Whole counts at both ends.
            prop_assert!((end - begin - expected).abs() <= 1, "{} {expected}", end - begin);
            prop_assert_eq!(velocity.stalled(), 0);
        }

        #[test]
        fn nothing_overflows(
            word in any::<u16>(),
            positions in prop::collection::vec(any::<i32>(), 1..50),
        ) {
            let mut velocity = velocity(u16::MAX, u16::MAX);
            for position in positions {
                velocity.observe(position);
                velocity.resume();
                velocity.command(word);
                velocity.observe(position.wrapping_mul(3));
                prop_assert!(velocity.tick().0.abs() <= LAG_LIMIT);
            }
        }
    }

    #[test]
    fn speed_changes_at_the_maximum_acceleration() {
        let mut velocity = velocity(20_000, 10_000);
        velocity.command(10_000);
        // s = a t² / 2, by the rectangle rule of the ticks: a n (n + 1) / 2.
        let expected = 10_000.0 * 1e-6 * 1_000.0 * 1_001.0 / 2.0;
        let travelled = follow(&mut velocity, 1_000) as f64;
        assert!(
            (travelled - expected).abs() <= 1.0,
            "{travelled} {expected}"
        );
        assert_eq!(velocity.speed, 10_000 * 1_000);
    }

    #[test]
    fn blocked_shaft_is_reported_and_the_set_point_waits() {
        let mut velocity = velocity(32_000, 32_000);
        velocity.command(2_048);
        let mut lag = 0;
        for _ in 0..2_000 {
            velocity.observe(0);
            lag = velocity.tick().0;
        }
        assert_eq!(lag, LAG_LIMIT);
        // 4096 counts/s reach a quarter of a turn in 250 ms, and half of the 128 ms of the ramp.
        assert!(
            (1_680..1_690).contains(&velocity.stalled()),
            "{}",
            velocity.stalled()
        );
    }
}
