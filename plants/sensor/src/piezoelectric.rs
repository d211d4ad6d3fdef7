//! Piezoelectric cell with its charge amplifier.

use serde::{Deserialize, Serialize};
use twinrig_document::declaration::{quantity, record};
use twinrig_document::{Reported, Table};
use twinrig_kernel::Unit;

use crate::error::SensorError;
use crate::low_pass::{LowPass, LowPassStep};
use crate::ranges;

record! {
    /// Piezoelectric cell behind silicone, with a charge amplifier:
    ///
    /// ```text
    /// V/F = −k s / ((1 + s T₁)(1 + s T₂))
    /// ```
    ///
    /// T₁ = RC is that of the feedback network, T₂ that of the silicone, a first-order lag. For a
    /// sinusoidal load of the angular frequency ω the voltage is a Ḟ + b F̈ with
    ///
    /// ```text
    /// a = −k (1 − ω² T₁T₂)/D        b = k (T₁ + T₂)/D        D = (1 − ω² T₁T₂)² + ω² (T₁ + T₂)²
    /// ```
    ///
    /// which fall with the frequency nearly exponentially, as measured in the thesis
    /// (section 4.3.2.2).
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct PiezoelectricCell = "piezoelectric", checked by check_times {
        /// Sensitivity k to the rate of the load \[V·s/N\]; its sign depends on the polarity of
        /// the cell.
        pub gain: f64 = quantity(Unit::VoltSecondPerNewton, ranges::GAIN),
        /// Time constant T₁ of the amplifier \[s\].
        pub amplifier_time: f64 = quantity(Unit::Second, ranges::TIME),
        /// Time constant T₂ of the silicone \[s\].
        pub silicone_time: f64 = quantity(Unit::Second, ranges::TIME),
        /// Maximum magnitude of the output voltage \[V\].
        pub rail: f64 = quantity(Unit::Volt, ranges::VOLTAGE),
        /// Offset of the amplifier \[V\].
        pub offset: f64 = quantity(Unit::Volt, ranges::OFFSET),
    }
}

fn check_times(table: &Table<'_>, cell: &PiezoelectricCell) -> Result<(), Reported> {
    let checked = cell.check();
    checked.map_err(|error| table.report_at(&table.place(), error.to_string(), ""))
}

/// State: the load behind each of the two lags \[N\]. V = −k/(T₁ − T₂) (x₂ − x₁) by partial
/// fractions, so both are independent and exact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct PiezoelectricState {
    behind_amplifier: LowPass,
    behind_silicone: LowPass,
}

/// Factors of a step.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PiezoelectricStep {
    amplifier: LowPassStep,
    silicone: LowPassStep,
}

/// Least relative distance of the time constants, for the partial fractions.
const DISTINCT: f64 = 1e-3;

impl PiezoelectricCell {
    /// Returns the coefficients a \[V·s/N\] and b \[V·s²/N\] of V = a Ḟ + b F̈ for a sinusoidal
    /// load of an angular frequency \[rad/s\].
    pub fn coefficients(&self, frequency: f64) -> [f64; 2] {
        let (product, sum) = (
            self.amplifier_time * self.silicone_time,
            self.amplifier_time + self.silicone_time,
        );
        let (real, imaginary) = (1.0 - frequency * frequency * product, frequency * sum);
        let square = real * real + imaginary * imaginary;
        [-self.gain * real / square, self.gain * sum / square]
    }

    /// Checks that the partial fractions exist.
    pub(crate) fn check(&self) -> Result<(), SensorError> {
        let (amplifier, silicone) = (self.amplifier_time, self.silicone_time);
        if (amplifier - silicone).abs() > DISTINCT * amplifier {
            return Ok(());
        }
        Err(SensorError::EqualTimes {
            amplifier,
            silicone,
        })
    }

    pub(crate) fn step(&self, seconds: f64) -> PiezoelectricStep {
        PiezoelectricStep {
            amplifier: LowPassStep::new(self.amplifier_time, seconds),
            silicone: LowPassStep::new(self.silicone_time, seconds),
        }
    }

    pub(crate) fn volts(&self, state: &PiezoelectricState) -> f64 {
        let difference = state.behind_silicone.value - state.behind_amplifier.value;
        let volts = -self.gain / (self.amplifier_time - self.silicone_time) * difference;
        (volts + self.offset).clamp(-self.rail, self.rail)
    }
}

impl PiezoelectricState {
    /// Returns the state under a load that has been constant \[N\].
    pub(crate) fn resting_at(force: f64) -> Self {
        let value = LowPass { value: force };
        Self {
            behind_amplifier: value,
            behind_silicone: value,
        }
    }

    pub(crate) fn advance(&mut self, step: &PiezoelectricStep, from: f64, to: f64) {
        self.behind_amplifier.advance(&step.amplifier, from, to);
        self.behind_silicone.advance(&step.silicone, from, to);
    }
}
