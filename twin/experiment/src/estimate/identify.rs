//! Identification of both cells (section 4.3.2.2).

use twinrig_estimate::fit::{
    self, AmplifierFit, CoefficientFit, Fitted, ForceSample, RateSample, Run,
};
use twinrig_estimate::{ChargeAmplifier, Hysteresis};

use super::data::Signals;
use super::distribution::Residuals;
use crate::error::StudyError;

/// Identified models of both cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Identification {
    /// Hysteresis of the piezoresistive cell (eq. 4.21).
    pub hysteresis: Fitted<Hysteresis>,
    /// Piezoelectric cell as a rate sensor: gain \[V·s/N\] and offset \[V\] of V = gain·Ḟ + offset.
    pub rate_sensor: Fitted<[f64; 2]>,
    /// Frequencies \[Hz\] of the coefficients.
    pub frequencies: Vec<f64>,
    /// Coefficients of rate and acceleration at each frequency, and exponentials through them.
    pub coefficients: CoefficientFit,
    /// R² over all frequencies, with the coefficients of each.
    pub planes_r_squared: f64,
    /// R² over all frequencies, with the coefficients of the exponentials and the offset of each.
    pub exponentials_r_squared: f64,
    /// Cell with charge amplifier.
    pub amplifier: Fitted<AmplifierFit>,
    /// Residuals: hysteresis, coefficients of each frequency, amplifier.
    pub residuals: Vec<Residuals>,
}

/// Coefficient of determination, beside the residuals \[V\].
struct Explained {
    r_squared: f64,
    residuals: Vec<f64>,
}

fn explained(measured: &[f64], computed: &[f64]) -> Explained {
    let mean = measured.iter().sum::<f64>() / measured.len().max(1) as f64;
    let residuals: Vec<f64> = measured.iter().zip(computed).map(|(a, b)| a - b).collect();
    let square: f64 = residuals.iter().map(|it| it * it).sum();
    let spread: f64 = measured.iter().map(|it| (it - mean) * (it - mean)).sum();
    Explained {
        r_squared: 1.0 - square / spread,
        residuals,
    }
}

/// Identifies both cells from a run whose channels are low-passed without phase.
pub(crate) fn identify(signals: &Signals) -> Result<Identification, StudyError> {
    let hysteresis = hysteresis(signals)?;
    let samples: Vec<Vec<RateSample>> = signals
        .parts
        .iter()
        .map(|part| rate_samples(signals, part.samples.clone()))
        .collect();
    let runs: Vec<Run<'_>> = signals
        .parts
        .iter()
        .zip(&samples)
        .map(|(part, samples)| Run {
            hz: part.hz,
            samples,
        })
        .collect();
    let coefficients = fit::coefficients(&runs)?;
    let amplifier = amplifier(signals, &coefficients)?;
    let measured: Vec<f64> = samples.iter().flatten().map(|it| it.voltage).collect();
    let computed = |of: &dyn Fn(usize) -> [f64; 3]| -> Vec<f64> {
        let voltages = samples.iter().enumerate().flat_map(|(part, samples)| {
            let [a, b, offset] = of(part);
            samples
                .iter()
                .map(move |it| a * it.rate + b * it.acceleration + offset)
        });
        voltages.collect()
    };
    let planes = explained(&measured, &computed(&|part| coefficients.runs[part].model));
    let exponentials = computed(&|part| {
        let hz = signals.parts[part].hz;
        let (a, b) = (&coefficients.rate.model, &coefficients.acceleration.model);
        [a.at(hz).0, b.at(hz).0, coefficients.runs[part].model[2]]
    });
    let curve = |i: usize| {
        let point = hysteresis.model.at(signals.force[i], signals.rate[i]);
        signals.volts[0][i] - point.voltage
    };
    let simulated = simulated(signals, &amplifier.model);
    let of_amplifier = |i: usize| signals.volts[1][i] - simulated[i];
    let residuals = vec![
        Residuals::new(
            "piezoresistive, hysteresis",
            &signals.steady().map(curve).collect::<Vec<_>>(),
        ),
        Residuals::new(
            "piezoelectric, a and b of each frequency",
            &planes.residuals,
        ),
        Residuals::new(
            "piezoelectric, charge amplifier",
            &signals.steady().map(of_amplifier).collect::<Vec<_>>(),
        ),
    ];
    Ok(Identification {
        hysteresis,
        rate_sensor: rate_sensor(samples.iter().flatten()),
        frequencies: signals.parts.iter().map(|part| part.hz).collect(),
        planes_r_squared: planes.r_squared,
        exponentials_r_squared: explained(&measured, &exponentials).r_squared,
        coefficients,
        amplifier,
        residuals,
    })
}

