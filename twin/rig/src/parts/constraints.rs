//! Formulation of the constraints of a plant, and the course of set-points that goes with it: what
//! a scenario has that names neither.
//!
//! They are completed once, when a scenario is assembled: plan, report and studies read the
//! completed scenario. A recording notes the version of the rules (`DefaultRules`), and its
//! replay follows them.

use twinrig_document::{Problem, print_quantity};
use twinrig_kernel::Unit;
use twinrig_legged::Constraints;
use twinrig_robot::Robot;
use twinrig_scenario::{
    Accepts, ActuatorKind, LeftOut, LegFact, OptionSpec, OptionValue, Options, Profile, Scenario,
    SetPointKind,
};

use crate::error::BuildError;
use crate::parts::context::PlantContext;
use crate::parts::option::option;

/// Plant option with the formulation.
pub const CONSTRAINTS: &str = "constraints";

/// Plant options with values that only rigid constraints have.
const OF_RIGID: [(&str, Option<&str>); 3] = [
    ("integrator", Some("rk4")),
    ("force", Some("solve")),
    ("cells", None),
];

/// Rules for values that a scenario leaves open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DefaultRules {
    /// Of this version.
    Present,
    /// Of recordings made before there were compliant constraints by default: rigid constraints,
    /// held set-points.
    Former,
}

/// Returns the option. Its default depends on drives, ground and robot.
pub(crate) fn constraints_choice() -> OptionSpec {
    let about = "stops, cables and contact: rigid, or compliant with the stiffness of the robot \
                 file (compliant where a controller drives the legs and the robot file has it)";
    let names = Constraints::ALL.map(|constraints| constraints.name().to_owned());
    option(CONSTRAINTS, about, Accepts::Choice(names.into()))
}

/// Returns the formulation that the options name, if they do.
pub(crate) fn named_constraints(options: &Options) -> Option<Constraints> {
    let name = options.text(CONSTRAINTS)?;
    let mut formulations = Constraints::ALL.into_iter();
    formulations.find(|formulation| formulation.name() == name)
}

/// Completes constraints and set-points of a scenario that leaves them open.
///
/// Legs that a controller drives have compliant constraints, where the robot file describes them:
/// their motion is then smooth, and a Runge–Kutta method follows it. Anything else is rigid.
/// Set-points are linear, for any plant, so that plants can be compared; those of a scenario that
/// asks for rigid constraints are held, because nothing is gained there. `has_choice`: whether the
/// plant declares the option; one that wraps a plant of ours gets the default as well.
///
/// Returns the compliance of driven legs as left out, with the reason, where the plant has the
/// choice and the scenario makes none.
pub(crate) fn complete(
    scenario: &mut Scenario,
    has_choice: bool,
    robot: Option<&Robot>,
    legs: &[LegFact],
    rules: DefaultRules,
) -> Option<LeftOut> {
    let asked = named_constraints(&scenario.plant.options).or_else(|| {
        (has_choice && is_of_rigid(&scenario.plant.options)).then_some(Constraints::Rigid)
    });
    let driven = scenario.controller.is_some() && scenario.actuator.kind != ActuatorKind::None;
    let present = rules == DefaultRules::Present;
    let prevented = no_compliance(scenario, robot, legs);
    let compliant = present && driven && prevented.is_none();
    let open = if compliant {
        Constraints::Compliant
    } else {
        Constraints::Rigid
    };
    let is_open = present && driven && has_choice && asked.is_none();
    let left_out = prevented.filter(|_| is_open).map(|why| LeftOut {
        part: "compliance of stops, cables and soles".to_owned(),
        why,
    });
    let name = asked.unwrap_or(open).name();
    let options = std::mem::take(&mut scenario.plant.options);
    scenario.plant.options = options.with(CONSTRAINTS, OptionValue::Text(name.to_owned()));
    let actuator = &mut scenario.actuator;
    if actuator.kind.has_set_points() && actuator.set_point.is_none() {
        let linear = present && driven && asked != Some(Constraints::Rigid);
        let course = if linear {
            SetPointKind::Linear
        } else {
            SetPointKind::Held
        };
        actuator.set_point = Some(course);
    }
    left_out
}

/// Refuses a bar that would be no obstacle: rigid constraints have no walls, and a compliant foot
/// that is beyond the middle of a bar is pushed out of its far side.
pub(crate) fn check_bar(
    context: &PlantContext<'_>,
    constraints: Constraints,
) -> Result<(), BuildError> {
    let Some(ground) = &context.plant.ground else {
        return Ok(());
    };
    let Profile::Bar { length, .. } = ground.profile else {
        return Ok(());
    };
    let refused = |message: String, help: &str| {
        let problem = Problem::at(&ground.place, message, help);
        Err(twinrig_document::DocumentError::from(problem).into())
    };
    if constraints == Constraints::Rigid {
        let message = "with rigid constraints feet pass through a bar: they have no walls";
        let help = "set `constraints = \"compliant\"` in [plant], or take the profile `hole`";
        return refused(message.to_owned(), help);
    }
    let least = bar_length_least(context);
    if length < least {
        let least = print_quantity((1e4 * least).ceil() / 1e4, Unit::Meter);
        let message = format!("feet of this robot may pass through a bar of less than {least}");
        return refused(message, "give a greater `length`");
    }
    Ok(())
}

/// Speed of an impact on a bar \[m/s\]: that of a running robot.
const IMPACT_SPEED: f64 = 1.0;

/// Returns the least length of a bar \[m\]: twice the depth in which the softest sole stops the
/// share of a leg in the mass of the robot.
fn bar_length_least(context: &PlantContext<'_>) -> f64 {
    let simulated = context.robot.legs.iter();
    let simulated = simulated.filter(|leg| context.legs.contains(&leg.name.as_str()));
    let soles = simulated.filter_map(|leg| Some(leg.leg.compliance?.sole.stiffness));
    let softest = soles.fold(f64::INFINITY, f64::min);
    let mass = context.robot.mass() / context.legs.len().max(1) as f64;
    2.0 * IMPACT_SPEED * (mass / softest).sqrt()
}

/// Whether an option has a value that only rigid constraints have.
fn is_of_rigid(options: &Options) -> bool {
    OF_RIGID
        .iter()
        .any(|&(name, of_both)| options.get(name).is_some() && options.text(name) != of_both)
}

/// Returns the reason for which legs and ground cannot be compliant.
fn no_compliance(scenario: &Scenario, robot: Option<&Robot>, legs: &[LegFact]) -> Option<String> {
    let ground = scenario.plant.ground.as_ref();
    if ground.is_some_and(|ground| ground.restitution > 0.0) {
        return Some("a ground with restitution is rigid".to_owned());
    }
    let mut mounts = robot.iter().flat_map(|robot| &robot.legs);
    let simulated = |name: &str| legs.iter().any(|leg| leg.name == name);
    let rigid = mounts.find(|leg| leg.leg.compliance.is_none() && simulated(&leg.name))?;
    Some(format!(
        "the robot file has no [leg.{}.compliance]: docs/tutorial-robot.md shows one",
        rigid.kind
    ))
}
