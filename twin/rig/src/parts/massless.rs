//! Kind of the massless-leg plant, built from scenario options.

use std::ops::RangeInclusive;

use twinrig_document::Range;
use twinrig_kernel::{SimDuration, Unit};
use twinrig_legged::Constraints;
use twinrig_massless::{Force, Massless, Method, Options};
use twinrig_scenario::{Accepts, OptionSpec, Options as SceneOptions};

use crate::error::BuildError;
use crate::parts::constraints::{check_bar, constraints_choice, named_constraints};
use crate::parts::context::PlantContext;
use crate::parts::method::TOLERANCE;
use crate::parts::option::{choice, option};
use crate::parts::plant_kind::PlantKind;
use crate::parts::setup::{pushes, setup};

/// Default step of the plant.
const STEP: SimDuration = SimDuration::from_millis(1);
/// Default and accepted numbers of cells of the force table: smaller tables are too coarse for
/// walking, larger ones need gigabytes.
const CELLS: u64 = 64;
const ACCEPTED_CELLS: RangeInclusive<u64> = 16..=512;
const SOLVE: &str = "solve";
const LOOKUP: &str = "lookup";
const LINEAR_LOOKUP: &str = "linear-lookup";
const INTEGRATOR: &str = "integrator";

pub(crate) fn kind() -> PlantKind {
    let forces = [SOLVE, LOOKUP, LINEAR_LOOKUP].map(str::to_owned);
    let methods = Method::ALL.map(|method| method.name().to_owned());
    PlantKind::new(
        "massless",
        "trunk and feet with mass, massless legs of springs",
        massless,
    )
    .with_option(choice(
        "force",
        "leg force from the spring equilibrium, or from a lookup table: of energies, interpolated \
         by cubics, or of forces, interpolated linearly",
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
    // No default, as it would ask for rigid constraints.
    .with_option(option(
        INTEGRATOR,
        "time integration method with rigid constraints (midpoint)",
        Accepts::Choice(methods.into()),
    ))
    .with_option(OptionSpec {
        name: TOLERANCE.to_owned(),
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
    .with_tolerance(|values| {
        let compliant = named_constraints(values) == Some(Constraints::Compliant);
        compliant.then(|| tolerance(values))
    })
    .with_pushes()
}

/// Builds the massless-leg plant, for custom plants that wrap it.
///
/// # Errors
/// If the plant does not support the robot or the ground.
pub fn massless(context: &PlantContext<'_>) -> Result<Massless, BuildError> {
    let (setup, values) = (setup(context, STEP)?, &context.plant.options);
    let (force, given) = (force(values)?, values.number(TOLERANCE));
    let constraints = named_constraints(values).unwrap_or_default();
    check_bar(context, constraints)?;
    let options = match (constraints, force, given) {
        (Constraints::Compliant, Force::Solve, _) => {
            if let Some(name) = values.text(INTEGRATOR) {
                let message =
                    format!("`integrator = \"{name}\"` requires `constraints = \"rigid\"`");
                return Err(message.into());
            }
            Options::compliant(setup, tolerance(values))
        }
        (Constraints::Compliant, Force::Lookup { .. } | Force::LinearLookup { .. }, _) => {
            let name = values.text("force").unwrap_or_default();
            return Err(format!("`force = \"{name}\"` requires `constraints = \"rigid\"`").into());
        }
        (Constraints::Rigid, force, None) => Options {
            method: method(values),
            ..Options::new(setup, force)
        },
        (Constraints::Rigid, _, Some(_)) => {
            return Err("`tolerance` requires `constraints = \"compliant\"`".into());
        }
    };
    let plant = Massless::new(context.robot, &options, context.wanted)?;
    Ok(plant.with_pushes(&pushes(context), context.wanted)?)
}

/// Returns the tolerance with compliant constraints \[m\].
fn tolerance(options: &SceneOptions) -> f64 {
    options.number(TOLERANCE).unwrap_or(Options::TOLERANCE)
}

fn method(options: &SceneOptions) -> Method {
    let name = options.text(INTEGRATOR).unwrap_or_default();
    let mut methods = Method::ALL.into_iter();
    methods
        .find(|method| method.name() == name)
        .unwrap_or_default()
}

fn force(options: &SceneOptions) -> Result<Force, BuildError> {
    let given = options.natural("cells");
    let cells = usize::try_from(given.unwrap_or(CELLS))?;
    match (options.text("force"), given) {
        (Some(LOOKUP), _) => Ok(Force::Lookup { cells }),
        (Some(LINEAR_LOOKUP), _) => Ok(Force::LinearLookup { cells }),
        (_, None) => Ok(Force::Solve),
        (_, Some(cells)) => Err(format!(
            "`cells = {cells}` requires `force = \"{LOOKUP}\"` or `force = \"{LINEAR_LOOKUP}\"`"
        )
        .into()),
    }
}
