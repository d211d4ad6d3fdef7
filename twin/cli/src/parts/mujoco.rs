//! The plants that stand on MuJoCo, out of a scenario's words.

use twinrig_document::Range;
use twinrig_kernel::{SimDuration, Unit};
use twinrig_mujoco::{TimeConstant, Cone, Coordinates, Integrator, Mujoco, Numerics, Options, Solver};
use twinrig_scenario::{Accepts, OptionSpec, OptionValue, Options as ControllerContext};

use crate::assembly::registry::Registry;
use crate::error::BuildError;
use crate::parts::method::Method;
use crate::parts::option::{choice, number, option};
use crate::parts::plant_kind::{PlantContext, PlantKind};
use crate::parts::setup::setup;

/// The plant's own step where a scenario gives none.
const STEP: SimDuration = SimDuration::from_millis(1);

/// What a switch says.
const SWITCH: [&str; 2] = ["on", "off"];

/// The integrator where none is given: that of the coordinates.
const OWN: &str = "own";

pub(crate) fn kinds(registry: Registry) -> Registry {
    registry
        .with_plant(kind())
        .with_plant(crate::parts::model_file::kind())
}

fn kind() -> PlantKind {
    let integrators: Vec<&str> = [OWN]
        .into_iter()
        .chain(Integrator::ALL.map(Integrator::name))
        .collect();
    let kind = PlantKind::new("mujoco", crate::parts::engines::MUJOCO, mujoco)
        .with_option(choice(
            "coordinates",
            "segments that pins hold together, or joint angles",
            &Coordinates::ALL.map(Coordinates::name),
        ))
        .with_option(choice(
            "integrator",
            "how time is integrated; `own` is what measured best in the coordinates",
            &integrators,
        ))
        .with_option(choice(
            "solver",
            "what finds the forces of constraints",
            &Solver::ALL.map(Solver::name),
        ))
        .with_option(choice(
            "cone",
            "the shape of the limit of friction",
            &Cone::ALL.map(Cone::name),
        ));
    with_methods(with_numbers(kind)).with_step(STEP)
}

fn with_numbers(kind: PlantKind) -> PlantKind {
    let own = Numerics::of(Coordinates::Maximal);
    let given = |name: &str, about: &str, range: Range, default: f64| OptionSpec {
        default: Some(OptionValue::Number(default)),
        ..option(name, about, number(range))
    };
    let share = Range::between(1e-4, 0.9999);
    kind.with_option(given(
        "iterations",
        "of the solver, in a step, at most",
        Range::between(1.0, 1e6),
        f64::from(own.iterations),
    ))
    .with_option(given(
        "solver_tolerance",
        "improvement at which the solver stops, as MuJoCo scales it",
        Range::POSITIVE,
        own.tolerance,
    ))
    .with_option(option(
        "solref_steps",
        "steps in which a constraint takes its error back: MuJoCo's solref; 2 where neither it nor solref_time is given",
        number(Range::POSITIVE),
    ))
    .with_option(option(
        "solref_time",
        "the same as a time, whatever the step",
        Accepts::Quantity {
            unit: Unit::Second,
            range: Range::POSITIVE,
        },
    ))
    .with_option(given(
        "solref_damping",
        "damping ratio of that",
        Range::POSITIVE,
        own.damping,
    ))
    .with_option(given(
        "pin_damping",
        "damping ratio of the pins between segments, in maximal coordinates",
        Range::POSITIVE,
        own.pin_damping,
    ))
    .with_option(given(
        "contact_damping",
        "damping ratio of feet on the ground: above 1 they bounce less",
        Range::POSITIVE,
        own.contact_damping,
    ))
    .with_option(given(
        "contact_solimp_min",
        "impedance of feet on the ground that have not sunk in",
        share,
        own.contact_impedance[0],
    ))
    .with_option(given(
        "contact_solimp_max",
        "impedance of feet that have sunk in by solimp_width",
        share,
        own.contact_impedance[1],
    ))
    .with_option(given(
        "sliding_rounds",
        "times a step that forces are found again for feet that slide, which MuJoCo lifts: 0 leaves them to it",
        Range::between(0.0, 1e6),
        f64::from(own.sliding_rounds),
    ))
    .with_option(given(
        "solimp_min",
        "impedance of a constraint that is not violated: MuJoCo's solimp",
        share,
        own.impedance[0],
    ))
    .with_option(given(
        "solimp_max",
        "impedance of one that is violated by solimp_width",
        share,
        own.impedance[1],
    ))
    .with_option(given(
        "solimp_width",
        "violation at which solimp_max is reached, in metres or radians",
        Range::POSITIVE,
        own.width,
    ))
    .with_option(given(
        "impratio",
        "how much stiffer friction is than the normal of a contact",
        Range::POSITIVE,
        own.impratio,
    ))
    .with_option(choice(
        "refsafe",
        "whether MuJoCo raises a solref below two steps to two steps",
        &SWITCH,
    ))
}

