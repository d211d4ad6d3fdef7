//! Process and measurement models of the filters F1 to F4.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::amplifier::ChargeAmplifier;
use crate::error::{EstimateError, finite, positive, variance};

/// Initial value and noise of a state variable, in its unit and that squared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StateSettings {
    /// Initial value.
    pub initial: f64,
    /// Its variance.
    pub variance: f64,
    /// Variance that the process adds within one [`Settings::period_s`](crate::Settings).
    pub noise: f64,
}

/// Model of a filter, with its state variables in their order.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Model {
    /// Force \[N\], rate \[N/s\], bias \[V\] (eqs. 4.6–4.8). The piezoelectric cell is a rate
    /// sensor: V = gain·Ḟ + D.
    F1 {
        /// Gain of the piezoelectric cell \[V·s/N\].
        gain: f64,
        /// State variables.
        states: [StateSettings; 3],
    },
    /// Force \[N\], rate \[N/s\], acceleration \[N/s²\], angular frequency \[rad/s\], bias \[V\]
    /// (eqs. 4.14–4.16): V = a(f)·Ḟ + b(f)·F̈ + D with the frequency f = ω/2π. Requires a measured
    /// frequency.
    F2 {
        /// Coefficient a of the rate, in V·s/N.
        rate: Decay,
        /// Coefficient b of the acceleration, in V·s²/N.
        acceleration: Decay,
        /// State variables.
        states: [StateSettings; 5],
    },
    /// Force \[N\], rate \[N/s\], acceleration \[N/s²\], rate in the crystal \[N/s\], voltage of
    /// the amplifier \[V\], bias \[V\]. The amplifier is part of the state, so no frequency is
    /// required.
    F3 {
        /// The piezoelectric cell with its amplifier.
        amplifier: ChargeAmplifier,
        /// State variables.
        states: [StateSettings; 6],
    },
    /// F3 with two more states before the bias, each relative and zero in a cell as calibrated:
    /// deviation γ of the gain \[1\], V = (1 + γ)·Vₐ + D, and creep κ \[1\] by which the
    /// piezoresistive voltage h(F, Ḟ) exceeds the calibrated one: floor + (1 + κ)(h − floor).
    F4 {
        /// The piezoelectric cell with its amplifier.
        amplifier: ChargeAmplifier,
        /// Piezoresistive voltage of a cell that does not conduct, which does not creep \[V\].
        floor: f64,
        /// State variables.
        states: [StateSettings; 8],
    },
}

/// Coefficient that falls exponentially with the frequency: c(f) = value·exp(−f/scale), f ≥ 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Decay {
    /// Value at frequency 0.
    pub value: f64,
    /// Frequency at which it has fallen to 1/e \[Hz\].
    pub scale_hz: f64,
}

impl Decay {
    /// Returns the coefficient and its derivative with respect to the frequency, at `hz` \[Hz\].
    /// Negative frequencies count as zero.
    #[inline]
    pub fn at(&self, hz: f64) -> (f64, f64) {
        if hz <= 0.0 {
            return (self.value, 0.0);
        }
        let value = self.value * libm::exp(-hz / self.scale_hz);
        (value, -value / self.scale_hz)
    }

    fn check(&self) -> Result<(), EstimateError> {
        finite("coefficient of the piezoelectric cell", self.value)?;
        positive("frequency scale of the piezoelectric cell", self.scale_hz)
    }
}

const F1_NAMES: [&str; 3] = ["force", "rate", "bias"];
const F2_NAMES: [&str; 5] = ["force", "rate", "acceleration", "frequency", "bias"];
const F3_NAMES: [&str; 6] = [
    "force",
    "rate",
    "acceleration",
    "crystal rate",
    "voltage",
    "bias",
];

const F4_NAMES: [&str; 8] = [
    "force",
    "rate",
    "acceleration",
    "crystal rate",
    "voltage",
    "gain",
    "creep",
    "bias",
];

impl Model {
    /// Returns the names of the state variables.
    pub fn names(&self) -> &'static [&'static str] {
        match self {
            Self::F1 { .. } => &F1_NAMES,
            Self::F2 { .. } => &F2_NAMES,
            Self::F3 { .. } => &F3_NAMES,
            Self::F4 { .. } => &F4_NAMES,
        }
    }

    /// Returns the settings of the state variables.
    pub fn states(&self) -> &[StateSettings] {
        match self {
            Self::F1 { states, .. } => states,
            Self::F2 { states, .. } => states,
            Self::F3 { states, .. } => states,
            Self::F4 { states, .. } => states,
        }
    }

    /// Returns the settings of the state variables, for tuning.
    pub fn states_mut(&mut self) -> &mut [StateSettings] {
        match self {
            Self::F1 { states, .. } => states,
            Self::F2 { states, .. } => states,
            Self::F3 { states, .. } => states,
            Self::F4 { states, .. } => states,
        }
    }

    pub(crate) fn check(&self) -> Result<(), EstimateError> {
        for (&name, state) in self.names().iter().zip(self.states()) {
            finite(name, state.initial)?;
            variance(name, state.variance, false)?;
            variance(name, state.noise, false)?;
        }
        match self {
            Self::F1 { gain, .. } => finite("gain of the piezoelectric cell", *gain),
            Self::F2 {
                rate, acceleration, ..
            } => {
                rate.check()?;
                acceleration.check()
            }
            Self::F3 { amplifier, .. } => amplifier.check(),
            Self::F4 {
                amplifier, floor, ..
            } => {
                amplifier.check()?;
                finite("floor of the piezoresistive voltage", *floor)
            }
        }
    }
}

/// Process and piezoelectric response with `N` states, of which the first is the force, the second
/// its rate and the last the bias.
pub(crate) trait Dynamics<const N: usize>: Copy {
    /// Index of the angular frequency, if it is a state.
    const FREQUENCY: Option<usize> = None;

