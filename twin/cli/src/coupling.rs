//! How a plant meets those who sample and actuate, out of a scenario's words.

use twinrig_runtime::{GridRule, OnGrid, Plant};
use twinrig_scenario::{Coupling, GridInputs};

use crate::registry::BuildError;

/// Whether a plant that is coupled so has to tell `name`, where somebody wants what is `wanted`.
pub(crate) fn needs(coupling: Coupling, name: &str, wanted: &dyn Fn(&str) -> bool) -> bool {
    match coupling {
        Coupling::Exact => wanted(name),
        Coupling::Grid { .. } => OnGrid::needs(name, wanted),
    }
}

/// The plant, coupled so, telling what is `wanted`.
pub(crate) fn coupled(
    coupling: Coupling,
    plant: Box<dyn Plant>,
    wanted: &dyn Fn(&str) -> bool,
) -> Result<Box<dyn Plant>, BuildError> {
    let Coupling::Grid { step, inputs } = coupling else {
        return Ok(plant);
    };
    let rule = match inputs {
        GridInputs::Mean => GridRule::Behind,
        GridInputs::Held => GridRule::Ahead,
    };
    Ok(Box::new(OnGrid::new(plant, step, rule, wanted)?))
}

/// The same in words.
pub(crate) fn told(coupling: Coupling) -> String {
    match coupling {
        Coupling::Exact => {
            "exact: the plant is moved to every instant at which somebody samples or actuates"
                .to_owned()
        }
        Coupling::Grid { step, inputs } => {
            let between = match inputs {
                GridInputs::Mean => {
                    "commands act by their mean over a step, samples in it are extrapolated"
                }
                GridInputs::Held => {
                    "commands act from its next instant on, samples before it are interpolated"
                }
            };
            format!(
                "on a grid of {} ms: {between}",
                step.as_nanos() as f64 / 1e6
            )
        }
    }
}
