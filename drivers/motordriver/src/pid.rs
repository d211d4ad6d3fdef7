use serde::{Deserialize, Serialize};

use crate::assumed::{
    D_FACTOR, DUTY_PER_COUNT_IN_A_TICK, DUTY_PER_TORQUE_UNIT, GAIN_BITS, P_FACTOR,
};
use crate::smooth::FRACTION_BITS;

/// Full supply voltage; the unit of duty is 1/32768 of it.
pub(crate) const DUTY_MAX: i32 = 32_767;

/// Gains of a motor as stored in its registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Gains {
    pub(crate) p: u16,
    pub(crate) i: u16,
    pub(crate) d: u16,
    pub(crate) torque_max: u16,
}

/// Position controller of one motor, in integer arithmetic, executed once per tick.
///
/// The duty is limited by the supply, and by the register `MaxTorque`, which limits the current i =
/// (V − kω)/R, with ω from the encoder. The integral is frozen while the error drives it further
/// into the active limit (anti-windup).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Pid {
    /// Σe, in counts × 2^`FRACTION_BITS`.
    sum: i64,
    /// Error e of the last tick.
    last: i32,
    /// Position of the last tick \[counts\].
    position: i32,
}

impl Pid {
    /// Creates a controller at rest at a position, with zero error.
    pub(crate) fn resting_at(position: i32) -> Self {
        Self {
            position,
            ..Self::default()
        }
    }

    /// Returns the duty of this tick for the set-point \[counts × 2^`FRACTION_BITS`\] and the
    /// position \[counts\].
    pub(crate) fn tick(&mut self, gains: Gains, set_point: i32, position: i32) -> i32 {
        let error = set_point.saturating_sub(position << FRACTION_BITS);
        let travel = position.wrapping_sub(self.position);
        self.position = position;
        self.correct(gains, error, travel)
    }

