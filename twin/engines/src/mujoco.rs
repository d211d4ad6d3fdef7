//! Plants on MuJoCo, built from scenario options.

use twinrig_document::Range;
use twinrig_kernel::{SimDuration, Unit};
use twinrig_mujoco::{
    Cone, Coordinates, Integrator, Mujoco, Numerics, Options, Solver, TimeConstant,
};
use twinrig_scenario::{Accepts, OptionSpec, OptionValue, Options as ScenarioOptions};

use twinrig_rig::{BuildError, PlantContext};

use twinrig_rig::parts::engines::MUJOCO;
use twinrig_rig::parts::method::STEP_ONLY;
use twinrig_rig::parts::option::{choice, number, option};
use twinrig_rig::parts::plant_kind::PlantKind;
use twinrig_rig::parts::setup::{pushes, setup};

use crate::mujoco_methods::{self, POSITION_ACTUATORS, SWITCH};

/// Default step of the plant.
const STEP: SimDuration = SimDuration::from_millis(1);

/// Default value of the option `integrator`: the integrator that suits the coordinates best.
const DEFAULT_INTEGRATOR: &str = "own";

pub(crate) fn kind() -> PlantKind {
    let integrators: Vec<&str> = [DEFAULT_INTEGRATOR]
        .into_iter()
        .chain(Integrator::ALL.map(Integrator::name))
        .collect();
    let kind = PlantKind::new("mujoco", MUJOCO, mujoco)
        .with_option(choice(
            "coordinates",
            "maximal (segments connected by pin constraints) or minimal (joint angles)",
            &Coordinates::ALL.map(Coordinates::name),
        ))
        .with_option(choice(
            "integrator",
            "time integration method; `own` is the most accurate one measured for the coordinates",
            &integrators,
        ))
        .with_option(choice(
            "solver",
            "solver of the constraint forces",
            &Solver::ALL.map(Solver::name),
        ))
        .with_option(choice(
            "cone",
            "shape of the friction cone",
            &Cone::ALL.map(Cone::name),
        ));
    mujoco_methods::with_methods(with_numbers(kind))
        .with_step(STEP)
        .with_pushes()
}

fn with_numbers(kind: PlantKind) -> PlantKind {
    let defaults = Numerics::of(Coordinates::Maximal);
    let setting = |name: &str, about: &str, range: Range, default: f64| OptionSpec {
        default: Some(OptionValue::Number(default)),
        ..option(name, about, number(range))
    };
    let share = Range::between(1e-4, 0.9999);
    kind.with_option(setting(
        "iterations",
        "maximum number of solver iterations per step",
        Range::between(1.0, 1e6),
        f64::from(defaults.iterations),
    ))
    .with_option(setting(
        "solver_tolerance",
        "improvement at which the solver stops, in MuJoCo's scaling",
        Range::POSITIVE,
        defaults.tolerance,
    ))
    .with_option(option(
        "solref_steps",
        "time constant of constraint errors in steps, MuJoCo's solref; default 2 without solref_time",
        number(Range::POSITIVE),
    ))
    .with_option(option(
        "solref_time",
        "time constant of constraint errors, independent of the step",
        Accepts::Quantity {
            unit: Unit::Second,
            range: Range::POSITIVE,
        },
    ))
    .with_option(setting(
        "solref_damping",
        "damping ratio of constraint errors, MuJoCo's solref",
        Range::POSITIVE,
        defaults.damping,
    ))
    .with_option(setting(
        "pin_damping",
        "damping ratio of the pins between segments, in maximal coordinates",
        Range::POSITIVE,
        defaults.pin_damping,
    ))
    .with_option(setting(
        "contact_damping",
        "damping ratio of foot contacts; values above 1 reduce bouncing",
        Range::POSITIVE,
        defaults.contact_damping,
    ))
    .with_option(setting(
        "contact_solimp_min",
        "impedance of foot contacts without penetration",
        share,
        defaults.contact_impedance[0],
    ))
    .with_option(setting(
        "contact_solimp_max",
        "impedance of foot contacts at a penetration of solimp_width",
        share,
        defaults.contact_impedance[1],
    ))
    .with_option(setting(
        "sliding_rounds",
        "corrections per step of the forces of sliding feet, which MuJoCo lifts; 0: none",
        Range::between(0.0, 1e6),
        f64::from(defaults.sliding_rounds),
    ))
    .with_option(setting(
        "solimp_min",
        "impedance of a constraint without violation: MuJoCo's solimp",
        share,
        defaults.impedance[0],
    ))
    .with_option(setting(
        "solimp_max",
        "impedance of a constraint violated by solimp_width",
        share,
        defaults.impedance[1],
    ))
    .with_option(setting(
        "solimp_width",
        "violation at which solimp_max is reached, in metres or radians",
        Range::POSITIVE,
        defaults.width,
    ))
    .with_option(setting(
        "impratio",
        "ratio of the frictional to the normal impedance of a contact",
        Range::POSITIVE,
        defaults.impratio,
    ))
    .with_option(choice(
        "refsafe",
        "whether MuJoCo raises a solref below two steps to two steps",
        &SWITCH,
    ))
}

