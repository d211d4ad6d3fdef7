//! Response of a shaft in a step, in closed form.

/// Exponential decay of rates with λ = damping / inertia, over a step of h seconds.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Response {
    /// 1 − e^(−λh): share of the distance to the final rate that is covered.
    pub(crate) rise: f64,
    /// ∫ e^(−λt) dt \[s\].
    pub(crate) integral: f64,
    /// ∫ e^(−2λt) dt \[s\].
    pub(crate) square_integral: f64,
}

impl Response {
    /// Response over `seconds`, at `decay` = λ \[1/s\].
    pub(crate) fn new(decay: f64, seconds: f64) -> Self {
        if decay == 0.0 {
            return Self {
                rise: 0.0,
                integral: seconds,
                square_integral: seconds,
            };
        }
        let rise = -libm::expm1(-decay * seconds);
        let integral = rise / decay;
        Self {
            rise,
            integral,
            // 1 − e^(−2λh) = rise (2 − rise)
            square_integral: 0.5 * integral * (2.0 - rise),
        }
    }
}

/// Motion of a shaft under a constant standstill torque and a viscous damping.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Course {
    /// Rate at the end \[rad/s\].
    pub(crate) rate: f64,
    /// Angle travelled \[rad\].
    pub(crate) travel: f64,
    /// ∫ ω² dt, proportional to the energy that damping dissipates \[rad²/s\].
    pub(crate) squares: f64,
}

impl Course {
    /// Motion from the rate `from` \[rad/s\] towards the rate `last` in `seconds`.
    ///
    /// ```text
    /// ω(t) = ω∞ + (ω₀ − ω∞) e^(−λt)
    /// ```
    pub(crate) fn new(from: f64, last: f64, response: &Response, seconds: f64) -> Self {
        let difference = from - last;
        let Response {
            rise,
            integral,
            square_integral,
        } = *response;
        Self {
            rate: flush_to_zero(from - difference * rise),
            travel: last * seconds + difference * integral,
            squares: last * last * seconds
                + 2.0 * last * difference * integral
                + difference * difference * square_integral,
        }
    }
}

/// Flushes a negligible rate to zero \[rad/s\].
pub(crate) fn flush_to_zero(rate: f64) -> f64 {
    /// Rate below which a shaft is at rest \[rad/s\]: the travel in the age of the universe would
    /// be 1e-12 rad, and subnormal numbers are slow to compute with.
    const RATE_MIN: f64 = 1e-30;
    if rate.abs() < RATE_MIN { 0.0 } else { rate }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn course_solves_the_equation_of_motion() {
        let (decay, from, last, seconds) = (600.0, -30.0, 80.0, 3e-3);
        let exact = Course::new(from, last, &Response::new(decay, seconds), seconds);
        let (n, mut rate, mut travel, mut squares) = (300_000, from, 0.0, 0.0);
        let h = seconds / f64::from(n);
        for _ in 0..n {
            let half = rate + 0.5 * h * decay * (last - rate);
            let next = rate + h * decay * (last - half);
            travel += h * half;
            squares += h * half * half;
            rate = next;
        }
        assert!((exact.rate - rate).abs() < 1e-8, "{exact:?} {rate}");
        assert!((exact.travel - travel).abs() < 1e-10, "{exact:?} {travel}");
        assert!(
            (exact.squares - squares).abs() < 1e-7,
            "{exact:?} {squares}"
        );
    }

    #[test]
    fn two_steps_equal_one_step_of_their_sum() {
        let (decay, last) = (600.0, 80.0);
        let step = |from: f64, seconds: f64| {
            Course::new(from, last, &Response::new(decay, seconds), seconds)
        };
        for (a, b) in [(1e-3, 2e-3), (1e-9, 1e-9), (1e-9, 1.0)] {
            let (first, single) = (step(7.0, a), step(7.0, a + b));
            let second = step(first.rate, b);
            assert!((second.rate - single.rate).abs() < 1e-13 * last);
            assert!((first.travel + second.travel - single.travel).abs() < 1e-14 * last);
        }
    }

    #[test]
    fn undamped_shaft_keeps_its_rate_and_is_the_limit_of_short_steps() {
        let free = Response::new(0.0, 1e-3);
        assert_eq!(Course::new(5.0, 0.0, &free, 1e-3).rate, 5.0);
        assert_eq!(Course::new(5.0, 0.0, &free, 1e-3).travel, 5e-3);
        let short = Response::new(600.0, 1e-9);
        assert!((short.rise - 6e-7).abs() < 1e-12 && (short.integral - 1e-9).abs() < 1e-15);
    }
}
