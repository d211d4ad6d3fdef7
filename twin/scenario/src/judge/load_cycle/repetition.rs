//! The period of a gait: the time after which the loads of its feet repeat.
//!
//! Three windows one period apart have the same first Fourier coefficient if the loads repeat after
//! the period. A harmonic of a gait repeats as well, and so does its double period; the former is
//! shorter, and in the latter a regular gait has no component.

use std::f64::consts::{PI, TAU};

use super::history::{Bin, History, LANES, Lanes, Quantity};

/// Longest and shortest period that are searched \[s\]. A trot at 0.25 Hz is the slowest of figure
/// 3.7 of the thesis.
pub(super) const LONGEST_S: f64 = 5.0;
const SHORTEST_S: f64 = 0.1;
/// Number of periods that are searched, at a constant ratio of 2^(1/6): with half a step between a
/// period and the nearest searched one, coefficients turn by 20° from window to window.
const PERIODS: usize = 35;
const RATIO: f64 = 1.122_462_048_309_373;
/// Least repetition of a period over the greatest one. Two short contacts of equal impulse, a third
/// of a cycle apart, have a third harmonic of twice the amplitude of the first. It also decides
/// whether a limp has the period of one step or of two.
const LEAST_SHARE: f64 = 0.25;
/// Least repetition: that of a first harmonic of a tenth of the mean load.
const LEAST_REPETITION: f64 = 0.01;
/// Bound of the rounding of times at the ends of a run \[s\].
const ROUNDING_S: f64 = 1e-9;
/// Number of bins of the loads in a period.
pub(super) const BINS: usize = 32;

/// Bins of four periods and their end, kept between searches.
pub(super) type Bins = [Bin; 4 * BINS + 1];

/// A complex number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Complex {
    re: f64,
    im: f64,
}

impl Complex {
    pub fn norm(self) -> f64 {
        (self.re * self.re + self.im * self.im).sqrt()
    }

    pub fn argument(self) -> f64 {
        libm::atan2(self.im, self.re)
    }

    fn add(&mut self, other: Self) {
        self.re += other.re;
        self.im += other.im;
    }

    /// Returns the product with the conjugate of `other`: its argument is the turn from `other`.
    fn over(self, other: Self) -> Self {
        Complex {
            re: self.re * other.re + self.im * other.im,
            im: self.im * other.re - self.re * other.im,
        }
    }
}

/// Weighted sum and first Fourier coefficient of one window.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Transform {
    pub sum: f64,
    pub first: Complex,
}

/// Those of a block of legs.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Transforms {
    sum: Lanes,
    re: Lanes,
    im: Lanes,
}

impl Transforms {
    pub fn of(&self, lane: usize) -> Transform {
        let (re, im) = (self.re[lane], self.im[lane]);
        Transform {
            sum: self.sum[lane],
            first: Complex { re, im },
        }
    }
}

/// A raised cosine of two periods: weight of each bin, and weighted cosine and sine of one period.
#[derive(Clone, Debug)]
pub(super) struct Window([[f64; 3]; 2 * BINS]);

impl Window {
    pub fn new() -> Self {
        let mut window = [[0.0; 3]; 2 * BINS];
        for (bin, weights) in window.iter_mut().enumerate() {
            let periods = (bin as f64 + 0.5) / BINS as f64 - 1.0;
            let weight = 0.5 * (1.0 + libm::cos(PI * periods));
            let (sine, cosine) = libm::sincos(TAU * periods);
            *weights = [weight, weight * cosine, weight * sine];
        }
        Window(window)
    }

    /// Transforms the increments of two periods.
    pub fn transform(&self, bins: &[Bin]) -> Transforms {
        let mut transforms = Transforms::default();
        for (bin, [weight, cosine, sine]) in bins.iter().zip(&self.0) {
            for (lane, increment) in bin.increments.iter().enumerate() {
                transforms.sum[lane] += weight * increment;
                transforms.re[lane] += cosine * increment;
                transforms.im[lane] -= sine * increment;
            }
        }
        transforms
    }
}