    /// Index of the creep, if it is a state, and the piezoresistive voltage that does not creep
    /// \[V\].
    fn creep(&self) -> Option<(usize, f64)> {
        None
    }

    /// Transition over `seconds`, and covariance of white noise with density `white` on the
    /// derivative of the highest derivative of the force.
    fn transition(&self, seconds: f64, white: f64) -> (SMatrix<f64, N, N>, SMatrix<f64, N, N>);

    /// Piezoelectric voltage \[V\] with its gradient.
    fn piezoelectric(&self, state: &SVector<f64, N>) -> (f64, SVector<f64, N>);
}

/// Model F1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct RateModel {
    pub(crate) gain: f64,
}

impl Dynamics<3> for RateModel {
    #[inline]
    fn transition(&self, t: f64, white: f64) -> (SMatrix<f64, 3, 3>, SMatrix<f64, 3, 3>) {
        let mut transition = SMatrix::identity();
        transition[(0, 1)] = t;
        let mut noise = SMatrix::zeros();
        let q = white * t;
        noise[(0, 0)] = q * t * t / 3.0;
        noise[(0, 1)] = q * t / 2.0;
        noise[(1, 0)] = noise[(0, 1)];
        noise[(1, 1)] = q;
        (transition, noise)
    }

    #[inline]
    fn piezoelectric(&self, state: &SVector<f64, 3>) -> (f64, SVector<f64, 3>) {
        let value = self.gain * state[1] + state[2];
        (value, SVector::from([0.0, self.gain, 1.0]))
    }
}

/// Model F2.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct FrequencyModel {
    pub(crate) rate: Decay,
    pub(crate) acceleration: Decay,
}

impl Dynamics<5> for FrequencyModel {
    const FREQUENCY: Option<usize> = Some(3);

    #[inline]
    fn transition(&self, t: f64, white: f64) -> (SMatrix<f64, 5, 5>, SMatrix<f64, 5, 5>) {
        let mut transition = SMatrix::identity();
        transition[(0, 1)] = t;
        transition[(0, 2)] = 0.5 * t * t;
        transition[(1, 2)] = t;
        let mut noise = SMatrix::<f64, 5, 5>::zeros();
        let q = white * t;
        noise[(0, 0)] = q * t * t * t * t / 20.0;
        noise[(0, 1)] = q * t * t * t / 8.0;
        noise[(0, 2)] = q * t * t / 6.0;
        noise[(1, 1)] = q * t * t / 3.0;
        noise[(1, 2)] = q * t / 2.0;
        noise[(2, 2)] = q;
        for (row, column) in [(1, 0), (2, 0), (2, 1)] {
            noise[(row, column)] = noise[(column, row)];
        }
        (transition, noise)
    }

    #[inline]
    fn piezoelectric(&self, state: &SVector<f64, 5>) -> (f64, SVector<f64, 5>) {
        const TURN: f64 = std::f64::consts::TAU;
        let (a, a_by_hz) = self.rate.at(state[3] / TURN);
        let (b, b_by_hz) = self.acceleration.at(state[3] / TURN);
        let by_frequency = (a_by_hz * state[1] + b_by_hz * state[2]) / TURN;
        let value = a * state[1] + b * state[2] + state[4];
        (value, SVector::from([0.0, a, b, by_frequency, 1.0]))
    }
}

/// Returns transition and noise of a model whose first five states are those of the cell with its
/// amplifier, and whose other states stay.
#[inline]
fn chain_transition<const N: usize>(
    amplifier: &ChargeAmplifier,
    t: f64,
    white: f64,
) -> (SMatrix<f64, N, N>, SMatrix<f64, N, N>) {
    let (chain, unit) = amplifier.transition(t);
    let mut transition = SMatrix::<f64, N, N>::identity();
    let mut noise = SMatrix::<f64, N, N>::zeros();
    transition.view_mut((0, 0), (5, 5)).copy_from(&chain);
    noise.view_mut((0, 0), (5, 5)).copy_from(&(unit * white));
    (transition, noise)
}

/// Model F3.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct AmplifierModel {
    pub(crate) amplifier: ChargeAmplifier,
}

impl Dynamics<6> for AmplifierModel {
    #[inline]
    fn transition(&self, t: f64, white: f64) -> (SMatrix<f64, 6, 6>, SMatrix<f64, 6, 6>) {
        chain_transition(&self.amplifier, t, white)
    }

    #[inline]
    fn piezoelectric(&self, state: &SVector<f64, 6>) -> (f64, SVector<f64, 6>) {
        let value = state[4] + state[5];
        (value, SVector::from([0.0, 0.0, 0.0, 0.0, 1.0, 1.0]))
    }
}

/// Model F4.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct AdaptiveModel {
    pub(crate) amplifier: ChargeAmplifier,
    pub(crate) floor: f64,
}

/// Indices of the states that F3 does not have.
const GAIN: usize = 5;
const CREEP: usize = 6;

impl Dynamics<8> for AdaptiveModel {
    fn creep(&self) -> Option<(usize, f64)> {
        Some((CREEP, self.floor))
    }

    #[inline]
    fn transition(&self, t: f64, white: f64) -> (SMatrix<f64, 8, 8>, SMatrix<f64, 8, 8>) {
        chain_transition(&self.amplifier, t, white)
    }

    #[inline]
    fn piezoelectric(&self, state: &SVector<f64, 8>) -> (f64, SVector<f64, 8>) {
        let factor = 1.0 + state[GAIN];
        let mut gradient = SVector::zeros();
        gradient[4] = factor;
        gradient[GAIN] = state[4];
        gradient[7] = 1.0;
        (factor * state[4] + state[7], gradient)
    }
}
