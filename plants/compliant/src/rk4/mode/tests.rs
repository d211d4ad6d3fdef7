use super::*;
use crate::lanes::{Numbers, Portable, Quad, Simd};
use crate::rk4::weights::times;
use crate::rk4::{Fastest, StepControl, StepError, Substep, System};

/// A pair of motions with a mode that need not be their own, and the integral of the first.
#[derive(Clone, Copy)]
struct Pair {
    /// ẏ, by the time since the start and y.
    rates: fn(f64, [f64; 2]) -> [f64; 2],
    /// Begin of the step \[s\].
    begin: f64,
    mode: Option<Along2>,
    area: f64,
}

/// Rate, vector and covector.
#[derive(Clone, Copy)]
struct Along2 {
    rate: f64,
    vector: [f64; 2],
    covector: [f64; 2],
}

fn lanes(value: f64) -> Numbers {
    Portable.splat(value)
}

fn first(lanes: Numbers) -> f64 {
    lanes.quad().0[0]
}

impl Mode for Along2 {
    type State = [f64; 2];
    type Slope = [f64; 2];
    type Lanes = Numbers;

    fn rate(&self) -> Numbers {
        lanes(self.rate)
    }

    fn part(&self, slope: &[f64; 2]) -> Numbers {
        lanes(self.covector[0] * slope[0] + self.covector[1] * slope[1])
    }

    fn added(&self, state: &[f64; 2], amount: Numbers) -> [f64; 2] {
        [0, 1].map(|i| state[i] + self.vector[i] * first(amount))
    }
}

impl System for Pair {
    type State = [f64; 2];
    type Slope = [f64; 2];
    type Mode = Along2;

    fn mode(&self, _: &[f64; 2], _: &[f64; 2]) -> Option<Along2> {
        self.mode
    }

    fn slope(&self, time: f64, state: &[f64; 2]) -> [f64; 2] {
        (self.rates)(self.begin + time, *state)
    }

    fn along<const M: usize>(
        state: &[f64; 2],
        slopes: [&[f64; 2]; M],
        seconds: [f64; M],
    ) -> [f64; 2] {
        let mut next = *state;
        for (slope, seconds) in slopes.into_iter().zip(seconds) {
            next = [0, 1].map(|i| next[i] + slope[i] * seconds);
        }
        next
    }

    fn error(
        &self,
        _: f64,
        slopes: [&[f64; 2]; 5],
        seconds: [f64; 5],
        missed: Option<Missed<'_, Along2>>,
    ) -> f64 {
        let mut error = Self::along(&[0.0; 2], slopes, seconds);
        if let Some(Missed { mode, amount, .. }) = missed {
            error = mode.added(&error, amount);
        }
        error[0].abs() + error[1].abs()
    }

    fn fastest(&self, _: [&[f64; 2]; 2], _: [&[f64; 2]; 2]) -> Fastest {
        Fastest::new(&[Quad::splat(0.0)], &[Quad::splat(0.0)])
    }

    fn accept(&mut self, substep: &Substep<'_, Self>) -> u64 {
        // The rate of the first is the integrand.
        for (slope, share) in substep.slopes.into_iter().zip(substep.shares) {
            self.area += slope[0] * share;
        }
        if let Some(Unseen { mode, integrals }) = substep.unseen {
            self.area += mode.vector[0] * mode.rate * first(integrals[0]);
        }
        0
    }
}

impl Pair {
    fn new(rates: fn(f64, [f64; 2]) -> [f64; 2], mode: Option<Along2>) -> Self {
        Self {
            rates,
            begin: 0.0,
            mode,
            area: 0.0,
        }
    }

    /// Returns the state after some steps.
    fn run(
        &mut self,
        start: [f64; 2],
        steps: u32,
        seconds: f64,
        tolerance: f64,
    ) -> Result<([f64; 2], StepControl), StepError> {
        let (mut state, mut control) = (start, StepControl::new(tolerance));
        for step in 0..steps {
            self.begin = f64::from(step) * seconds;
            control.advance(self, &mut state, &mut None, seconds)?;
        }
        Ok((state, control))
    }
}

/// A stiff motion towards sin t, and one that follows it.
fn towards_sine(t: f64, [x, y]: [f64; 2]) -> [f64; 2] {
    [2e4 * (libm::sin(t) - x) + libm::cos(t), x - y]
}

const STIFF: Along2 = Along2 {
    rate: -2e4,
    vector: [1.0, -1.0 / (2e4 - 1.0)],
    covector: [1.0, 0.0],
};