    /// Returns the duty of this tick for the error \[counts × 2^`FRACTION_BITS`\] and the travel
    /// since the last tick \[counts\].
    pub(crate) fn correct(&mut self, gains: Gains, error: i32, travel: i32) -> i32 {
        let change = i64::from(error) - i64::from(self.last);
        self.last = error;

        // The integral term is limited to the full supply.
        let sum_max = i64::from(DUTY_MAX) << (GAIN_BITS + FRACTION_BITS) >> u32::from(gains.i != 0);
        let sum = self.sum + i64::from(error) * i64::from(gains.i);
        let sum = sum.clamp(-sum_max, sum_max);
        let requested = P_FACTOR * i64::from(gains.p) * i64::from(error)
            + sum
            + D_FACTOR * i64::from(gains.d) * change;
        let requested = requested >> (GAIN_BITS + FRACTION_BITS);

        let back_emf = travel.saturating_mul(DUTY_PER_COUNT_IN_A_TICK);
        let span = i32::from(gains.torque_max) * DUTY_PER_TORQUE_UNIT;
        let least = back_emf.saturating_sub(span).clamp(-DUTY_MAX, DUTY_MAX);
        let most = back_emf.saturating_add(span).clamp(-DUTY_MAX, DUTY_MAX);
        let duty = requested.clamp(i64::from(least), i64::from(most));
        let winds_up = requested > duty && error > 0 || requested < duty && error < 0;
        if !winds_up {
            self.sum = sum;
        }
        #[expect(clippy::cast_possible_truncation, reason = "within the clamp")]
        let duty = duty as i32;
        duty
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::{FRAC_1_SQRT_2 as HALF_POWER, TAU};

    use super::*;

    const DEFAULT: Gains = Gains {
        p: 400,
        i: 20,
        d: 200,
        torque_max: 1_100,
    };

    /// Unloaded or loaded motor of the robot behind its gear, integrated exactly over a tick.
    #[derive(Default)]
    struct Motor {
        angle: f64,
        rate: f64,
        load: f64,
        load_inertia: f64,
    }

    const COUNT: f64 = TAU / 4_096.0;
    const CONSTANT: f64 = 14.05e-3 * 14.0;
    const RESISTANCE: f64 = 0.593;
    const INERTIA: f64 = 5.54e-7 * 196.0;

    impl Motor {
        fn tick(&mut self, duty: i32) {
            let volts = 24.0 / 32_768.0 * f64::from(duty);
            let damping = CONSTANT * CONSTANT / RESISTANCE;
            let end = (CONSTANT / RESISTANCE * volts - self.load) / damping;
            let tau = (INERTIA + self.load_inertia) / damping;
            let rest = libm::exp(-1e-3 / tau);
            self.angle += end * 1e-3 + (self.rate - end) * tau * (1.0 - rest);
            self.rate = end + (self.rate - end) * rest;
        }

        fn counts(&self) -> i32 {
            #[expect(clippy::cast_possible_truncation, reason = "small")]
            let counts = (self.angle / COUNT).round() as i32;
            counts
        }
    }

    /// Returns the positions \[counts\] of a controlled motor.
    fn follow(
        gains: Gains,
        mut motor: Motor,
        ticks: u32,
        set_point: impl Fn(u32) -> f64,
    ) -> Vec<f64> {
        let mut pid = Pid::resting_at(motor.counts());
        (0..ticks)
            .map(|n| {
                #[expect(clippy::cast_possible_truncation, reason = "small")]
                let set_point = (set_point(n) * 256.0) as i32;
                let duty = pid.tick(gains, set_point, motor.counts());
                motor.tick(duty);
                motor.angle / COUNT
            })
            .collect()
    }

    /// Returns the gain of the closed loop for a sine of 40 counts.
    fn gain_at(hertz: f64) -> f64 {
        let positions = follow(DEFAULT, Motor::default(), 4_000, |n| {
            40.0 * libm::sin(TAU * hertz * 1e-3 * f64::from(n))
        });
        let (mut re, mut im) = (0.0, 0.0);
        for (n, position) in positions.iter().enumerate().skip(2_000) {
            let (sin, cos) = libm::sincos(TAU * hertz * 1e-3 * n as f64);
            re += position * cos / 1_000.0;
            im += position * sin / 1_000.0;
        }
        libm::hypot(re, im) / 40.0
    }

    #[test]
    fn closed_loop_bandwidth_is_30_to_60_hz_without_peak() {
        for (hertz, least, most) in [
            (5.0, 0.95, 1.05),
            (30.0, HALF_POWER, 1.05),
            (60.0, 0.3, HALF_POWER),
        ] {
            let gain = gain_at(hertz);
            assert!((least..most).contains(&gain), "{gain} at {hertz} Hz");
        }
    }

    #[test]
    fn step_response_is_damped() {
        let positions = follow(DEFAULT, Motor::default(), 500, |_| 50.0);
        let top = positions.iter().copied().fold(0.0, f64::max);
        assert!(top < 53.0, "{top}");
        assert!(
            positions[60..]
                .iter()
                .all(|position| (position - 50.0).abs() < 2.0)
        );
        // With a load of twice the motor's inertia behind the gear.
        let heavy = Motor {
            load_inertia: 2e-4,
            ..Motor::default()
        };
        let positions = follow(DEFAULT, heavy, 500, |_| 50.0);
        let top = positions.iter().copied().fold(0.0, f64::max);
        assert!(top < 55.0, "{top}");
    }

    #[test]
    fn integral_compensates_a_load_of_two_newton_metres() {
        let loaded = Motor {
            load: 2.0,
            ..Motor::default()
        };
        let positions = follow(DEFAULT, loaded, 2_000, |_| 0.0);
        assert!(positions.iter().all(|position| *position > -80.0));
        assert!(
            positions[1_000..]
                .iter()
                .all(|position| position.abs() < 3.0)
        );
    }

    #[test]
    fn current_stays_within_the_torque_limit() {
        let gains = Gains {
            torque_max: 500,
            ..DEFAULT
        };
        let (mut pid, mut motor) = (Pid::default(), Motor::default());
        for n in 0..300 {
            let duty = pid.tick(gains, 1_000 << FRACTION_BITS, motor.counts());
            let back = CONSTANT * motor.rate;
            let current = (24.0 / 32_768.0 * f64::from(duty) - back) / RESISTANCE;
            // 10 A; the rate is measured with a resolution of one count, and one tick late.
            assert!(current < 10.0 + 1.0, "{current} A at tick {n}");
            motor.tick(duty);
        }
        assert!(motor.counts() > 900);
    }

    #[test]
    fn saturation_does_not_wind_up_the_integral() {
        // Blocked for 2 s by a load above its torque limit, then released.
        let gains = Gains {
            torque_max: 100,
            ..DEFAULT
        };
        let mut pid = Pid::default();
        for _ in 0..2_000 {
            pid.tick(gains, 100 << FRACTION_BITS, 0);
        }
        assert!(pid.sum.abs() <= 100 * 256 * 20);
        let mut motor = Motor::default();
        let mut top = 0.0_f64;
        for _ in 0..500 {
            motor.tick(pid.tick(gains, 100 << FRACTION_BITS, motor.counts()));
            top = top.max(motor.angle / COUNT);
        }
        assert!(top < 115.0, "{top}");
    }

    #[test]
    fn extreme_registers_and_positions_do_not_overflow() {
        for extreme in [i32::MIN >> FRACTION_BITS, 0, i32::MAX >> FRACTION_BITS] {
            let gains = Gains {
                p: u16::MAX,
                i: u16::MAX,
                d: u16::MAX,
                torque_max: u16::MAX,
            };
            let mut pid = Pid::resting_at(extreme);
            for n in 0..100 {
                let set_point = if n % 2 == 0 { i32::MAX } else { i32::MIN };
                assert!(pid.tick(gains, set_point, extreme).abs() <= DUTY_MAX);
            }
        }
    }
}
