//! Formulation of the constraints of a plant, and the course of set-points that goes with it: what
//! a scenario has that names neither.

use twinrig_legged::Constraints;
use twinrig_robot::Robot;
use twinrig_scenario::{
    Accepts, ActuatorKind, LegFact, OptionSpec, OptionValue, Options, Scenario, SetPointKind,
};

use crate::parts::option::option;

/// Plant option with the formulation.
pub(crate) const CONSTRAINTS: &str = "constraints";

/// Plant options with values that only rigid constraints have.
const OF_RIGID: [(&str, Option<&str>); 3] = [
    ("integrator", Some("rk4")),
    ("force", Some("solve")),
    ("cells", None),
];

/// Rules for values that a scenario leaves open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DefaultRules {
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
pub(crate) fn complete(
    scenario: &mut Scenario,
    has_choice: bool,
    robot: Option<&Robot>,
    legs: &[LegFact],
    rules: DefaultRules,
) {
    let asked = named_constraints(&scenario.plant.options).or_else(|| {
        (has_choice && is_of_rigid(&scenario.plant.options)).then_some(Constraints::Rigid)
    });
    let driven = scenario.controller.is_some() && scenario.actuator.kind != ActuatorKind::None;
    let present = rules == DefaultRules::Present;
    let compliant = present && driven && has_compliance(scenario, robot, legs);
    let open = if compliant {
        Constraints::Compliant
    } else {
        Constraints::Rigid
    };
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
}

/// Whether an option has a value that only rigid constraints have.
fn is_of_rigid(options: &Options) -> bool {
    OF_RIGID
        .iter()
        .any(|&(name, of_both)| options.get(name).is_some() && options.text(name) != of_both)
}

/// Whether legs and ground can be compliant.
fn has_compliance(scenario: &Scenario, robot: Option<&Robot>, legs: &[LegFact]) -> bool {
    let ground = scenario.plant.ground.as_ref();
    let rebounds = ground.is_some_and(|ground| ground.restitution > 0.0);
    let mut mounts = robot.iter().flat_map(|robot| &robot.legs);
    let simulated = |name: &str| legs.iter().any(|leg| leg.name == name);
    !rebounds && mounts.all(|leg| leg.leg.compliance.is_some() || !simulated(&leg.name))
}