#[test]
fn stiff_motion_has_its_closed_form_in_long_substeps() {
    // ẏ = sin t − y, and the remainder of x.
    let exact = |t: f64| {
        let (s, c) = (libm::sin(t), libm::cos(t));
        [s, 0.5 * (s - c) + 0.5 * libm::exp(-t)]
    };
    let mut pair = Pair::new(towards_sine, Some(STIFF));
    let ([x, y], control) = pair.run([0.0, 0.0], 200, 1e-3, f64::INFINITY).unwrap();
    let [sine, lag] = exact(0.2);
    assert_eq!(control.work.accepted, 200);
    assert!(
        (x - sine).abs() < 1e-12 && (y - lag).abs() < 1e-12,
        "{x} {y}"
    );
    // From afar the motion decays within the first of them, and its integrand with it.
    let mut pair = Pair::new(towards_sine, Some(STIFF));
    let ([x, y], _) = pair.run([1.0, 0.0], 200, 1e-3, f64::INFINITY).unwrap();
    let lag = lag + libm::exp(-0.2) / (2e4 - 1.0);
    assert!(
        (x - sine).abs() < 1e-12 && (y - lag).abs() < 1e-9,
        "{x} {y}"
    );
    assert!((pair.area - (x - 1.0)).abs() < 1e-9, "{}", pair.area);
}

/// Weighted sums over the stages and what they do not contain are the closed forms of ∫x dt and
/// ∫x² dt, with x = exp λt − 1.
#[test]
fn integrals_along_a_decay_have_their_closed_forms() {
    let mode = Along2 {
        rate: -800.0,
        vector: [1.0, 0.0],
        covector: [1.0, 0.0],
    };
    for h in [0.7e-3, 3e-3, 20e-3] {
        let z = mode.rate * h;
        let slope = |state: &[f64; 2]| [mode.rate * state[0], 0.0];
        let start = [1.0, 0.0];
        let k1 = slope(&start);
        let mut along = Along::new(mode, &k1, h).unwrap();
        let second = along.second(&Pair::along(&start, [&k1], times(SECOND, h)));
        let k2 = slope(&second);
        let third = along.third(&Pair::along(&start, [&k1, &k2], times(THIRD, h)), &k2);
        let k3 = slope(&third);
        let slopes = [&k1, &k2, &k3];
        let fourth = along.fourth(&Pair::along(&start, slopes, times(FOURTH, h)), &k3);
        let k4 = slope(&fourth);
        let slopes = [&k1, &k2, &k3, &k4];
        along.end(&Pair::along(&start, slopes, times(MEAN, h)), &k4);
        let [linear, square] = along.unseen().integrals.map(first);
        let stages = [second, third, fourth].map(|state| state[0] - 1.0);
        let sum = |power: i32| -> f64 {
            let parts = stages.iter().zip(&MEAN[1..]);
            let parts = parts.map(|(x, weight)| weight * h * libm::pow(*x, f64::from(power)));
            parts.sum()
        };
        let [once, twice] = [z, 2.0 * z].map(|z| libm::expm1(z) / mode.rate);
        assert!((sum(1) + linear - (once - h)).abs() < 1e-12 * h, "{h}");
        let expected = 0.5 * twice - 2.0 * once + h;
        assert!((sum(2) + square - expected).abs() < 1e-12 * h, "{h}");
    }
}

#[test]
fn without_the_mode_the_same_motion_needs_short_substeps() {
    let mut explicit = Pair::new(towards_sine, None);
    let far = explicit.run([1.0, 0.0], 200, 1e-3, f64::INFINITY);
    assert!(!far.is_ok_and(|([x, _], _)| x.abs() < 1e3));
    let substeps = |mode: Option<Along2>| {
        let (_, control) = Pair::new(towards_sine, mode)
            .run([0.0, 0.0], 200, 1e-3, 1e-6)
            .unwrap();
        control.work.accepted + control.work.rejected
    };
    let (explicit, exponential) = (substeps(None), substeps(Some(STIFF)));
    assert!(
        exponential == 200 && explicit > 1200,
        "{exponential} {explicit}"
    );
}

/// A smooth motion, to which any mode is foreign.
fn swing(t: f64, [x, y]: [f64; 2]) -> [f64; 2] {
    [y + 0.3 * libm::cos(2.0 * t) * x * x, -x - 0.2 * x * y * y]
}

