//! The plants that stand on Rapier, out of a scenario's words.

use twinrig_document::Range;
use twinrig_kernel::{SimDuration, Unit};
use twinrig_rapier::{Joints, Options, Rapier, Softness, Solver};
use twinrig_scenario::{Accepts, OptionSpec, Options as ControllerContext};

use crate::assembly::registry::Registry;
use crate::error::BuildError;
use crate::parts::engines::RAPIER;
use crate::parts::method::Method;
use crate::parts::option::{choice, number, option};
use crate::parts::plant_kind::{PlantContext, PlantKind};
use crate::parts::setup::setup;

/// The plant's own step where a scenario gives none.
const STEP: SimDuration = SimDuration::from_millis(2);

/// Where the numbers come from that a scenario does not give.
const SETTINGS: [&str; 2] = ["best", "engine"];

pub(crate) fn kinds(registry: Registry) -> Registry {
    registry.with_plant(kind())
}

fn kind() -> PlantKind {
    let joints = Joints::ALL.map(Joints::name);
    let by = |name, about, joints: Joints, settings| {
        Method::stepped(name, about)
            .with_option("joints", joints.name())
            .with_option("settings", settings)
    };
    let [best, engine] = SETTINGS;
    counts()
        .into_iter()
        .chain(softnesses())
        .fold(PlantKind::new("rapier", RAPIER, rapier), PlantKind::with_option)
        .with_option(choice("joints", "what holds the segments together", &joints))
        .with_option(choice(
            "settings",
            "where the solver's numbers come from that are not given: those that measured best, or the engine's own",
            &SETTINGS,
        ))
        .with_step(STEP)
        .with_model_of("lcp")
        .with_method(by(
            "impulse joints",
            "maximal coordinates, the settings that measured best",
            Joints::Impulse,
            best,
        ))
        .with_method(by(
            "multibody joints",
            "the coordinates of the joints, the settings that measured best",
            Joints::Multibody,
            best,
        ))
        .with_method(by(
            "impulse joints, engine's defaults",
            "maximal coordinates, the settings that the engine comes with",
            Joints::Impulse,
            engine,
        ))
}

fn counts() -> Vec<OptionSpec> {
    let count = |name, about| option(name, about, Accepts::Natural(1..=10_000));
    vec![
        count("substeps", "steps of the engine in one of the plant's"),
        count(
            "solver_iterations",
            "substeps of the engine's own, over which forces are held",
        ),
        count("pgs_iterations", "sweeps over the constraints in each"),
        count(
            "landing_iterations",
            "as many at least in the two steps in which a foot lands",
        ),
        option(
            "stabilization_iterations",
            "sweeps that take back the speed of corrections",
            Accepts::Natural(0..=10_000),
        ),
    ]
}

fn softnesses() -> Vec<OptionSpec> {
    let hertz = Accepts::Quantity {
        unit: Unit::Hertz,
        range: Range::POSITIVE,
    };
    vec![
        option(
            "joint_natural_frequency",
            "how fast joints and stops take back errors",
            hertz.clone(),
        ),
        option("joint_damping_ratio", "the same", number(Range::POSITIVE)),
        option(
            "contact_natural_frequency",
            "how fast the ground pushes feet out",
            hertz,
        ),
        option("contact_damping_ratio", "the same", number(Range::POSITIVE)),
    ]
}

/// Builds the robot in Rapier: for a plant of one's own that stands around it.
///
/// # Errors
/// A robot or a ground that it refuses.
pub fn rapier(context: &PlantContext<'_>) -> Result<Rapier, BuildError> {
    let given = &context.plant.options;
    let mut all = Joints::ALL.into_iter();
    let joints = all.find(|joints| Some(joints.name()) == given.text("joints"));
    let joints = joints.unwrap_or(Joints::Impulse);
    let options = Options {
        solver: solver(given, joints),
        ..Options::new(setup(context, STEP)?, joints)
    };
    Ok(Rapier::new(context.robot, &options, context.wanted)?)
}

fn solver(given: &ControllerContext, joints: Joints) -> Solver {
    let of = if given.text("settings") == Some(SETTINGS[1]) {
        Solver::engine_defaults()
    } else {
        Solver::best(joints)
    };
    let count = |name, other| {
        let count = given
            .natural(name)
            .and_then(|count| u32::try_from(count).ok());
        count.unwrap_or(other)
    };
    let soft = |what: &str, of: Softness| Softness {
        natural_frequency: given
            .number(&format!("{what}_natural_frequency"))
            .unwrap_or(of.natural_frequency),
        damping_ratio: given
            .number(&format!("{what}_damping_ratio"))
            .unwrap_or(of.damping_ratio),
    };
    Solver {
        substeps: count("substeps", of.substeps),
        solver_iterations: count("solver_iterations", of.solver_iterations),
        pgs_iterations: count("pgs_iterations", of.pgs_iterations),
        landing_iterations: count("landing_iterations", of.landing_iterations),
        stabilization_iterations: count("stabilization_iterations", of.stabilization_iterations),
        joint_softness: soft("joint", of.joint_softness),
        contact_softness: soft("contact", of.contact_softness),
    }
}
