//! Errors that do not decrease with the step.

use serde::Serialize;
use twinrig_rig::PlantId;

use crate::plants::row::{Row, RowKind, Status};
use crate::plants::study::Study;

/// Smallest error of a method, and the step from which on it no longer decreases.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Floor {
    /// Plant.
    #[serde(flatten)]
    pub plant: PlantId,
    /// Method.
    pub method: String,
    /// Smallest RMS error over all steps \[m\].
    pub error_rms_m: f64,
    /// Step with that error \[s\].
    pub step_s: f64,
    /// RMS error at the shortest completed step \[m\].
    pub finest_error_rms_m: f64,
    /// Shortest completed step \[s\].
    pub finest_step_s: f64,
    /// The smallest error is no greater than the disagreement of the reference and its check.
    pub at_floor: bool,
    /// Step below which the error is not halved any more, although there are steps of a quarter of
    /// it; `None` if the error keeps decreasing or is at the floor of the reference \[s\].
    pub levels_off_from_s: Option<f64>,
}

/// Errors within this factor of the smallest count as equal to it.
const AS_GOOD: f64 = 2.0;
/// Ratio of steps over which even a first-order method would reduce its error by more than that
/// factor.
const SHORTER: f64 = 4.0;

impl Study {
    /// Returns the smallest error of each fixed-step method.
    pub fn floors(&self) -> Vec<Floor> {
        let series = self.series().into_iter().filter(|key| !key.is_adaptive());
        series
            .filter_map(|key| {
                let rows = self.rows.iter().filter(|row| {
                    row.kind == RowKind::Integration
                        && row.status == Status::Ok
                        && row.series() == key
                });
                let known = rows.filter_map(|row| Some((row.step_s?, row.error_rms_m?, row)));
                floor(key.plant, key.method, &known.collect::<Vec<_>>())
            })
            .collect()
    }
}

fn floor(plant: &PlantId, method: &str, known: &[(f64, f64, &Row)]) -> Option<Floor> {
    let best = known.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
    let finest = known.iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    let as_good = known
        .iter()
        .filter(|(_, error, _)| *error <= AS_GOOD * best.1);
    let from_s = as_good.map(|(step, ..)| *step).fold(0.0, f64::max);
    let levels = !best.2.at_floor && from_s >= SHORTER * finest.0 * (1.0 - 1e-9);
    Some(Floor {
        plant: plant.clone(),
        method: method.to_owned(),
        error_rms_m: best.1,
        step_s: best.0,
        finest_error_rms_m: finest.1,
        finest_step_s: finest.0,
        at_floor: best.2.at_floor,
        levels_off_from_s: levels.then_some(from_s),
    })
}
