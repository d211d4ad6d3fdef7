//! Distance of two trajectories over time, its growth, and the time at which it passes a tolerance.

use serde::{Deserialize, Serialize};

use crate::fit::Fit;

/// Distance from which trajectories are as far apart as any two of the same motion, m or rad: a
/// tenth of a step of a small robot. Beyond it nothing grows.
const SATURATED: f64 = 1e-2;
/// Least growth from which a rate is given.
const GROWN: f64 = 100.0;

/// Positions of a run at instants: those of trunk and feet, or of a plant without them its lengths
/// and angles.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Trajectory {
    /// Number of components of each signal.
    pub sizes: Vec<usize>,
    /// Instants \[s\].
    pub at_s: Vec<f64>,
    /// All components at each instant in turn \[m or rad\].
    pub values: Vec<f64>,
}

impl Trajectory {
    /// Returns the distance from another trajectory at each instant that both have: the greatest of
    /// the signals, each a Euclidean norm.
    pub fn distances(&self, other: &Self) -> Vec<[f64; 2]> {
        let width = self.sizes.iter().sum::<usize>().max(1);
        let (own, others) = (
            self.values.chunks_exact(width),
            other.values.chunks_exact(width),
        );
        let samples = self.at_s.iter().zip(own.zip(others));
        let distances = samples.map(|(&at_s, (a, b))| {
            let mut begin = 0;
            let norms = self.sizes.iter().map(|size| {
                let signal = begin..begin + size;
                begin += size;
                let squares = signal.map(|n| (a[n] - b[n]) * (a[n] - b[n]));
                squares.sum::<f64>().sqrt()
            });
            [at_s, norms.fold(0.0, f64::max)]
        });
        distances.collect()
    }
}

/// Growth of the distance before it passes the tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Growth {
    /// Exponential, the greatest Lyapunov exponent.
    Exponential {
        /// Slope of the logarithm of the distance over time \[1/s\].
        rate: f64,
        /// Distance of the fitted line at time 0.
        start: f64,
    },
    /// As a power of time.
    Power {
        /// Slope of the logarithm of the distance over that of time.
        exponent: f64,
    },
    /// Less than a hundredfold, or neither of both.
    None,
}

impl Growth {
    /// Returns the growth of the points (time, distance), by the straighter one of the two lines.
    fn of(points: &[[f64; 2]]) -> Self {
        let positive = points.iter().filter(|[at_s, d]| *at_s > 0.0 && *d > 0.0);
        let points: Vec<[f64; 2]> = positive.copied().collect();
        let greatest = points.iter().map(|[_, d]| *d).fold(0.0, f64::max);
        let first = points.first();
        let grown = first.is_some_and(|[_, first]| greatest >= GROWN * first);
        if !grown {
            return Self::None;
        }
        let fit = |x: fn(f64) -> f64| {
            let points = points.iter().map(|[at_s, d]| (x(*at_s), libm::log(*d)));
            Fit::through(&points.collect::<Vec<_>>())
        };
        let (Some(over_time), Some(over_log)) = (fit(|at_s| at_s), fit(libm::log)) else {
            return Self::None;
        };
        let is_exponential = over_time.straightness() >= over_log.straightness();
        let slope = if is_exponential { over_time } else { over_log }.slope_if_straight();
        match slope.filter(|slope| *slope > 0.0) {
            Some(rate) if is_exponential => {
                let [time, log] = mean(&points);
                let start = libm::exp(log - rate * time);
                Self::Exponential { rate, start }
            }
            Some(exponent) => Self::Power { exponent },
            None => Self::None,
        }
    }

    /// Returns the rate of an exponential growth \[1/s\].
    pub fn rate(self) -> Option<f64> {
        match self {
            Self::Exponential { rate, .. } => Some(rate),
            Self::Power { .. } | Self::None => None,
        }
    }
}

/// Returns the means of time and logarithm of the distance.
fn mean(points: &[[f64; 2]]) -> [f64; 2] {
    let count = points.len().max(1) as f64;
    let sums = points.iter().fold([0.0, 0.0], |[time, log], [at_s, d]| {
        [time + at_s, log + libm::log(*d)]
    });
    sums.map(|sum| sum / count)
}

/// Divergence of a perturbed run from the unperturbed one.
#[derive(Clone, Debug, PartialEq)]
pub struct Divergence {
    /// Distance over time.
    pub distances: Vec<[f64; 2]>,
    /// First time at which the distance is above the tolerance; none: it is not \[s\].
    pub crossed_s: Option<f64>,
    /// Growth up to there.
    pub growth: Growth,
}