/// Builds the robot in MuJoCo, for custom plants that wrap it.
///
/// # Errors
/// If the plant does not support the robot, the ground or the settings.
pub fn mujoco(context: &PlantContext<'_>) -> Result<Mujoco, BuildError> {
    let options = mujoco_options(context)?;
    if options.step_only && !context.pushes.is_empty() {
        return Err("the engine's step alone takes no pushes; leave `step_only` out".into());
    }
    let plant = Mujoco::new(context.robot, &options, context.wanted)?;
    Ok(plant.with_pushes(&pushes(context), context.wanted)?)
}

/// Returns the options of the robot in MuJoCo from the options of the scenario.
///
/// # Errors
/// If the ground is invalid or settings are incompatible.
pub(crate) fn mujoco_options(context: &PlantContext<'_>) -> Result<Options, BuildError> {
    let values = &context.plant.options;
    let mut all = Coordinates::ALL.into_iter();
    let coordinates = all.find(|one| Some(one.name()) == values.text("coordinates"));
    let coordinates = coordinates.unwrap_or(Coordinates::Maximal);
    let step_only = values.text(STEP_ONLY).is_some();
    let mut numerics = numerics(values, Numerics::of(coordinates))?;
    if step_only {
        // The fastest for these sizes of model.
        (numerics.sparse, numerics.islands) = (false, false);
    }
    Ok(Options {
        setup: setup(context, STEP)?,
        coordinates,
        numerics,
        step_only,
        position_actuators: values.text(POSITION_ACTUATORS).is_some(),
    })
}

fn numerics(values: &ScenarioOptions, defaults: Numerics) -> Result<Numerics, BuildError> {
    let word = |name: &str| values.text(name).unwrap_or_default();
    let closing = match (values.number("solref_steps"), values.number("solref_time")) {
        (Some(_), Some(_)) => {
            return Err(
                "`solref_steps` and `solref_time` are one setting: give one of them".into(),
            );
        }
        (Some(steps), None) => TimeConstant::Steps(steps),
        (None, Some(seconds)) => TimeConstant::Seconds(seconds),
        (None, None) => defaults.closing,
    };
    let mut integrators = Integrator::ALL.into_iter();
    let mut solvers = Solver::ALL.into_iter();
    let mut cones = Cone::ALL.into_iter();
    let number = |name: &str, default: f64| values.number(name).unwrap_or(default);
    Ok(Numerics {
        integrator: integrators
            .find(|one| one.name() == word("integrator"))
            .unwrap_or(defaults.integrator),
        solver: solvers
            .find(|one| one.name() == word("solver"))
            .unwrap_or(defaults.solver),
        iterations: to_count(number("iterations", f64::from(defaults.iterations))),
        tolerance: number("solver_tolerance", defaults.tolerance),
        cone: cones
            .find(|one| one.name() == word("cone"))
            .unwrap_or(defaults.cone),
        closing,
        damping: number("solref_damping", defaults.damping),
        pin_damping: number("pin_damping", defaults.pin_damping),
        contact_damping: number("contact_damping", defaults.contact_damping),
        contact_impedance: [
            number("contact_solimp_min", defaults.contact_impedance[0]),
            number("contact_solimp_max", defaults.contact_impedance[1]),
        ],
        sliding_rounds: to_count(number("sliding_rounds", f64::from(defaults.sliding_rounds))),
        impedance: [
            number("solimp_min", defaults.impedance[0]),
            number("solimp_max", defaults.impedance[1]),
        ],
        width: number("solimp_width", defaults.width),
        impratio: number("impratio", defaults.impratio),
        sparse: defaults.sparse,
        islands: defaults.islands,
        refsafe: word("refsafe") != SWITCH[1],
    })
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the ranges of the options are within 0 and 1e6"
)]
fn to_count(number: f64) -> u32 {
    libm::round(number) as u32
}
