//! Filters under study: their models, and the deviations that are tuned.

use serde::{Deserialize, Serialize};
use twinrig_campaign::search;
use twinrig_estimate::{ForceResponse, Model, Piezoresistive, RECOVERY, Settings, StateSettings};

use super::identify::Identification;

/// Filter under study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum FilterKind {
    /// Force, rate, bias.
    F1,
    /// Force, rate, acceleration, frequency, bias.
    F2,
    /// Force, rate, acceleration, both states of the amplifier, bias.
    F3,
    /// F3 with the piezoresistive cell alone.
    Piezoresistive,
    /// F3 with the piezoelectric cell alone.
    Piezoelectric,
}

impl FilterKind {
    /// All filters, the fused ones first.
    pub const ALL: [Self; 5] = [
        Self::F1,
        Self::F2,
        Self::F3,
        Self::Piezoresistive,
        Self::Piezoelectric,
    ];

    /// Name, also in a scenario.
    pub fn name(self) -> &'static str {
        match self {
            Self::F1 => "F1",
            Self::F2 => "F2",
            Self::F3 => "F3",
            // Signals of the driver have the names of the cells.
            Self::Piezoresistive => "piezoresistive-only",
            Self::Piezoelectric => "piezoelectric-only",
        }
    }

    /// Description.
    pub fn about(self) -> &'static str {
        match self {
            Self::F1 => "the thesis' first filter: force, rate, bias",
            Self::F2 => "the thesis' second filter: and acceleration, and a measured frequency",
            Self::F3 => "the charge amplifier as states, no frequency",
            Self::Piezoresistive => "F3 with the piezoresistive cell alone",
            Self::Piezoelectric => "F3 with the piezoelectric cell alone",
        }
    }

    /// Number of swarms that search its covariances, of which the best counts: the objective of F2
    /// has several minima, and a swarm may stay at any of them. ASSUMED.
    pub(crate) fn swarms(self) -> u64 {
        if self == Self::F2 { 3 } else { 1 }
    }

    /// Returns whether both cells are used.
    pub fn is_fused(self) -> bool {
        matches!(self, Self::F1 | Self::F2 | Self::F3)
    }
}

/// A deviation that is tuned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Dimension {
    place: Place,
    /// Range of the search, in the unit of the deviation.
    pub(crate) range: search::Dimension,
    /// Value before tuning.
    start: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Place {
    /// Increment of a state over a millisecond.
    State(usize),
    /// Noise of the piezoelectric voltage.
    Piezoelectric,
}

/// Ranges of the deviations that a millisecond adds, and the values before tuning: of force, rate
/// and bias those of eq. 4.18, the others ASSUMED. Names are those of [`Model::names`].
const PROCESS: [(&str, (f64, f64), f64); 4] = [
    ("force", (1e-5, 1.0), 1e-2),         // N
    ("rate", (1e-4, 1e2), 0.316),         // N/s
    ("acceleration", (1e-1, 1e4), 100.0), // N/s²
    ("bias", (1e-8, 1.0), 1e-2),          // V
];
/// Deviation that a millisecond adds to the frequency \[rad/s\]: 2 Hz within a second. ASSUMED: it
/// is not tuned, as steady parts, which count, have constant frequencies.
const FREQUENCY_CHANGE: f64 = 2e-3 * std::f64::consts::TAU;
/// Range of the noise of the piezoelectric voltage \[V\]: from a third of the resolution of a card
/// with 16 bits over ±10 V.
const PIEZOELECTRIC: (f64, f64) = (1e-4, 1e2);
/// Deviation of the measured frequency \[rad/s\]: 0.05 Hz, the default of a scenario.
const FREQUENCY: f64 = 0.05 * std::f64::consts::TAU;
/// Deviations of the states at the start, those of a scenario: a load near zero and at rest.
const INITIAL: [(&str, f64); 7] = [
    ("force", 1.0),
    ("rate", 10.0),
    ("acceleration", 100.0),
    ("crystal rate", 10.0),
    ("voltage", 0.1),
    ("frequency", std::f64::consts::TAU),
    ("bias", 0.1),
];

/// Returns the settings of a filter before tuning, and the deviations to tune.
///
/// Estimates do not change if all variances have the same factor: the piezoresistive one is that of
/// the identification's residuals, which gives the others their scale.
pub(crate) fn untuned(kind: FilterKind, found: &Identification) -> (Settings, Vec<Dimension>) {
    let amplifier = found.amplifier.model.amplifier;
    let mut model = match kind {
        FilterKind::F1 => Model::F1 {
            gain: found.rate_sensor.model[0],
            states: [StateSettings::default(); 3],
        },
        FilterKind::F2 => Model::F2 {
            rate: found.coefficients.rate.model,
            acceleration: found.coefficients.acceleration.model,
            states: [StateSettings::default(); 5],
        },
        _ => Model::F3 {
            amplifier,
            states: [StateSettings::default(); 6],
        },
    };
    let names = model.names();
    let mut dimensions = Vec::new();
    for (index, state) in model.states_mut().iter_mut().enumerate() {
        let name = names[index];
        let initial = INITIAL.iter().find(|(known, _)| *known == name);
        state.variance = initial.map_or(0.0, |(_, deviation)| deviation * deviation);
        if name == "frequency" {
            state.noise = FREQUENCY_CHANGE * FREQUENCY_CHANGE;
        }
        // Without its voltage the bias has no effect.
        let unused = kind == FilterKind::Piezoresistive && name == "bias";
        let tuned = PROCESS.iter().find(|(known, ..)| *known == name && !unused);
        if let Some(&(_, range, start)) = tuned {
            dimensions.push(Dimension {
                place: Place::State(index),
                range: search::Dimension::logarithmic(range.0, range.1),
                start,
            });
        }
    }
    let with_voltage = kind != FilterKind::Piezoresistive;
    if with_voltage {
        let residual = match kind {
            FilterKind::F1 => found.rate_sensor.residual,
            FilterKind::F2 => found.residuals[1].deviation,
            _ => found.amplifier.residual,
        };
        dimensions.push(Dimension {
            place: Place::Piezoelectric,
            range: search::Dimension::logarithmic(PIEZOELECTRIC.0, PIEZOELECTRIC.1),
            start: residual.clamp(PIEZOELECTRIC.0, PIEZOELECTRIC.1),
        });
    }
    let residual = found.hysteresis.residual;
    let settings = Settings {
        model,
        piezoresistive: (kind != FilterKind::Piezoelectric).then_some(Piezoresistive {
            response: ForceResponse::Hysteresis(found.hysteresis.model),
            variance: residual * residual,
        }),
        piezoelectric: with_voltage.then_some(1.0),
        frequency: (kind == FilterKind::F2).then_some(FREQUENCY * FREQUENCY),
        period_s: 1e-3,
        white: 0.0,
        recovery: Some(RECOVERY),
    };
    let starts: Vec<f64> = dimensions.iter().map(|it| it.start).collect();
    (with_deviations(&settings, &dimensions, &starts), dimensions)
}

/// Returns the settings with these deviations.
pub(crate) fn with_deviations(
    settings: &Settings,
    dimensions: &[Dimension],
    deviations: &[f64],
) -> Settings {
    let mut settings = *settings;
    for (dimension, deviation) in dimensions.iter().zip(deviations) {
        let variance = deviation * deviation;
        match dimension.place {
            Place::State(index) => settings.model.states_mut()[index].noise = variance,
            Place::Piezoelectric => settings.piezoelectric = Some(variance),
        }
    }
    settings
}
