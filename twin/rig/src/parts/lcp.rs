//! Kind of the full rigid-body plant, built from scenario options.

use twinrig_document::Range;
use twinrig_kernel::{SimDuration, Unit};
use twinrig_lcp::{Constraints, Features, Lcp, Method, Options};
use twinrig_scenario::{Accepts, OptionSpec, OptionValue, Options as SceneOptions};

use crate::error::BuildError;
use crate::parts::constraints::{check_bar, constraints_choice, named_constraints};
use crate::parts::context::PlantContext;
use crate::parts::method::TOLERANCE;
use crate::parts::option::choice;
use crate::parts::plant_kind::PlantKind;
use crate::parts::setup::{pushes, setup};

/// Default step of the plant.
const STEP: SimDuration = SimDuration::from_millis(2);

pub(crate) fn kind() -> PlantKind {
    let methods = Method::ALL.map(|method| method.name().to_owned());
    PlantKind::new(
        "lcp",
        "rigid-body model of trunk and legs with full inertia, in generalised coordinates",
        lcp,
    )
    .with_option(constraints_choice())
    .with_option(choice("integrator", "time integration method", &methods))
    .with_option(OptionSpec {
        name: TOLERANCE.to_owned(),
        about: format!(
            "error tolerance of foot positions: per step of rk4 and rodas4 with rigid constraints \
             ({:e} m), per millisecond with compliant ones ({:e} m)",
            Options::TOLERANCE,
            Options::COMPLIANT_TOLERANCE
        ),
        accepts: Accepts::Quantity {
            unit: Unit::Meter,
            range: Range::POSITIVE,
        },
        // The default depends on the constraints.
        default: None,
    })
    .with_option(OptionSpec {
        name: "toe".to_owned(),
        about: "simulate the foot as a separate segment if the robot has a toe joint".to_owned(),
        accepts: Accepts::Boolean,
        default: Some(OptionValue::Boolean(false)),
    })
    .with_step(STEP)
    .with_tolerance(|values| Some(tolerance(values)))
    .with_pushes()
}

/// Builds the full plant, for custom plants that wrap it.
///
/// # Errors
/// If the plant does not support the robot or the ground.
pub fn lcp(context: &PlantContext<'_>) -> Result<Lcp, BuildError> {
    let values = &context.plant.options;
    let name = values.text("integrator").unwrap_or_default();
    let mut methods = Method::ALL.into_iter();
    let constraints = named_constraints(values).unwrap_or_default();
    check_bar(context, constraints)?;
    let options = Options {
        constraints,
        setup: setup(context, STEP)?,
        method: methods
            .find(|method| method.name() == name)
            .unwrap_or(Method::Rk4),
        tolerance: tolerance(values),
        toe: values.boolean("toe").unwrap_or(false),
        features: Features::Detected,
    };
    let plant = Lcp::new(context.robot, &options, context.wanted)?;
    Ok(plant.with_pushes(&pushes(context), context.wanted)?)
}

/// Returns the tolerance, that of the constraints where the scenario has none \[m\].
fn tolerance(values: &SceneOptions) -> f64 {
    let of_constraints = match named_constraints(values).unwrap_or_default() {
        Constraints::Rigid => Options::TOLERANCE,
        Constraints::Compliant => Options::COMPLIANT_TOLERANCE,
    };
    values.number(TOLERANCE).unwrap_or(of_constraints)
}
