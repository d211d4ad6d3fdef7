//! Identification of the charge amplifier from forces and voltages.

use nalgebra::{SMatrix, SVector};

use super::Fitted;
use super::least_squares::{Curve, minimise};
use crate::amplifier::ChargeAmplifier;
use crate::error::{EstimateError, finite, positive};

/// Identified amplifier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AmplifierFit {
    /// The cell with its amplifier, T₁ ≥ T₂. The voltage is symmetric in both times.
    pub amplifier: ChargeAmplifier,
    /// Offset of the voltage \[V\].
    pub bias: f64,
}

/// Samples at a constant period; the force is a straight line between two of them.
struct Samples<'a> {
    period_s: f64,
    forces: &'a [f64],
    voltages: &'a [f64],
}

/// Parameters: k, ln T₁, ln T₂, bias, U and V at the first sample.
const PARAMETERS: usize = 6;
/// Step of the differences in ln T: the error of a central difference, a third of its square, is
/// then that of rounding.
const DIFFERENCE: f64 = 1e-5;

impl Samples<'_> {
    /// Computes response to the force, to U = 1 N/s and to V = 1 V at the start, for each sample.
    fn responses(&self, feedback: f64, lag: f64) -> impl Iterator<Item = [f64; 3]> {
        let unit = ChargeAmplifier {
            sensitivity: 1.0,
            feedback_s: libm::exp(feedback),
            lag_s: libm::exp(lag),
        };
        let (transition, _) = unit.transition(self.period_s);
        // By the rate within a period; U, V.
        let step: SMatrix<f64, 2, 3> = transition.fixed_view::<2, 3>(3, 1).into_owned();
        let [by_rate, _] = [step.column(0).into_owned(), step.column(1).into_owned()];
        let square: SMatrix<f64, 2, 2> = transition.fixed_view::<2, 2>(3, 3).into_owned();
        let mut states = [
            SVector::<f64, 2>::zeros(),
            SVector::from([1.0, 0.0]),
            SVector::from([0.0, 1.0]),
        ];
        (0..self.forces.len()).map(move |i| {
            let voltages = states.map(|state| state[1]);
            if let Some(next) = self.forces.get(i + 1) {
                let rate = (next - self.forces[i]) / self.period_s;
                states = states.map(|state| square * state);
                states[0] += by_rate * rate;
            }
            voltages
        })
    }

    /// Voltage from responses: U acts through the sensitivity.
    fn voltage(p: &SVector<f64, PARAMETERS>, [force, crystal, voltage]: [f64; 3]) -> f64 {
        p[0] * (force + p[4] * crystal) + p[3] + p[5] * voltage
    }
}

impl Curve<PARAMETERS> for Samples<'_> {
    const NAME: &'static str = "the charge amplifier";

    fn len(&self) -> usize {
        self.forces.len()
    }

    fn each(
        &self,
        p: &SVector<f64, PARAMETERS>,
        mut sample: impl FnMut(f64, f64, SVector<f64, PARAMETERS>),
    ) {
        let h = DIFFERENCE;
        let here = self.responses(p[1], p[2]);
        let feedback = self
            .responses(p[1] + h, p[2])
            .zip(self.responses(p[1] - h, p[2]));
        let lag = self
            .responses(p[1], p[2] + h)
            .zip(self.responses(p[1], p[2] - h));
        for (((here, feedback), lag), &measured) in here.zip(feedback).zip(lag).zip(self.voltages) {
            let difference =
                |(above, below)| (Self::voltage(p, above) - Self::voltage(p, below)) / (2.0 * h);
            let gradient = SVector::from([
                here[0] + p[4] * here[1],
                difference(feedback),
                difference(lag),
                1.0,
                p[0] * here[1],
                here[2],
            ]);
            sample(measured, Self::voltage(p, here), gradient);
        }
    }

    fn allows(&self, p: &SVector<f64, PARAMETERS>) -> bool {
        // Times from a thousandth of a sample to a thousand times the record.
        let (least, most) = (
            1e-3 * self.period_s,
            1e3 * self.period_s * self.len() as f64,
        );
        let inside = |time: f64| (libm::log(least)..libm::log(most)).contains(&time);
        p.iter().all(|value| value.is_finite()) && inside(p[1]) && inside(p[2])
    }
}

/// Fits k, T₁, T₂ and the offset to forces \[N\] and voltages \[V\] sampled every `period_s`, from
/// `start`, such as data-sheet values. The amplifier's state at the first sample is fitted, too.
///
/// Between samples the force counts as a straight line.
///
/// # Errors
/// [`EstimateError::Length`] if the numbers of samples differ or are below six,
/// [`EstimateError::Value`], [`EstimateError::Undetermined`] and [`EstimateError::NoConvergence`].
pub fn amplifier(
    period_s: f64,
    forces: &[f64],
    voltages: &[f64],
    start: &ChargeAmplifier,
) -> Result<Fitted<AmplifierFit>, EstimateError> {
    positive("period of the samples", period_s)?;
    start.check()?;
    if forces.len() != voltages.len() {
        return Err(EstimateError::Length {
            entry: "voltages",
            found: voltages.len(),
            required: format!("{} are required, as many as forces", forces.len()),
        });
    }
    for (&force, &voltage) in forces.iter().zip(voltages) {
        finite("force", force)?;
        finite("voltage", voltage)?;
    }
    let samples = Samples {
        period_s,
        forces,
        voltages,
    };
    let [feedback, lag] = [start.feedback_s, start.lag_s].map(libm::log);
    let start = SVector::from([start.sensitivity, feedback, lag, 0.0, 0.0, 0.0]);
    let minimum = minimise(&samples, start)?;
    let p = minimum.parameters;
    let times = [libm::exp(p[1]), libm::exp(p[2])];
    Ok(Fitted {
        model: AmplifierFit {
            amplifier: ChargeAmplifier {
                sensitivity: p[0],
                feedback_s: times[0].max(times[1]),
                lag_s: times[0].min(times[1]),
            },
            bias: p[3],
        },
        r_squared: minimum.r_squared,
        residual: minimum.residual,
        iterations: minimum.iterations,
    })
}
