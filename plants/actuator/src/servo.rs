use twinrig_robot::Servo;

/// Ratio of inner to outer loop gain: four makes the cascade critically damped.
const INNER_OVER_OUTER: f64 = 4.0;

/// A position servo with its inertia at the output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionServo {
    lag: f64,
    speed: f64,
    torque: f64,
    dead_band: f64,
    inertia: f64,
}

/// Invalid parameter of a servo.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("a servo's {parameter} cannot be {value}: {why}")]
pub struct ServoError {
    /// Name of the parameter.
    pub parameter: &'static str,
    /// Its value (SI).
    pub value: f64,
    /// Violated condition.
    pub why: &'static str,
}

impl PositionServo {
    /// Creates the servo of a robot file.
    ///
    /// # Errors
    /// [`ServoError`] where lag, speed, torque or inertia is not positive, or the dead band
    /// negative.
    pub fn new(servo: &Servo) -> Result<Self, ServoError> {
        for (parameter, value) in [
            ("lag", servo.lag),
            ("speed", servo.speed),
            ("torque", servo.torque),
            ("inertia", servo.inertia),
        ] {
            if value.is_nan() || value <= 0.0 {
                return Err(ServoError {
                    parameter,
                    value,
                    why: "it has to be positive",
                });
            }
        }
        if servo.dead_band.is_nan() || servo.dead_band < 0.0 {
            let why = "it cannot be negative";
            return Err(ServoError {
                parameter: "dead_band",
                value: servo.dead_band,
                why,
            });
        }
        let Servo {
            lag,
            speed,
            torque,
            dead_band,
            inertia,
        } = *servo;
        Ok(Self {
            lag,
            speed,
            torque,
            dead_band,
            inertia,
        })
    }

    /// Creates a servo without limits or dead band that lags by one control period \[s\].
    ///
    /// Commands arrive once a period: following them without lag would require infinite
    /// acceleration.
    ///
    /// # Errors
    /// [`ServoError`] where period or inertia is not positive.
    pub fn ideal(period: f64, inertia: f64) -> Result<Self, ServoError> {
        let unlimited = f64::INFINITY;
        Self::new(&Servo {
            lag: period,
            speed: unlimited,
            torque: unlimited,
            dead_band: 0.0,
            inertia,
        })
    }

    /// Returns the target rate after `step` seconds \[rad/s\], from command and position \[rad\]
    /// and rate \[rad/s\].
    ///
    /// By the implicit midpoint rule, which is stable at any step and exact in its steady state.
    pub fn rate_after(&self, step: f64, command: f64, position: f64, rate: f64) -> f64 {
        let error = command - position;
        let effective_error = if error.abs() > self.dead_band {
            error
        } else {
            0.0
        };
        let inner = step * INNER_OVER_OUTER / self.lag;
        let both = 0.5 * step / self.lag * inner;
        let unlimited_rate = (rate * (1.0 - 0.5 * inner - 0.5 * both)
            + 2.0 * both * effective_error / step)
            / (1.0 + 0.5 * inner + 0.5 * both);
        // If the error at the midpoint requires more than the greatest speed, the target is that
        // speed.
        let required = (effective_error - 0.25 * step * (rate + unlimited_rate)) / self.lag;
        if required.abs() > self.speed {
            (rate * (1.0 - 0.5 * inner) + inner * self.speed.copysign(required))
                / (1.0 + 0.5 * inner)
        } else {
            unlimited_rate
        }
    }

    /// Gain of the inner loop: requested acceleration per rate error \[1/s\].
    pub fn stiffness(&self) -> f64 {
        INNER_OVER_OUTER / self.lag
    }

    /// Greatest rate, without load \[rad/s\].
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Half-width of the error that is ignored \[rad\].
    pub fn dead_band(&self) -> f64 {
        self.dead_band
    }

    /// Delay behind a ramp \[s\].
    pub fn lag(&self) -> f64 {
        self.lag
    }