fn hysteresis(signals: &Signals) -> Result<Fitted<Hysteresis>, StudyError> {
    let sample = |i: usize| ForceSample {
        force: signals.force[i],
        rate: signals.rate[i],
        voltage: signals.volts[0][i],
    };
    let samples: Vec<_> = signals.steady().map(sample).collect();
    Ok(fit::hysteresis(&samples, None)?)
}

fn rate_samples(signals: &Signals, range: std::ops::Range<usize>) -> Vec<RateSample> {
    let sample = |i: usize| RateSample {
        rate: signals.rate[i],
        acceleration: signals.acceleration[i],
        voltage: signals.volts[1][i],
    };
    range.map(sample).collect()
}

/// Regression of the voltage on the rate.
fn rate_sensor<'s>(samples: impl Iterator<Item = &'s RateSample> + Clone) -> Fitted<[f64; 2]> {
    let count = samples.clone().count().max(1) as f64;
    let mean = |value: fn(&RateSample) -> f64| samples.clone().map(value).sum::<f64>() / count;
    let (rate, voltage) = (mean(|it| it.rate), mean(|it| it.voltage));
    let (mut both, mut rates, mut voltages) = (0.0, 0.0, 0.0);
    for it in samples {
        let (x, y) = (it.rate - rate, it.voltage - voltage);
        both += x * y;
        rates += x * x;
        voltages += y * y;
    }
    let gain = both / rates;
    let square = (voltages - gain * both).max(0.0);
    Fitted {
        model: [gain, voltage - gain * rate],
        r_squared: 1.0 - square / voltages,
        residual: (square / count).sqrt(),
        iterations: 1,
    }
}

/// Range of the time constant from which the fit of the amplifier begins \[s\].
const FEEDBACK: (f64, f64) = (1e-3, 10.0);
/// Ratio of its two time constants there.
const RATIO: f64 = 0.1;

/// Fits the amplifier to the whole of the steady parts and the changes between them, from a start
/// that follows from the lowest frequency: V ≈ −k Ḟ + k (T₁ + T₂) F̈.
fn amplifier(
    signals: &Signals,
    coefficients: &CoefficientFit,
) -> Result<Fitted<AmplifierFit>, StudyError> {
    let first = coefficients.runs.first().map_or([0.0; 3], |it| it.model);
    let feedback = (-first[1] / first[0]).clamp(FEEDBACK.0, FEEDBACK.1);
    let start = ChargeAmplifier {
        sensitivity: -coefficients.rate.model.value,
        feedback_s: feedback,
        lag_s: RATIO * feedback,
    };
    let range = record(signals);
    Ok(fit::amplifier(
        signals.period_s,
        &signals.force[range.clone()],
        &signals.volts[1][range],
        &start,
    )?)
}

/// From the first steady sample to the last one.
fn record(signals: &Signals) -> std::ops::Range<usize> {
    let first = signals.parts.first().map_or(0, |part| part.samples.start);
    let last = signals.parts.last().map_or(0, |part| part.samples.end);
    first..last
}

/// Voltage of the amplifier for the force of every sample \[V\]. Its state at the start is that of
/// a constant force, which is forgotten before the first steady part, except in synthetic data.
pub(crate) fn simulated(signals: &Signals, fit: &AmplifierFit) -> Vec<f64> {
    let (transition, _) = fit.amplifier.transition(signals.period_s);
    let (mut crystal, mut voltage) = (0.0, 0.0);
    let mut voltages = Vec::with_capacity(signals.force.len());
    for (i, force) in signals.force.iter().enumerate() {
        voltages.push(voltage + fit.bias);
        let next = signals.force.get(i + 1).unwrap_or(force);
        let rate = (next - force) / signals.period_s;
        let state = [rate, 0.0, crystal, voltage];
        let row = |row: usize| -> f64 {
            let terms = state
                .iter()
                .enumerate()
                .map(|(k, x)| transition[(row, k + 1)] * x);
            terms.sum()
        };
        (crystal, voltage) = (row(3), row(4));
    }
    voltages
}