impl Divergence {
    /// Evaluates distances over time. `parted_s` is the time at which one of the runs ended before
    /// the other, which is a divergence.
    pub fn of(distances: Vec<[f64; 2]>, tolerance: f64, parted_s: Option<f64>) -> Self {
        // NaN is beyond every distance.
        let beyond = |limit: f64| move |[_, d]: &[f64; 2]| d.is_nan() || *d > limit;
        let crossed = distances.iter().copied().find(beyond(tolerance));
        let end = distances
            .iter()
            .position(beyond(tolerance.min(SATURATED)))
            .unwrap_or(distances.len());
        Self {
            growth: Growth::of(&distances[..end]),
            crossed_s: crossed.map(|[at_s, _]| at_s).or(parted_s),
            distances,
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Samples x at 10 ms over 20 s.
    fn trajectory(x: impl Fn(f64) -> f64) -> Trajectory {
        let at_s: Vec<f64> = (0..2000).map(|n| f64::from(n) * 0.01).collect();
        Trajectory {
            sizes: vec![1],
            values: at_s.iter().map(|at_s| x(*at_s)).collect(),
            at_s,
        }
    }

    proptest! {
        /// ẋ = λ x: distances of solutions grow by exp(λ t), so that a distance ε passes the
        /// tolerance at ln(tolerance/ε)/λ.
        #[test]
        fn growth_and_horizon_of_a_linear_system_are_exact(
            lambda in 0.8_f64..5.0, decades in 6.0_f64..9.0,
        ) {
            let start = libm::pow(10.0, -decades);
            let [one, other] = [0.0, start].map(|x| trajectory(|at_s| x * libm::exp(lambda * at_s)));
            let found = Divergence::of(one.distances(&other), 1e-3, None);
            let Growth::Exponential { rate, start: fitted } = found.growth else {
                panic!("{:?}", found.growth);
            };
            prop_assert!((rate / lambda - 1.0).abs() < 1e-9, "{rate} {lambda}");
            prop_assert!((fitted / start - 1.0).abs() < 1e-6, "{fitted} {start}");
            let expected = libm::log(1e-3 / start) / lambda;
            let late = found.crossed_s.unwrap() - expected;
            prop_assert!((0.0..0.010_000_1).contains(&late), "{late}");
        }

        #[test]
        fn contracting_system_is_predictable_to_the_end(lambda in 0.01_f64..5.0) {
            let [one, other] = [1.0, 1.000_001].map(|x| trajectory(|at_s| x * libm::exp(-lambda * at_s)));
            let found = Divergence::of(one.distances(&other), 1e-3, None);
            prop_assert_eq!((found.crossed_s, found.growth), (None, Growth::None));
        }
    }

    /// The logistic map x → 4 x (1 − x) has the Lyapunov exponent ln 2 per iteration.
    #[test]
    fn growth_of_the_logistic_map_is_ln_2() {
        // Mean over starts: the rate of one alone has a standard deviation of some per cent.
        let rates = (1..40).filter_map(|n| {
            let start = f64::from(n) * 0.012_345;
            let orbit = |mut x: f64| Trajectory {
                sizes: vec![1],
                at_s: (1..60).map(f64::from).collect(),
                values: std::iter::repeat_with(|| {
                    x *= 4.0 * (1.0 - x);
                    x
                })
                .take(59)
                .collect(),
            };
            let distances = orbit(start).distances(&orbit(start + 1e-14));
            Divergence::of(distances, 1e-2, None).growth.rate()
        });
        let rates: Vec<f64> = rates.collect();
        let mean = rates.iter().sum::<f64>() / rates.len() as f64;
        let is_near = (mean / std::f64::consts::LN_2 - 1.0).abs() < 0.05;
        assert!(is_near && rates.len() > 30, "{mean} of {}", rates.len());
    }

    #[test]
    fn drift_is_no_exponential_growth() {
        // Two speeds: the distance grows in proportion to time.
        let [one, other] = [1.0, 1.000_001].map(|speed| trajectory(|at_s| speed * at_s));
        let found = Divergence::of(one.distances(&other), 1.0, None);
        let Growth::Power { exponent } = found.growth else {
            panic!("{:?}", found.growth);
        };
        assert!((exponent - 1.0).abs() < 1e-6, "{exponent}");
    }

    #[test]
    fn distance_is_that_of_the_farthest_point_and_runs_that_part_diverge() {
        let of = |values: &[f64]| Trajectory {
            sizes: vec![2, 1],
            at_s: vec![0.0, 1.0],
            values: values.to_vec(),
        };
        let (a, b) = (
            of(&[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]),
            of(&[3.0, 4.0, 1.0, 1.0, 1.0, 3.0]),
        );
        assert_eq!(a.distances(&b), [[0.0, 5.0], [1.0, 2.0]]);
        // The other ended earlier.
        let ended = of(&[3.0, 4.0, 1.0]);
        assert_eq!(a.distances(&ended), [[0.0, 5.0]]);
        let still = a.distances(&a);
        assert_eq!(Divergence::of(still.clone(), 1.0, None).crossed_s, None);
        assert_eq!(Divergence::of(still, 1.0, Some(1.0)).crossed_s, Some(1.0));
        let broken = Divergence::of(vec![[0.5, f64::NAN]], 1.0, None);
        assert_eq!(broken.crossed_s, Some(0.5));
    }
}
