//! Kind of the massless-leg plant, built from scenario options.

use std::ops::RangeInclusive;

use twinrig_document::Range;
use twinrig_kernel::{SimDuration, Unit};
use twinrig_legged::Constraints;
use twinrig_massless::{Force, Massless, Options};
use twinrig_scenario::{Accepts, OptionSpec, Options as SceneOptions};

use crate::error::BuildError;
use crate::parts::constraints::{check_bar, constraints_choice, named_constraints};
use crate::parts::option::choice;
use crate::parts::plant_kind::{PlantContext, PlantKind};
use crate::parts::setup::{pushes, setup};

/// Default step of the plant.
const STEP: SimDuration = SimDuration::from_millis(1);
/// Default and accepted numbers of cells of the force table: smaller tables are too coarse for
/// walking, larger ones need gigabytes.
const CELLS: u64 = 64;
const ACCEPTED_CELLS: RangeInclusive<u64> = 16..=512;
const SOLVE: &str = "solve";
const LOOKUP: &str = "lookup";

pub(crate) fn kind() -> PlantKind {
    let forces = [SOLVE, LOOKUP].map(str::to_owned);
    PlantKind::new(
        "massless",
        "trunk and feet with mass, massless legs of springs",
        massless,
    )
    .with_option(choice(
        "force",
        "leg force from the spring equilibrium, or from a lookup table",
        &forces,
    ))
    .with_option(OptionSpec {
        name: "cells".to_owned(),
        about: format!("cells of the lookup table along each axis ({CELLS})"),
        accepts: Accepts::Natural(ACCEPTED_CELLS),
        // No default, so that a value given with another `force` is detected.
        default: None,
    })
    .with_option(constraints_choice())
    .with_option(OptionSpec {
        name: "tolerance".to_owned(),
        about: format!(
            "error tolerance of trunk and feet per millisecond, with compliant constraints ({:e} m)",
            Options::TOLERANCE
        ),
        accepts: Accepts::Quantity {
            unit: Unit::Meter,
            range: Range::POSITIVE,
        },
        // No default, so that a value given with rigid constraints is detected.
        default: None,
    })
    .with_step(STEP)
    .with_pushes()
}

/// Builds the massless-leg plant, for custom plants that wrap it.
///
/// # Errors
/// If the plant does not support the robot or the ground.
pub fn massless(context: &PlantContext<'_>) -> Result<Massless, BuildError> {
    let (setup, values) = (setup(context, STEP)?, &context.plant.options);
    let (force, tolerance) = (force(values)?, values.number("tolerance"));
    let constraints = named_constraints(values).unwrap_or_default();
    check_bar(context, constraints)?;
    let options = match (constraints, force, tolerance) {
        (Constraints::Compliant, Force::Solve, tolerance) => {
            Options::compliant(setup, tolerance.unwrap_or(Options::TOLERANCE))
        }
        (Constraints::Compliant, Force::Lookup { .. }, _) => {
            return Err("`force = \"lookup\"` requires `constraints = \"rigid\"`".into());
        }
        (Constraints::Rigid, force, None) => Options::new(setup, force),
        (Constraints::Rigid, _, Some(_)) => {
            return Err("`tolerance` requires `constraints = \"compliant\"`".into());
        }
    };
    let plant = Massless::new(context.robot, &options, context.wanted)?;
    Ok(plant.with_pushes(&pushes(context), context.wanted)?)
}

fn force(options: &SceneOptions) -> Result<Force, BuildError> {
    let cells = options.natural("cells");
    match (options.text("force"), cells) {
        (Some(LOOKUP), cells) => Ok(Force::Lookup {
            cells: usize::try_from(cells.unwrap_or(CELLS))?,
        }),
        (_, None) => Ok(Force::Solve),
        (_, Some(cells)) => {
            Err(format!("`cells = {cells}` requires `force = \"{LOOKUP}\"`").into())
        }
    }
}
