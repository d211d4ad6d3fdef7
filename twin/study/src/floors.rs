//! What no step makes smaller.

use serde::Serialize;

use crate::row::{Row, RowKind, Status};
use crate::study::Study;

/// How near a method comes to its reference at all.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Floor {
    /// Its plant.
    pub plant: String,
    /// Its name.
    pub method: String,
    /// The smallest error of all its steps, RMS \[m\].
    pub error_rms_m: f64,
    /// The step that has it \[s\].
    pub step_s: f64,
    /// The error at the shortest step that came to the end, RMS \[m\].
    pub finest_error_rms_m: f64,
    /// That step \[s\].
    pub finest_step_s: f64,
    /// The smallest error is no greater than what is known of the reference.
    pub at_floor: bool,
    /// From this step on, shorter ones do not halve the error any more, though there are some a quarter as long; none: they do,
    /// or the error is at the floor of the reference \[s\].
    pub levels_off_from_s: Option<f64>,
}

/// Errors within this factor of the smallest are as good.
const AS_GOOD: f64 = 2.0;
/// Over so much shorter steps even a method of first order would have got better by more than that.
const SHORTER: f64 = 4.0;

impl Study {
    /// How near each method that steps comes to its reference.
    pub fn floors(&self) -> Vec<Floor> {
        let lines = self.lines().into_iter().filter(|line| !line.is_adaptive());
        lines
            .filter_map(|line| {
                let rows = self.rows.iter().filter(|row| {
                    row.kind == RowKind::Integration
                        && row.status == Status::Ok
                        && row.line() == line
                });
                let known = rows.filter_map(|row| Some((row.step_s?, row.error_rms_m?, row)));
                floor(line.plant, line.method, &known.collect::<Vec<_>>())
            })
            .collect()
    }
}

fn floor(plant: &str, method: &str, known: &[(f64, f64, &Row)]) -> Option<Floor> {
    let best = known.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
    let finest = known.iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    let as_good = known
        .iter()
        .filter(|(_, error, _)| *error <= AS_GOOD * best.1);
    let from_s = as_good.map(|(step, ..)| *step).fold(0.0, f64::max);
    let levels = !best.2.at_floor && from_s >= SHORTER * finest.0 * (1.0 - 1e-9);
    Some(Floor {
        plant: plant.to_owned(),
        method: method.to_owned(),
        error_rms_m: best.1,
        step_s: best.0,
        finest_error_rms_m: finest.1,
        finest_step_s: finest.0,
        at_floor: best.2.at_floor,
        levels_off_from_s: levels.then_some(from_s),
    })
}
