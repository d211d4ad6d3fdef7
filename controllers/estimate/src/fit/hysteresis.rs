//! Identification of the piezoresistive response (eq. 4.21).

use nalgebra::SVector;

use super::Fitted;
use super::least_squares::{Curve, minimise};
use crate::error::EstimateError;
use crate::response::{Hysteresis, Sigmoid};

/// Sample of a run with the piezoresistive cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceSample {
    /// Force \[N\].
    pub force: f64,
    /// Rate \[N/s\].
    pub rate: f64,
    /// Measured voltage \[V\].
    pub voltage: f64,
}

struct Samples<'a>(&'a [ForceSample]);

/// Order: loading a, b, c, d; unloading a, b, c, d; switch.
fn pack(model: &Hysteresis) -> SVector<f64, 9> {
    let (l, u) = (&model.loading, &model.unloading);
    SVector::from([l.a, l.b, l.c, l.d, u.a, u.b, u.c, u.d, model.switch])
}

/// Returns the model of the first nine parameters, in the order of [`pack`].
pub(super) fn unpack(p: &[f64]) -> Hysteresis {
    let sigmoid = |first: usize| Sigmoid {
        a: p[first],
        b: p[first + 1],
        c: p[first + 2],
        d: p[first + 3],
    };
    Hysteresis {
        loading: sigmoid(0),
        unloading: sigmoid(4),
        switch: p[8],
    }
}

/// Derivatives of a sigmoid with respect to its parameters. Its value is a·s + d with s(z),
/// z = −b(F + c), and a·ds/dz follows from the derivative with respect to the force.
pub(super) fn by_parameters(sigmoid: &Sigmoid, force: f64) -> [f64; 4] {
    let (value, by_force) = sigmoid.at(force);
    let share = (value - sigmoid.d) / sigmoid.a;
    let by_b = by_force * (force + sigmoid.c) / sigmoid.b;
    [share, by_b, by_force, 1.0]
}

impl Curve<9> for Samples<'_> {
    const NAME: &'static str = "the hysteresis";

    fn len(&self) -> usize {
        self.0.len()
    }

    fn each(&self, p: &SVector<f64, 9>, mut sample: impl FnMut(f64, f64, SVector<f64, 9>)) {
        let model = unpack(p.as_slice());
        for it in self.0 {
            let whole = model.at(it.force, it.rate);
            // The weight of the loading branch: eq. 4.20 with a = 1, c = d = 0.
            let switch = Sigmoid {
                a: 1.0,
                b: -model.switch,
                c: 0.0,
                d: 0.0,
            };
            let (weight, _) = switch.at(it.rate);
            let loading = by_parameters(&model.loading, it.force);
            let unloading = by_parameters(&model.unloading, it.force);
            let mut gradient = SVector::zeros();
            for i in 0..4 {
                gradient[i] = weight * loading[i];
                gradient[4 + i] = (1.0 - weight) * unloading[i];
            }
            // by_rate = switch · w' · (S₁ − S₂)
            gradient[8] = whole.by_rate / model.switch * it.rate;
            sample(it.voltage, whole.voltage, gradient);
        }
    }

    fn allows(&self, p: &SVector<f64, 9>) -> bool {
        // A fit does not pass through a constant sigmoid, whose parameters are undetermined.
        let finite = p.iter().all(|value| value.is_finite());
        finite && [0, 1, 4, 5].iter().all(|&i| p[i] != 0.0) && p[8] > 0.0
    }
}

/// Fits the nine parameters of the hysteresis to samples, from `start` or from
/// [`guess_hysteresis`].
///
/// Samples should cover both branches from the foot of the sigmoids into saturation: an asymptote
/// that is not approached is not determined.
///
/// # Errors
/// [`EstimateError::Length`] for fewer than nine samples, [`EstimateError::Undetermined`] and
/// [`EstimateError::NoConvergence`].
pub fn hysteresis(
    samples: &[ForceSample],
    start: Option<&Hysteresis>,
) -> Result<Fitted<Hysteresis>, EstimateError> {
    let start = match start {
        Some(start) => *start,
        None => guess_hysteresis(samples)?,
    };
    let minimum = minimise(&Samples(samples), pack(&start))?;
    Ok(Fitted {
        model: unpack(minimum.parameters.as_slice()),
        r_squared: minimum.r_squared,
        residual: minimum.residual,
        iterations: minimum.iterations,
    })
}

/// Returns rough parameters from samples, in the convention a > 0, b < 0: each branch over the
/// whole range of the voltages, its centre at the mean force of the samples in the middle third,
/// its slope between the outer thirds; the switch at a twentieth of the greatest rate.
///
/// # Errors
/// [`EstimateError::Undetermined`] if forces, rates or voltages do not vary or a branch has no
/// sample.
pub fn guess_hysteresis(samples: &[ForceSample]) -> Result<Hysteresis, EstimateError> {
    let undetermined = EstimateError::Undetermined {
        what: Samples::NAME,
    };
    let range = |value: fn(&ForceSample) -> f64| {
        let low = samples.iter().map(value).fold(f64::INFINITY, f64::min);
        let high = samples.iter().map(value).fold(f64::NEG_INFINITY, f64::max);
        (low, high)
    };
    let (low, high) = range(|it| it.voltage);
    let (least, most) = range(|it| it.force);
    let (slowest, fastest) = range(|it| it.rate);
    let rate = fastest.max(-slowest);
    let varies = high > low && most > least && rate > 0.0;
    if !varies || !(high - low + most - least).is_finite() {
        return Err(undetermined);
    }
    let branch = |rising: bool| -> Option<Sigmoid> {
        // Mean force within an interval of the voltage's range.
        let mean = |from: f64, to: f64| {
            let inside = |it: &&ForceSample| {
                let share = (it.voltage - low) / (high - low);
                (it.rate > 0.0) == rising && share >= from && share <= to
            };
            let (mut sum, mut count) = (0.0, 0.0);
            for it in samples.iter().filter(inside) {
                sum += it.force;
                count += 1.0;
            }
            (count > 0.0).then(|| sum / count)
        };
        let centre = mean(0.33, 0.67).or_else(|| mean(0.1, 0.9))?;
        let spread = mean(0.67, 0.9)
            .zip(mean(0.1, 0.33))
            .map_or(0.25 * (most - least), |(upper, lower)| upper - lower);
        // A logistic function takes 2.5 of its scale from 22 % to 78 %.
        let steepness = 2.5 / spread.max(0.02 * (most - least));
        Some(Sigmoid {
            a: high - low,
            b: -steepness,
            c: -centre,
            d: low,
        })
    };
    let (Some(loading), Some(unloading)) = (branch(true), branch(false)) else {
        return Err(undetermined);
    };
    Ok(Hysteresis {
        loading,
        unloading,
        switch: 20.0 / rate,
    })
}
