//! What a shaft does in a step, in closed form.

/// How fast rates decay, λ = damping over inertia, and what that makes of a step of h seconds.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Response {
    /// 1 − e^(−λh): how much nearer to its last the rate comes.
    pub(crate) risen: f64,
    /// ∫ e^(−λt) dt \[s\].
    pub(crate) once: f64,
    /// ∫ e^(−2λt) dt \[s\].
    pub(crate) twice: f64,
}

impl Response {
    /// In `seconds`, at `decay` = λ \[1/s\].
    pub(crate) fn new(decay: f64, seconds: f64) -> Self {
        if decay == 0.0 {
            return Self {
                risen: 0.0,
                once: seconds,
                twice: seconds,
            };
        }
        let risen = -libm::expm1(-decay * seconds);
        let once = risen / decay;
        Self {
            risen,
            once,
            // 1 − e^(−2λh) = risen (2 − risen)
            twice: 0.5 * once * (2.0 - risen),
        }
    }
}

/// A shaft under a torque at standstill that stays, and a damping that takes from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Course {
    /// Rate at the end \[rad/s\].
    pub(crate) rate: f64,
    /// Way \[rad\].
    pub(crate) turned: f64,
    /// ∫ ω² dt, by which what damps takes energy \[rad²/s\].
    pub(crate) squares: f64,
}

impl Course {
    /// From the rate `from` \[rad/s\] towards the rate `last` in `seconds`.
    ///
    /// ```text
    /// ω(t) = ω∞ + (ω₀ − ω∞) e^(−λt)
    /// ```
    pub(crate) fn new(from: f64, last: f64, response: &Response, seconds: f64) -> Self {
        let off = from - last;
        let Response { risen, once, twice } = *response;
        Self {
            rate: settled(from - off * risen),
            turned: last * seconds + off * once,
            squares: last * last * seconds + 2.0 * last * off * once + off * off * twice,
        }
    }
}

/// A rate \[rad/s\], zero where it is next to nothing.
pub(crate) fn settled(rate: f64) -> f64 {
    /// Slower than this a shaft is at rest: it would turn by a trillionth in the age of the universe, and numbers that go on
    /// and on towards zero are slow to compute with \[rad/s\].
    const REST: f64 = 1e-30;
    if rate.abs() < REST { 0.0 } else { rate }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_course_solves_the_equation_of_motion() {
        let (decay, from, last, seconds) = (600.0, -30.0, 80.0, 3e-3);
        let exact = Course::new(from, last, &Response::new(decay, seconds), seconds);
        let (n, mut rate, mut turned, mut squares) = (300_000, from, 0.0, 0.0);
        let h = seconds / f64::from(n);
        for _ in 0..n {
            let half = rate + 0.5 * h * decay * (last - rate);
            let next = rate + h * decay * (last - half);
            turned += h * half;
            squares += h * half * half;
            rate = next;
        }
        assert!((exact.rate - rate).abs() < 1e-8, "{exact:?} {rate}");
        assert!((exact.turned - turned).abs() < 1e-10, "{exact:?} {turned}");
        assert!(
            (exact.squares - squares).abs() < 1e-7,
            "{exact:?} {squares}"
        );
    }

    #[test]
    fn two_steps_make_one() {
        let (decay, last) = (600.0, 80.0);
        let step = |from: f64, seconds: f64| {
            Course::new(from, last, &Response::new(decay, seconds), seconds)
        };
        for (a, b) in [(1e-3, 2e-3), (1e-9, 1e-9), (1e-9, 1.0)] {
            let (first, whole) = (step(7.0, a), step(7.0, a + b));
            let second = step(first.rate, b);
            assert!((second.rate - whole.rate).abs() < 1e-13 * last);
            assert!((first.turned + second.turned - whole.turned).abs() < 1e-14 * last);
        }
    }

    #[test]
    fn without_damping_a_shaft_turns_on_and_short_steps_tend_to_that() {
        let free = Response::new(0.0, 1e-3);
        assert_eq!(Course::new(5.0, 0.0, &free, 1e-3).rate, 5.0);
        assert_eq!(Course::new(5.0, 0.0, &free, 1e-3).turned, 5e-3);
        let short = Response::new(600.0, 1e-9);
        assert!((short.risen - 6e-7).abs() < 1e-12 && (short.once - 1e-9).abs() < 1e-15);
    }
}
