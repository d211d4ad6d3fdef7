//! Identification of the piezoresistive response together with its creep.

use nalgebra::SVector;

use super::Fitted;
use super::hysteresis::{ForceSample, by_parameters, hysteresis, unpack};
use super::least_squares::{Curve, minimise};
use crate::error::{EstimateError, finite, positive};
use crate::response::{Hysteresis, Sigmoid};

/// Identified response of a cell that creeps: V = floor + (1 + κ)(h(F, Ḟ) − floor), with the
/// response h as it was at the first sample, where κ = 0, and `time_s` · κ̇ = `per_newton` · F − κ.
///
/// Creep that the cell had before is part of h: a factor of both, which a load of constant mean
/// does not tell apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CreepFit {
    /// Response h without creep (eq. 4.21).
    pub hysteresis: Hysteresis,
    /// Voltage that does not creep, that of the amplifier without a conducting cell \[V\].
    pub floor: f64,
    /// Final creep under a constant load \[1/N\].
    pub per_newton: f64,
    /// Time constant \[s\].
    pub time_s: f64,
}

/// Samples at a constant period, of which some count.
struct Samples<'a> {
    period_s: f64,
    all: &'a [ForceSample],
    counts: &'a [bool],
    number: usize,
}

/// Parameters: nine of the hysteresis, floor, initial slope `per_newton`/`time_s`, 1/`time_s`.
const PARAMETERS: usize = 12;
const FLOOR: usize = 9;
const SLOPE: usize = 10;
const DECAY: usize = 11;

impl Curve<PARAMETERS> for Samples<'_> {
    const NAME: &'static str = "the creep";

    fn len(&self) -> usize {
        self.number
    }

    fn each(
        &self,
        p: &SVector<f64, PARAMETERS>,
        mut sample: impl FnMut(f64, f64, SVector<f64, PARAMETERS>),
    ) {
        let model = unpack(p.as_slice());
        // κ̇ = slope · F − decay · κ with its sensitivities to slope and decay.
        let (mut creep, mut by_slope, mut by_decay) = (0.0, 0.0, 0.0);
        let (t, decay) = (self.period_s, p[DECAY]);
        for (it, &counts) in self.all.iter().zip(self.counts) {
            if counts {
                let whole = model.at(it.force, it.rate);
                let (weight, _) = Sigmoid {
                    a: 1.0,
                    b: -model.switch,
                    c: 0.0,
                    d: 0.0,
                }
                .at(it.rate);
                let loading = by_parameters(&model.loading, it.force);
                let unloading = by_parameters(&model.unloading, it.force);
                let (factor, above) = (1.0 + creep, whole.voltage - p[FLOOR]);
                let mut gradient = SVector::zeros();
                for i in 0..4 {
                    gradient[i] = factor * weight * loading[i];
                    gradient[4 + i] = factor * (1.0 - weight) * unloading[i];
                }
                gradient[8] = factor * whole.by_rate / model.switch * it.rate;
                gradient[FLOOR] = -creep;
                gradient[SLOPE] = above * by_slope;
                gradient[DECAY] = above * by_decay;
                sample(it.voltage, p[FLOOR] + factor * above, gradient);
            }
            // Explicit steps: a period is a thousandth of the time constant or less.
            by_slope += t * (it.force - decay * by_slope);
            by_decay += t * (-creep - decay * by_decay);
            creep += t * (p[SLOPE] * it.force - decay * creep);
        }
    }

    fn allows(&self, p: &SVector<f64, PARAMETERS>) -> bool {
        let finite = p.iter().all(|value| value.is_finite());
        // A decay within a tenth of a second would be hysteresis, not creep, and its steps coarse.
        let slow = (-1.0..10.0_f64.min(0.1 / self.period_s)).contains(&p[DECAY]);
        finite && slow && [0, 1, 4, 5].iter().all(|&i| p[i] != 0.0) && p[8] > 0.0
    }
}

/// Initial guesses: time constant \[s\], final creep under the mean load \[1\]. ASSUMED.
const TIME: f64 = 60.0;
const CREEP: f64 = 0.1;
/// Share of the lower asymptote that is the floor, at the start. ASSUMED.
const FLOOR_SHARE: f64 = 0.3;

/// Fits response and creep to samples taken every `period_s` \[s\], from the fit of the response
/// alone. Samples whose `counts` is false load the cell, but their voltages are not compared: those
/// of a change of the frequency, for example.
///
/// Floor, slope and time constant are determined only if the creep changes in the course of the
/// samples, under loads from the foot of the sigmoids into saturation.
///
/// # Errors
/// [`EstimateError::Length`] if the numbers of samples differ or too few count,
/// [`EstimateError::Value`], [`EstimateError::Undetermined`] and [`EstimateError::NoConvergence`].
pub fn creep(
    period_s: f64,
    samples: &[ForceSample],
    counts: &[bool],
) -> Result<Fitted<CreepFit>, EstimateError> {
    positive("period of the samples", period_s)?;
    if counts.len() != samples.len() {
        return Err(EstimateError::Length {
            entry: "marks of the samples that count",
            found: counts.len(),
            required: format!("{} are required, one for each sample", samples.len()),
        });
    }
    for it in samples {
        finite("force", it.force)?;
        finite("rate", it.rate)?;
        finite("voltage", it.voltage)?;
    }
    let counted: Vec<ForceSample> = samples
        .iter()
        .zip(counts)
        .filter_map(|(it, counts)| counts.then_some(*it))
        .collect();
    let still = hysteresis(&counted, None)?.model;
    let mean = samples.iter().map(|it| it.force).sum::<f64>() / samples.len().max(1) as f64;
    let (l, u) = (&still.loading, &still.unloading);
    let start = SVector::from([
        l.a,
        l.b,
        l.c,
        l.d,
        u.a,
        u.b,
        u.c,
        u.d,
        still.switch,
        FLOOR_SHARE * l.d,
        CREEP / (TIME * mean.abs().max(f64::MIN_POSITIVE)),
        1.0 / TIME,
    ]);
    let curve = Samples {
        period_s,
        all: samples,
        counts,
        number: counted.len(),
    };
    let minimum = minimise(&curve, start)?;
    let p = minimum.parameters;
    Ok(Fitted {
        model: CreepFit {
            hysteresis: unpack(p.as_slice()),
            floor: p[FLOOR],
            per_newton: p[SLOPE] / p[DECAY],
            time_s: 1.0 / p[DECAY],
        },
        r_squared: minimum.r_squared,
        residual: minimum.residual,
        iterations: minimum.iterations,
    })
}
