//! The full plant, out of a scenario's words.

use twinrig_document::Range;
use twinrig_kernel::{SimDuration, Unit};
use twinrig_lcp::{Lcp, Method, Options};
use twinrig_scenario::{Accepts, OptionSpec, OptionValue};

use crate::error::BuildError;
use crate::parts::option::choice;
use crate::parts::plant_kind::{PlantContext, PlantKind};
use crate::parts::setup::setup;

/// The plant's own step where a scenario gives none.
const STEP: SimDuration = SimDuration::from_millis(2);

pub(crate) fn kind() -> PlantKind {
    let methods = Method::ALL.map(|method| method.name().to_owned());
    PlantKind::new(
        "lcp",
        "trunk and legs with all their inertia, in generalised coordinates",
        lcp,
    )
    .with_option(choice("integrator", "how time is integrated", &methods))
    .with_option(OptionSpec {
        name: "tolerance".to_owned(),
        about: "error in the position of a foot that a step may make, for rk4 and rodas4"
            .to_owned(),
        accepts: Accepts::Quantity {
            unit: Unit::Meter,
            range: Range::POSITIVE,
        },
        default: Some(OptionValue::Number(Options::TOLERANCE)),
    })
    .with_option(OptionSpec {
        name: "toe".to_owned(),
        about: "the foot is a segment of its own where the robot has a toe joint".to_owned(),
        accepts: Accepts::Boolean,
        default: Some(OptionValue::Boolean(false)),
    })
    .with_step(STEP)
}

/// Builds the full plant: for a plant of one's own that stands around it.
///
/// # Errors
/// A robot or a ground that it refuses.
pub fn lcp(context: &PlantContext<'_>) -> Result<Lcp, BuildError> {
    let given = &context.plant.options;
    let name = given.text("integrator").unwrap_or_default();
    let mut methods = Method::ALL.into_iter();
    let options = Options {
        setup: setup(context, STEP)?,
        method: methods
            .find(|method| method.name() == name)
            .unwrap_or(Method::Rk4),
        tolerance: given.number("tolerance").unwrap_or(Options::TOLERANCE),
        toe: given.boolean("toe").unwrap_or(false),
    };
    Ok(Lcp::new(context.robot, &options, context.wanted)?)
}