    /// Greatest torque at the output \[N·m\].
    pub fn torque(&self) -> f64 {
        self.torque
    }

    /// Inertia at the output \[kg·m²\].
    pub fn inertia(&self) -> f64 {
        self.inertia
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn servo(lag: f64, speed: f64, dead_band: f64) -> PositionServo {
        PositionServo::new(&Servo {
            lag,
            speed,
            torque: 2.0,
            dead_band,
            inertia: 1e-3,
        })
        .unwrap()
    }

    /// Position and rate after following `command(t)` for a second from rest, in steps of `h`.
    fn follow(servo: &PositionServo, h: f64, command: impl Fn(f64) -> f64) -> (f64, f64) {
        let (mut time, mut position, mut rate) = (0.0, 0.0, 0.0);
        while time < 1.0 - 0.5 * h {
            let next = servo.rate_after(h, command(time + 0.5 * h), position, rate);
            position += 0.5 * h * (rate + next);
            rate = next;
            time += h;
        }
        (position, rate)
    }

    #[test]
    fn delay_behind_a_ramp_equals_the_lag() {
        for h in [1e-5, 1e-3, 2e-3] {
            let (position, rate) = follow(&servo(0.02, 100.0, 0.0), h, |t| 3.0 * t);
            assert!((rate - 3.0).abs() < 1e-6);
            assert!((position - 3.0 * (1.0 - 0.02)).abs() < 1e-6, "{position}");
        }
    }

    #[test]
    fn step_response_has_no_overshoot_and_obeys_the_speed_limit() {
        let servo = servo(0.02, 6.545, 0.0);
        let (h, mut position, mut rate) = (1e-4, 0.0_f64, 0.0_f64);
        for _ in 0..10_000 {
            let next = servo.rate_after(h, 1.0, position, rate);
            position += 0.5 * h * (rate + next);
            rate = next;
            // The speed limit ends a step late: 6.5 rad/s · 1e-4 s.
            assert!(
                position <= 1.0 + 1e-4 && rate <= 6.545 + 1e-9,
                "{position} {rate}"
            );
        }
        assert!((position - 1.0).abs() < 1e-9);
    }

    #[test]
    fn step_response_is_critically_damped_and_converges_with_second_order() {
        // Poles at −2/lag, twice: position after t is 1 − (1 + 2t/lag) e^(−2t/lag).
        let lag = 0.05;
        let servo = servo(lag, 1e9, 0.0);
        let error = |h: f64| {
            let (mut position, mut rate) = (0.0, 0.0);
            let mut time = 0.0;
            while time < 0.04 - 0.5 * h {
                let next = servo.rate_after(h, 1.0, position, rate);
                position += 0.5 * h * (rate + next);
                rate = next;
                time += h;
            }
            let x: f64 = 2.0 * 0.04 / lag;
            (position - (1.0 - (1.0 + x) * libm::exp(-x))).abs()
        };
        assert!(
            error(1e-3) < 1e-3 && error(5e-4) < error(1e-3) / 3.5,
            "{} {}",
            error(1e-3),
            error(5e-4)
        );
    }

    #[test]
    fn error_inside_the_dead_band_is_ignored() {
        let servo = servo(0.02, 6.545, 0.005);
        assert_eq!(servo.rate_after(1e-3, 0.0049, 0.0, 0.0), 0.0);
        assert!(servo.rate_after(1e-3, 0.0051, 0.0, 0.0) > 0.0);
    }

    #[test]
    fn invalid_servos_are_rejected() {
        for (lag, speed, dead_band) in [
            (0.0, 1.0, 0.0),
            (1.0, -1.0, 0.0),
            (1.0, 1.0, -1.0),
            (f64::NAN, 1.0, 0.0),
        ] {
            assert!(
                PositionServo::new(&Servo {
                    lag,
                    speed,
                    torque: 1.0,
                    dead_band,
                    inertia: 1.0
                })
                .is_err()
            );
        }
    }
}
