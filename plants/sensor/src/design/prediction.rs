//! Predicted characteristic of a cell.

use std::fmt;

use super::cells::{CellDesign, CellFactor, CellResponse, Electrode, LAYERS, LENGTH, WIDTH};
use super::effect::Effect;
use super::linear_model::{LinearModel, PredictionInterval};
use super::printed::PrintedModel;
use crate::SensorError;
use crate::piezoresistive::{Characteristic, ResistanceAmplifier, Saturating};

/// Electrodes of type B (section 4.2.2.1): width of a strip and distance between strips \[m\].
const STRIP: f64 = 2e-3;
const DISTANCE: f64 = 1e-3;
/// Strips of the narrowest cell: one for each main conductor.
const LEAST_STRIPS: f64 = 2.0;
/// Deviation of a width from a whole number of strips that is rounding \[strips\].
const ROUNDING: f64 = 1e-9;

/// Prediction of a response if an effect of its model is really the interaction aliased with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AliasedReading {
    /// Response.
    pub response: CellResponse,
    /// Effect of the model.
    pub effect: Effect,
    /// Two-factor interaction that the design cannot distinguish from it.
    pub alias: Effect,
    /// Predicted value \[unit of the response\].
    pub value: f64,
}

/// Departure of a design from what was tested or can be made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Departure {
    /// A factor is outside the tested range: the prediction is extrapolated.
    Outside {
        /// Factor.
        factor: CellFactor,
        /// Its value \[m, or layers\].
        value: f64,
        /// Tested range \[m, or layers\].
        range: [f64; 2],
    },
    /// A discrete factor is between its levels: the prediction is interpolated.
    Between {
        /// Factor.
        factor: CellFactor,
        /// Its value.
        value: f64,
        /// Its levels.
        levels: [f64; 2],
    },
    /// The width of a type B cell is not that of a whole number of strips with their distances.
    /// The rule, 3 mm n − 1 mm, is ASSUMED: the thesis says that widths are discrete, not which;
    /// both tested widths follow it.
    Strips {
        /// Width \[m\].
        width: f64,
        /// Next narrower width, of two strips at least, and next wider one \[m\].
        nearest: [f64; 2],
    },
}

impl fmt::Display for Departure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Outside {
                factor,
                value,
                range,
            } => {
                let unit = if *factor == CellFactor::Layer {
                    ""
                } else {
                    " mm"
                };
                let [value, low, high] = [*value, range[0], range[1]].map(|it| shown(*factor, it));
                let name = name(*factor);
                write!(
                    f,
                    "the {name}, {value}{unit}, is outside the tested range of {low} to {high}{unit}: extrapolated"
                )
            }
            Self::Between {
                factor,
                value,
                levels: [low, high],
            } => write!(
                f,
                "the {}, {value}, is between the tested levels {low} and {high}: interpolated",
                name(*factor)
            ),
            Self::Strips { width, nearest } => {
                let widths = [*width, nearest[0], nearest[1]];
                let [width, below, above] = widths.map(|it| shown(CellFactor::Width, it));
                write!(
                    f,
                    "type B of 2 mm strips at distances of 1 mm has no width of {width} mm: {below} mm and {above} mm are next (assumed rule)"
                )
            }
        }
    }
}

/// Name in a sentence.
fn name(factor: CellFactor) -> &'static str {
    match factor {
        CellFactor::Glue => "glue",
        CellFactor::Layer => "number of layers",
        CellFactor::Shape => "shape",
        CellFactor::Length => "length",
        CellFactor::Width => "width",
    }
}

/// Returns a number of layers, or a length in millimetres to the micrometre.
fn shown(factor: CellFactor, value: f64) -> f64 {
    match factor {
        CellFactor::Layer => value,
        _ => (value * 1e6).round() / 1e3,
    }
}

impl CellDesign {
    /// Returns how the design departs from what was tested or can be made; empty if it does not.
    pub fn departures(&self) -> Vec<Departure> {
        let mut departures = Vec::new();
        let layers = f64::from(self.layers);
        let ranges = [
            (CellFactor::Layer, layers, LAYERS),
            (CellFactor::Length, self.length, LENGTH),
            (CellFactor::Width, self.width, WIDTH),
        ];
        for (factor, value, range) in ranges {
            if value < range[0] || value > range[1] {
                departures.push(Departure::Outside {
                    factor,
                    value,
                    range,
                });
            }
        }
        if layers > LAYERS[0] && layers < LAYERS[1] {
            departures.push(Departure::Between {
                factor: CellFactor::Layer,
                value: layers,
                levels: LAYERS,
            });
        }
        let pitch = STRIP + DISTANCE;
        let strips = (self.width + DISTANCE) / pitch;
        if self.electrode == Electrode::B && (strips - strips.round()).abs() > ROUNDING {
            let below = strips.floor().max(LEAST_STRIPS);
            departures.push(Departure::Strips {
                width: self.width,
                nearest: [below, below + 1.0].map(|strips| strips * pitch - DISTANCE),
            });
        }
        departures
    }
}

