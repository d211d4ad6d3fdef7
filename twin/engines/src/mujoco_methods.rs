//! Methods of the robot in MuJoCo, for studies.

use twinrig_kernel::SimDuration;
use twinrig_mujoco::{Coordinates, Integrator, Numerics, TimeConstant};

use twinrig_rig::parts::method::Method;
use twinrig_rig::parts::plant_kind::PlantKind;

/// Plant option of methods whose servos are MuJoCo's position actuators; not declared, as
/// [`STEP_ONLY`].
pub(super) const POSITION_ACTUATORS: &str = "position_actuators";

/// Values of a switch.
pub(super) const SWITCH: [&str; 2] = ["on", "off"];

/// Time constant of pins that is independent of the step \[s\].
const CLOSURE_S: f64 = 1e-3;

/// Time constant of soft constraints, two of the longest step as MuJoCo requires \[s\], and their
/// impedance.
const SOFT_S: f64 = 4e-3;
const SOFT_IMPEDANCE: f64 = 0.9;

/// Step of the reference of soft constraints.
const SOFT_REFERENCE: SimDuration = SimDuration::from_micros(10);

/// Adds the methods of the model of `lcp`, and of a model with soft constraints.
pub(super) fn with_methods(kind: PlantKind) -> PlantKind {
    let minimal = |integrator, about| {
        let name = format!("minimal, {}", Integrator::name(integrator));
        method(&name, about, Coordinates::Minimal, integrator)
    };
    let kind = kind
        .with_model_of("lcp")
        .with_method(minimal(
            Integrator::Rk4,
            "joint angles; fourth order without contacts",
        ))
        .with_method(minimal(
            Integrator::ImplicitFast,
            "joint angles; first order, implicit friction",
        ))
        .with_method(minimal(Integrator::Euler, "joint angles; first order"))
        .with_method(minimal(
            Integrator::Discrete,
            "joint angles; springs also implicit",
        ));
    let kind = STEPPED.into_iter().fold(kind, |kind, integrator| {
        kind.with_method(step_only(integrator))
    });
    let kind = with_maximal(kind);
    STEPPED.into_iter().fold(kind, |kind, integrator| {
        kind.with_soft_method(softened(step_only(integrator), integrator))
    })
}

/// Integrators of MuJoCo's step alone.
const STEPPED: [Integrator; 4] = [
    Integrator::Euler,
    Integrator::ImplicitFast,
    Integrator::Discrete,
    Integrator::Rk4,
];

fn method(name: &str, about: &str, coordinates: Coordinates, integrator: Integrator) -> Method {
    Method::stepped(name, about)
        .with_option("coordinates", coordinates.name())
        .with_option("integrator", integrator.name())
}

/// Returns the method of MuJoCo's step alone.
fn step_only(integrator: Integrator) -> Method {
    let name = integrator.name();
    method(
        &format!("minimal, {name}, step only"),
        &format!(
            "as minimal, {name}: MuJoCo's step alone, without energy balance, forces and checks"
        ),
        Coordinates::Minimal,
        integrator,
    )
    .step_only()
}

/// Returns a method with constraints whose stiffness does not depend on the step, and with position
/// actuators: the model that a user of the engine writes.
fn softened(method: Method, integrator: Integrator) -> Method {
    let method = [
        "solimp_min",
        "solimp_max",
        "contact_solimp_min",
        "contact_solimp_max",
    ]
    .into_iter()
    .fold(method, |method, name| {
        method.with_number(name, SOFT_IMPEDANCE)
    })
    .with_number("solref_time", SOFT_S)
    .with_option(POSITION_ACTUATORS, "on");
    if integrator == Integrator::Rk4 {
        method.trusted_at_step(SOFT_REFERENCE)
    } else {
        method
    }
}

/// Adds the methods in maximal coordinates.
fn with_maximal(kind: PlantKind) -> PlantKind {
    let maximal = Coordinates::Maximal;
    let integrator = Numerics::of(maximal).integrator;
    let soft = Numerics::of(maximal).with_soft_constraints();
    let TimeConstant::Seconds(time) = soft.closing else {
        unreachable!("soft constraints have a time")
    };
    kind.with_method(method(
        "maximal",
        "segments connected by pins with the greatest stiffness that the step allows",
        maximal,
        integrator,
    ))
    .with_method(
        method(
            "maximal, engine's defaults",
            "as maximal, with the soft constraints of MuJoCo's defaults",
            maximal,
            integrator,
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
            "pins of a stiffness independent of the step, which limits the step instead of the springs",
            maximal,
            integrator,
        )
        .with_number("solref_time", CLOSURE_S)
        .with_option("refsafe", SWITCH[1]),
    )
}
