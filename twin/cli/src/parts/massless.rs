//! The mass-less plant, out of a scenario's words.

use std::ops::RangeInclusive;

use twinrig_kernel::SimDuration;
use twinrig_massless::{Force, Massless, Options};
use twinrig_scenario::{Accepts, OptionSpec, Options as SceneOptions};

use crate::error::BuildError;
use crate::parts::option::choice;
use crate::parts::plant_kind::{PlantContext, PlantKind};
use crate::parts::setup::setup;

/// The plant's own step where a scenario gives none.
const STEP: SimDuration = SimDuration::from_millis(1);
/// Cells of the force table where a scenario does not say, and how many it may: fewer are too coarse to walk with, more take
/// gigabytes.
const CELLS: u64 = 64;
const ACCEPTED_CELLS: RangeInclusive<u64> = 16..=512;
const SOLVE: &str = "solve";
const LOOKUP: &str = "lookup";

pub(crate) fn kind() -> PlantKind {
    let forces = [SOLVE, LOOKUP].map(str::to_owned);
    PlantKind::new(
        "massless",
        "trunk and feet with mass, legs of springs without",
        massless,
    )
    .with_option(choice(
        "force",
        "leg force from the equilibrium of its springs, or from a table",
        &forces,
    ))
    .with_option(OptionSpec {
        name: "cells".to_owned(),
        about: format!("cells of that table along each axis ({CELLS})"),
        accepts: Accepts::Natural(ACCEPTED_CELLS),
        // None, so that a number that is given beside another `force` shows.
        default: None,
    })
    .with_step(STEP)
}

/// Builds the mass-less plant: for a plant of one's own that stands around it.
///
/// # Errors
/// A robot or a ground that it refuses.
pub fn massless(context: &PlantContext<'_>) -> Result<Massless, BuildError> {
    let options = Options {
        setup: setup(context, STEP)?,
        force: force(&context.plant.options)?,
    };
    Ok(Massless::new(context.robot, &options, context.wanted)?)
}

fn force(options: &SceneOptions) -> Result<Force, BuildError> {
    let cells = options.natural("cells");
    match (options.text("force"), cells) {
        (Some(LOOKUP), cells) => Ok(Force::Lookup {
            cells: usize::try_from(cells.unwrap_or(CELLS))?,
        }),
        (_, None) => Ok(Force::Solve),
        (_, Some(cells)) => Err(format!(
            "`cells = {cells}` is for the table of `force = \"{LOOKUP}\"`, and `force` is not that"
        )
        .into()),
    }
}
