//! The models of the thesis.

use super::cells::CellFactor::{Glue, Layer, Length, Shape, Width};
use super::cells::CellResponse;
use super::effect::Effect;
use super::linear_model::LinearModel;
use crate::SensorError;

/// Printed row of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrintedAnova {
    /// Effect.
    pub effect: Effect,
    /// Coefficient \[unit of the response\].
    pub coefficient: f64,
    /// Sum of squares, and mean square \[unit squared\].
    pub sum_of_squares: f64,
    /// Ratio of mean square and residual variance.
    pub f: f64,
    /// Its p-value.
    pub p: f64,
}

/// Model of table 4.5, with four digits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrintedModel {
    /// Response.
    pub response: CellResponse,
    /// Constant \[unit of the response\].
    pub constant: f64,
    /// Effects.
    pub effects: &'static [PrintedAnova],
    /// Sum of squared residuals \[unit squared\].
    pub residual: f64,
    /// Degrees of freedom of the residuals.
    pub freedom: u32,
    /// Variance of the residuals \[unit squared\].
    pub variance: f64,
    /// The p-value of the whole model.
    pub p: f64,
}

impl PrintedModel {
    /// Returns the model of a response.
    pub fn of(response: CellResponse) -> &'static Self {
        match response {
            CellResponse::Sensitivity => &PRINTED_MODELS[0],
            CellResponse::Base => &PRINTED_MODELS[1],
            CellResponse::Saturation => &PRINTED_MODELS[2],
        }
    }

    /// Fits its effects to the sixteen cells.
    ///
    /// # Errors
    /// None: its effects are not aliased.
    pub fn refit(&self) -> Result<LinearModel, SensorError> {
        let effects: Vec<Effect> = self.effects.iter().map(|row| row.effect).collect();
        LinearModel::fit(&self.response.values(), &effects)
    }
}

const fn row(effect: Effect, coefficient: f64, squares: f64, f: f64, p: f64) -> PrintedAnova {
    PrintedAnova {
        effect,
        coefficient,
        sum_of_squares: squares,
        f,
        p,
    }
}

const GLUE_LENGTH: Effect = Effect::interaction(Glue, Length);
const LENGTH_WIDTH: Effect = Effect::interaction(Length, Width);

/// Table 4.5, in the order of [`CellResponse::ALL`].
pub const PRINTED_MODELS: [PrintedModel; 3] = [
    PrintedModel {
        response: CellResponse::Sensitivity,
        constant: 5.785e-6,
        effects: &[
            row(Effect::main(Glue), -1.690e-6, 4.569e-11, 10.93, 7.008e-3),
            row(Effect::main(Shape), 3.698e-6, 2.188e-10, 52.32, 1.68e-5),
            row(Effect::main(Width), 2.992e-6, 1.432e-10, 34.23, 1.106e-4),
            row(GLUE_LENGTH, 2.330e-6, 8.689e-11, 20.78, 8.192e-4),
        ],
        residual: 4.600e-11,
        freedom: 11,
        variance: 4.182e-12,
        p: 7.85e-6,
    },
    PrintedModel {
        response: CellResponse::Base,
        constant: 1.769e-5,
        effects: &[
            row(Effect::main(Shape), 1.751e-5, 4.907e-9, 11.25, 5.736e-3),
            row(Effect::main(Width), 1.080e-5, 1.866e-9, 4.278, 6.087e-2),
            row(LENGTH_WIDTH, -1.056e-5, 1.785e-9, 4.093, 6.591e-2),
        ],
        residual: 5.233e-9,
        freedom: 12,
        variance: 4.361e-10,
        p: 7.19e-3,
    },
    PrintedModel {
        response: CellResponse::Saturation,
        constant: 29.00,
        effects: &[
            row(Effect::main(Layer), 6.799, 739.6, 3.128, 0.1023),
            row(Effect::main(Shape), 10.13, 1641.0, 6.941, 0.021_79),
            row(LENGTH_WIDTH, -8.621, 1189.0, 5.028, 0.044_61),
        ],
        residual: 2838.0,
        freedom: 12,
        variance: 236.5,
        p: 0.0174,
    },
];