/// Predicted characteristic of a cell, by the models of table 4.5 refitted to the sixteen cells.
#[derive(Clone, Debug, PartialEq)]
pub struct CellPrediction {
    /// Sensitivity with its 95 % prediction interval \[S/N\].
    pub sensitivity: PredictionInterval,
    /// Base conductance with its 95 % prediction interval \[S\].
    pub base: PredictionInterval,
    /// Saturation load with its 95 % prediction interval \[N\].
    pub saturation: PredictionInterval,
    /// What the models predict if their interactions are attributed to the aliases.
    pub readings: Vec<AliasedReading>,
    /// Departures of the design from what was tested.
    pub departures: Vec<Departure>,
    /// Intervals that contain all three parameters of a new cell with a probability of 95 %, in the
    /// order of [`CellResponse::ALL`].
    joint: [PredictionInterval; 3],
}

impl CellPrediction {
    /// Probability of an interval to contain a new cell.
    pub const COVERAGE: f64 = 0.95;

    /// Predicts the characteristic of a cell.
    ///
    /// # Errors
    /// A length or width that is not positive and finite, or no layer.
    pub fn of(design: &CellDesign) -> Result<Self, SensorError> {
        let dimensions = [
            ("length", design.length),
            ("width", design.width),
            ("number of layers", f64::from(design.layers)),
        ];
        for (what, value) in dimensions {
            if !(value > 0.0 && value.is_finite()) {
                return Err(SensorError::Dimension { what, value });
            }
        }
        let coded = design.coded();
        let [a1, a2, load] = CellResponse::ALL.map(|response| {
            let model = PrintedModel::of(response).refit()?;
            // Bonferroni: three intervals that fail with a third of the probability each.
            let joint = model.predict(&coded, 1.0 - (1.0 - Self::COVERAGE) / 3.0);
            let readings = aliased_readings(response, &model, &coded);
            Ok::<_, SensorError>((model.predict(&coded, Self::COVERAGE), joint, readings))
        });
        let (a1, a2, load) = (a1?, a2?, load?);
        Ok(Self {
            sensitivity: a1.0,
            base: a2.0,
            saturation: load.0,
            readings: [a1.2, a2.2, load.2].concat(),
            departures: design.departures(),
            joint: [a1.1, a2.1, load.1],
        })
    }

    /// Expected characteristic.
    pub fn characteristic(&self) -> Characteristic {
        Characteristic::Saturating(Saturating {
            sensitivity: self.sensitivity.value,
            base: self.base.value,
            saturation: self.saturation.value,
        })
    }

    /// Output of an amplifier under a load \[N\], infinite for a saturated cell, \[V\].
    ///
    /// The interval contains a new cell's output with a probability of at least 95 %: it spans the
    /// outputs of all cells within joint intervals of the three parameters, without assumption on
    /// how these are correlated. Sensitivity and saturation load of a cell are not negative.
    /// Without load only the base conductance counts, and the interval is that of it alone.
    pub fn volts(&self, amplifier: &ResistanceAmplifier, load: f64) -> PredictionInterval {
        let volts = |sensitivity: f64, base, saturation: f64| {
            let cell = Characteristic::Saturating(Saturating {
                sensitivity: sensitivity.max(0.0),
                base,
                saturation: saturation.max(0.0),
            });
            amplifier.volts(cell.conductance(load, 0.0))
        };
        let [sensitivity, base, saturation] = if load == 0.0 {
            [self.sensitivity, self.base, self.saturation]
        } else {
            self.joint
        };
        // The output rises with each of the three.
        PredictionInterval {
            value: volts(sensitivity.value, base.value, saturation.value),
            low: volts(sensitivity.low, base.low, saturation.low),
            high: volts(sensitivity.high, base.high, saturation.high),
        }
    }
}

/// Predictions of a model with each of its two-factor interactions attributed to its alias.
fn aliased_readings(
    response: CellResponse,
    model: &LinearModel,
    coded: &[f64; 5],
) -> Vec<AliasedReading> {
    let reading = |effect: Effect| {
        let aliases = effect.aliases();
        let (alias, sign) = aliases.into_iter().find(|(alias, _)| alias.order() == 2)?;
        let attributed = |other| {
            if other == effect {
                (alias, sign)
            } else {
                (other, 1.0)
            }
        };
        Some(AliasedReading {
            response,
            effect,
            alias,
            value: model.value(coded, attributed),
        })
    };
    let effects = model.effects.iter().map(|row| row.effect);
    let interactions = effects.filter(|effect| effect.order() == 2);
    interactions.filter_map(reading).collect()
}
