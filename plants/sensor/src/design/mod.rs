//! Design of piezoresistive cells: the parameters of [`Characteristic::Saturating`] from the
//! dimensions of a cell, by the linear models of the thesis (sections 4.2.2 and 4.2.3).
//!
//! Sixteen characterised cells ([`CELLS`]) vary five factors at two levels. [`LinearModel::fit`]
//! fits a response to effects of the coded factors by least squares, with the analysis of variance;
//! [`PRINTED_MODELS`] are the models of the thesis. [`Elimination`] selects effects by backward
//! elimination, [`CellPrediction`] predicts a cell with prediction intervals, and
//! [`fit_saturating`] fits the characteristic itself to measured points (appendix B).
//!
//! ```
//! use twinrig_sensor::design::{CellDesign, CellPrediction, Electrode};
//!
//! let foot = CellDesign {
//!     electrode: Electrode::B,
//!     layers: 2,
//!     glue: true,
//!     length: 20e-3,
//!     width: 25e-3,
//! };
//! let prediction = CellPrediction::of(&foot)?;
//! assert!((prediction.saturation.value - 31.5).abs() < 0.05);
//! assert!(prediction.saturation.low < 0.0 && prediction.saturation.high > 60.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Limits:
//! - Factors are coded: −1 at the lower and +1 at the upper tested level. A coefficient is half the
//!   change of the response between the two levels, the other factors being in the middle.
//! - The temperature was not varied (section 4.2.2.2). What was run of the 2^(6−2) design is then a
//!   2^(5−1) design with the defining relation I = Glue·Shape·Length·Width: three pairs of
//!   two-factor interactions are aliased ([`Effect::aliases`]), and no analysis can tell which of a
//!   pair acts. The models of the thesis attribute each to one of the pair, which matters between
//!   the levels.
//! - The product Length·Width of coded factors is not the area: it is +1 for the smallest and for
//!   the largest cell.
//! - Eight cells were made, each measured with two and with six layers. As in the thesis, the
//!   analysis takes the sixteen measurements as independent; if pairs share an error of
//!   manufacture, p-values of all factors but the layers are too small. The residuals of pairs show
//!   none: they are not positively correlated.
//! - The models are linear: sensitivity and saturation load may be predicted negative.

mod cells;
mod effect;
mod elimination;
mod linear_model;
mod prediction;
mod printed;
mod saturating_fit;

#[cfg(doc)]
use crate::Characteristic;

pub use cells::{CELLS, CellDesign, CellFactor, CellResponse, Electrode, TestedCell};
pub use effect::Effect;
pub use elimination::{Elimination, Removal, THRESHOLD};
pub use linear_model::{Anova, LinearModel, PredictionInterval};
pub use prediction::{AliasedReading, CellPrediction, Departure};
pub use printed::{PRINTED_MODELS, PrintedAnova, PrintedModel};
pub use saturating_fit::{SaturatingFit, fit_saturating};