fn with_methods(kind: PlantKind) -> PlantKind {
    let method = |name, about, coordinates: Coordinates, integrator: Integrator| {
        Method::stepped(name, about)
            .with_option("coordinates", coordinates.name())
            .with_option("integrator", integrator.name())
    };
    let soft = Numerics::of(Coordinates::Maximal).with_soft_constraints();
    let TimeConstant::Seconds(time) = soft.closing else {
        unreachable!("soft constraints have a time")
    };
    let minimal = Coordinates::Minimal;
    let maximal = Coordinates::Maximal;
    kind.with_model_of("lcp")
        .with_method(method(
            "minimal, rk4",
            "joint angles; fourth order where nothing touches",
            minimal,
            Integrator::Rk4,
        ))
        .with_method(method(
            "minimal, implicitfast",
            "joint angles; first order, friction implicit",
            minimal,
            Integrator::ImplicitFast,
        ))
        .with_method(method(
            "minimal, euler",
            "joint angles; first order",
            minimal,
            Integrator::Euler,
        ))
        .with_method(method(
            "minimal, discrete",
            "joint angles; springs implicit, too",
            minimal,
            Integrator::Discrete,
        ))
        .with_method(method(
            "maximal",
            "segments that pins hold together as stiffly as a step can",
            maximal,
            Numerics::of(maximal).integrator,
        ))
        .with_method(
            method(
                "maximal, engine's defaults",
                "the same with constraints as soft as MuJoCo has them where nothing is said",
                maximal,
                Numerics::of(maximal).integrator,
            )
            .with_number("solref_time", time)
            .with_number("pin_damping", soft.pin_damping)
            .with_number("contact_damping", soft.contact_damping)
            .with_number("contact_solimp_min", soft.contact_impedance[0])
            .with_number("contact_solimp_max", soft.contact_impedance[1])
            .with_number("sliding_rounds", f64::from(soft.sliding_rounds))
            .with_number("solimp_min", soft.impedance[0])
            .with_number("solimp_max", soft.impedance[1]),
        )
        .with_method(
            method(
                "maximal, fixed closure",
                "pins of one stiffness whatever the step: theirs, and not the springs', is the limit of the step",
                maximal,
                Numerics::of(maximal).integrator,
            )
            .with_number("solref_time", CLOSURE_S)
            .with_option("refsafe", SWITCH[1]),
        )
}

/// Time constant of pins that do not follow the step \[s\].
const CLOSURE_S: f64 = 1e-3;

/// Builds the robot in MuJoCo: for a plant of one's own that stands around it.
///
/// # Errors
/// A robot, a ground or settings that it refuses.
pub fn mujoco(context: &PlantContext<'_>) -> Result<Mujoco, BuildError> {
    let options = mujoco_options(context)?;
    Ok(Mujoco::new(context.robot, &options, context.wanted)?)
}

/// What a scenario's words ask of the robot in MuJoCo.
///
/// # Errors
/// A ground that cannot be, or settings that do not go together.
pub(crate) fn mujoco_options(context: &PlantContext<'_>) -> Result<Options, BuildError> {
    let given = &context.plant.options;
    let mut all = Coordinates::ALL.into_iter();
    let coordinates = all.find(|one| Some(one.name()) == given.text("coordinates"));
    let coordinates = coordinates.unwrap_or(Coordinates::Maximal);
    Ok(Options {
        setup: setup(context, STEP)?,
        coordinates,
        numerics: numerics(given, Numerics::of(coordinates))?,
    })
}

fn numerics(given: &ControllerContext, own: Numerics) -> Result<Numerics, BuildError> {
    let word = |name: &str| given.text(name).unwrap_or_default();
    let closing = match (given.number("solref_steps"), given.number("solref_time")) {
        (Some(_), Some(_)) => {
            return Err(
                "`solref_steps` and `solref_time` are one setting: give one of them".into(),
            );
        }
        (Some(steps), None) => TimeConstant::Steps(steps),
        (None, Some(seconds)) => TimeConstant::Seconds(seconds),
        (None, None) => own.closing,
    };
    let mut integrators = Integrator::ALL.into_iter();
    let mut solvers = Solver::ALL.into_iter();
    let mut cones = Cone::ALL.into_iter();
    let number = |name: &str, own: f64| given.number(name).unwrap_or(own);
    Ok(Numerics {
        integrator: integrators
            .find(|one| one.name() == word("integrator"))
            .unwrap_or(own.integrator),
        solver: solvers
            .find(|one| one.name() == word("solver"))
            .unwrap_or(own.solver),
        iterations: whole(number("iterations", f64::from(own.iterations))),
        tolerance: number("solver_tolerance", own.tolerance),
        cone: cones
            .find(|one| one.name() == word("cone"))
            .unwrap_or(own.cone),
        closing,
        damping: number("solref_damping", own.damping),
        pin_damping: number("pin_damping", own.pin_damping),
        contact_damping: number("contact_damping", own.contact_damping),
        contact_impedance: [
            number("contact_solimp_min", own.contact_impedance[0]),
            number("contact_solimp_max", own.contact_impedance[1]),
        ],
        sliding_rounds: whole(number("sliding_rounds", f64::from(own.sliding_rounds))),
        impedance: [
            number("solimp_min", own.impedance[0]),
            number("solimp_max", own.impedance[1]),
        ],
        width: number("solimp_width", own.width),
        impratio: number("impratio", own.impratio),
        refsafe: word("refsafe") != SWITCH[1],
    })
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the options' ranges are between none and a million"
)]
fn whole(number: f64) -> u32 {
    libm::round(number) as u32
}