#[test]
fn order_is_four_with_any_mode() {
    let ([x, y], _) = Pair::new(swing, None)
        .run([0.7, 0.2], 10_000, 1e-3, f64::INFINITY)
        .unwrap();
    for vector in [[1.0, 0.0], [0.4, 0.6], [2.0, -1.0]] {
        let mode = Along2 {
            rate: -2.1,
            vector,
            covector: [1.0, 1.0],
        };
        let mut errors = Vec::new();
        for steps in [10, 20, 40] {
            let ([a, b], control) = Pair::new(swing, Some(mode))
                .run([0.7, 0.2], steps, 10.0 / f64::from(steps), f64::INFINITY)
                .unwrap();
            assert_eq!(control.work.accepted, u64::from(steps));
            errors.push(libm::hypot(a - x, b - y));
        }
        // From below, as the mode is slow against the last substeps only.
        let order = libm::log2(errors[1] / errors[2]);
        assert!(order > 3.3, "{vector:?}: {order} {errors:?}");
        assert!(errors[2] < 2e-2, "{errors:?}");
    }
}

/// φ₁ … φ₄ by their series.
fn phi(k: i32, z: f64) -> f64 {
    let mut term = 1.0;
    for n in 1..=k {
        term /= f64::from(n);
    }
    let mut sum = 0.0;
    for n in 1..200 {
        sum += term;
        term *= z / f64::from(k + n);
    }
    sum
}

/// Moments of weights of the slopes after the first.
fn moment(weights: &[Numbers], power: i32) -> f64 {
    let nodes = [0.25, 0.6, 1.0];
    let parts = nodes.iter().zip(weights);
    parts
        .map(|(node, weight)| libm::pow(*node, f64::from(power)) * first(*weight))
        .sum()
}

#[test]
fn weights_integrate_polynomials_and_become_the_explicit_ones() {
    for z in [-0.5, -1.0, -4.0, -12.0] {
        let weights = Weights::new(lanes(z));
        let end = &weights.end[1..];
        assert!((first(weights.end[0]) - phi(1, z)).abs() < 1e-12);
        assert!((first(weights.second[0]) - 0.25 * phi(1, 0.25 * z)).abs() < 1e-12);
        assert!((first(weights.third[0]) - 0.6 * phi(1, 0.6 * z)).abs() < 1e-12);
        assert!((moment(end, 1) - phi(2, z)).abs() < 1e-12, "{z}");
        assert!((moment(end, 2) - 2.0 * phi(3, z)).abs() < 1e-11, "{z}");
        for (decay, share) in weights.decays.into_iter().zip([0.25, 0.6, 1.0]) {
            assert!((first(decay) / libm::exp(share * z) - 1.0).abs() < 1e-12);
        }
    }
    let [near, far] = [-0.1, -0.2].map(|z| Weights::new(lanes(z)));
    let rows: [(&[Numbers], &[Numbers], &[f64]); 3] = [
        (&near.third, &far.third, &THIRD),
        (&near.fourth, &far.fourth, &FOURTH),
        (&near.end, &far.end, &MEAN),
    ];
    for (near, far, explicit) in rows {
        // That of the first slope is φ₁, from which the others are taken.
        for j in 1..explicit.len() {
            let at_zero = 2.0 * first(near[j]) - first(far[j]);
            assert!(
                (at_zero - explicit[j]).abs() < 2e-2,
                "{at_zero} {}",
                explicit[j]
            );
        }
    }
}

#[test]
fn weights_satisfy_the_conditions_that_an_explicit_method_does_not_have() {
    let defects = |z: f64| {
        let weights = Weights::new(lanes(z));
        let second = -0.0625 * phi(2, 0.25 * z);
        let third = moment(&weights.third[1..], 1) - 0.36 * phi(2, 0.6 * z);
        let fourth = moment(&weights.fourth[1..], 1) - phi(2, z);
        let end = [1, 2, 3].map(|j| first(weights.end[j]));
        ([second, third, fourth], end)
    };
    // Extrapolated difference quotients at zero.
    let near = |z: f64| {
        let ((e0, b0), (e1, b1)) = (defects(-z), defects(-2.0 * z));
        let mut sums = [0.0; 2];
        for j in 0..3 {
            sums[0] += MEAN[j + 1] * (e0[j] - e1[j]) / z;
            sums[1] += (b0[j] - b1[j]) / z * (2.0 * e0[j] - e1[j]);
        }
        sums
    };
    let [far, middle, close] = [0.4, 0.2, 0.1].map(near);
    let sums = far.into_iter().zip(middle).zip(close);
    for ((far, middle), close) in sums {
        let [a, b] = [2.0 * middle - far, 2.0 * close - middle];
        let at_zero = (4.0 * b - a) / 3.0;
        assert!(at_zero.abs() < 1e-4, "{at_zero}");
    }
}
