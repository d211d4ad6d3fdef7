//! Displacement of each footstep per unit of the change.

use serde::Serialize;

use crate::modulation::{Counting, DisplacementTable};

/// Displacement of the n-th footstep after a change, per unit of the change.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StepSlope {
    /// Number of the footstep, from 1.
    pub step: usize,
    /// Slope of the regression of the displacement on the change, through the origin.
    pub slope: f64,
    /// Squared correlation of both; none without spread.
    pub r_squared: Option<f64>,
}

/// Returns the slopes by cycle of the leg.
pub(crate) fn step_slopes(tables: &[DisplacementTable]) -> Vec<StepSlope> {
    let table = tables.iter().find(|it| it.counting == Counting::Cycle);
    let Some(table) = table else {
        return Vec::new();
    };
    let slope = |step: usize| {
        let cells = table.cells.iter().filter(|cell| cell.step == step);
        let (mut product, mut square) = (0.0, 0.0);
        for cell in cells {
            product += cell.count as f64 * cell.by * cell.mean_m;
            square += cell.count as f64 * cell.by * cell.by;
        }
        (square > 0.0).then_some(product / square)
    };
    let steps = table.r_squared.iter().enumerate();
    steps
        .filter_map(|(place, r_squared)| {
            let step = place + 1;
            Some(StepSlope {
                step,
                slope: slope(step)?,
                r_squared: *r_squared,
            })
        })
        .collect()
}