/// Similarity of the loads in successive periods.
#[derive(Clone, Copy, Debug, Default)]
struct Repetition {
    /// Power of the component that repeats over that of the mean loads.
    power: f64,
    /// Mean turn of the coefficients from window to window \[rad\].
    turn: f64,
}

/// Returns the longest period after which the loads about `near_s` repeat; none if they do not.
pub(super) fn period(
    history: &History,
    window: &Window,
    bins: &mut Bins,
    near_s: f64,
) -> Option<f64> {
    let mut period_s = SHORTEST_S;
    let mut powers = [(0.0, f64::INFINITY); PERIODS];
    for place in &mut powers {
        let of = repetition(history, window, bins, near_s, period_s);
        // A period for which the run is too short hides a shorter one that is no maximum.
        *place = (period_s, of.map_or(f64::INFINITY, |of| of.power));
        period_s *= RATIO;
    }
    let maxima = || {
        let triples = powers.windows(3).rev();
        let maxima = triples.filter_map(|triple| match triple {
            [(_, before), (period_s, power), (_, after)] => {
                (before < power && power >= after && power.is_finite())
                    .then_some((*period_s, *power))
            }
            _ => None,
        });
        maxima.filter(|(_, power)| *power >= LEAST_REPETITION)
    };
    let greatest = maxima().fold(0.0, |greatest: f64, (_, power)| greatest.max(power));
    let mut lasting = maxima().filter(|(_, power)| *power >= LEAST_SHARE * greatest);
    lasting.next().map(|(period_s, _)| period_s)
}

/// Returns a period, corrected by the turn of the coefficients: loads with a longer one are later
/// from window to window.
pub(super) fn refined(
    history: &History,
    window: &Window,
    bins: &mut Bins,
    near_s: f64,
    mut period_s: f64,
) -> f64 {
    for _ in 0..2 {
        let turn = repetition(history, window, bins, near_s, period_s).map_or(0.0, |of| of.turn);
        period_s *= 1.0 - turn / TAU;
        period_s = period_s.clamp(SHORTEST_S, LONGEST_S);
    }
    period_s
}

/// Compares the windows about `near_s`, a period before and a period after; near an end of the run
/// two of them, as close to `near_s` as is possible. None if the run is shorter than three periods.
fn repetition(
    history: &History,
    window: &Window,
    bins: &mut Bins,
    near_s: f64,
    period_s: f64,
) -> Option<Repetition> {
    let (start_s, end_s) = (history.start_s(), history.end_s());
    let centre_s = near_s.min(end_s - period_s).max(start_s + period_s);
    let is_inside = |from: f64, to: f64| {
        start_s <= centre_s + from * period_s + ROUNDING_S
            && centre_s + to * period_s <= end_s + ROUNDING_S
    };
    let pairs = [is_inside(-2.0, 1.0), is_inside(-1.0, 2.0)];
    if pairs == [false; 2] {
        return None;
    }
    let from_s = centre_s - 2.0 * period_s;
    let (mut mean_power, mut products) = (0.0, [Complex::default(); 2]);
    history.set_edges(bins, from_s, period_s / BINS as f64);
    for block in 0..history.blocks() {
        history.set_increments(bins, block, Quantity::Impulse);
        let windows = [0, 1, 2].map(|offset| window.transform(&bins[offset * BINS..]));
        for lane in 0..LANES.min(history.legs() - block * LANES) {
            let windows = windows.each_ref().map(|window| window.of(lane));
            // Of all windows: a short one may lie in the swing.
            let squares = windows.map(|window| window.sum * window.sum);
            mean_power += squares.iter().sum::<f64>() / 3.0;
            for (product, pair) in products.iter_mut().zip(windows.windows(2)) {
                product.add(pair[1].first.over(pair[0].first));
            }
        }
    }
    if mean_power <= 0.0 {
        return Some(Repetition::default());
    }
    let (mut least, mut sum) = (f64::INFINITY, Complex::default());
    for (product, is_inside) in products.into_iter().zip(pairs) {
        if is_inside {
            least = least.min(product.re);
            sum.add(product);
        }
    }
    Some(Repetition {
        power: least / mean_power,
        turn: sum.argument(),
    })
}
