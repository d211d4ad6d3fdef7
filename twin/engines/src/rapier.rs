//! Plants on Rapier, built from scenario options.

use twinrig_document::Range;
use twinrig_kernel::{SimDuration, Unit};
use twinrig_rapier::{Joints, Options, Rapier, Softness, Solver};
use twinrig_scenario::{Accepts, OptionSpec, Options as ScenarioOptions};

use twinrig_rig::{BuildError, PlantContext};

use twinrig_rig::parts::engines::RAPIER;
use twinrig_rig::parts::method::{Method, STEP_ONLY};
use twinrig_rig::parts::option::{choice, number, option};
use twinrig_rig::parts::plant_kind::PlantKind;
use twinrig_rig::parts::setup::{pushes, setup};

/// Default step of the plant.
const STEP: SimDuration = SimDuration::from_millis(2);

/// Sources of the solver settings that a scenario does not give.
const SETTINGS: [&str; 2] = ["best", "engine"];

pub(crate) fn kind() -> PlantKind {
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
        .fold(
            PlantKind::new("rapier", RAPIER, rapier),
            PlantKind::with_option,
        )
        .with_option(choice(
            "joints",
            "type of joints between the segments",
            &joints,
        ))
        .with_option(choice(
            "settings",
            "default solver settings: the most accurate ones measured, or those of the engine",
            &SETTINGS,
        ))
        .with_step(STEP)
        .with_pushes()
        .with_model_of("lcp")
        .with_method(by(
            "impulse joints",
            "maximal coordinates, most accurate measured settings",
            Joints::Impulse,
            best,
        ))
        .with_method(by(
            "multibody joints",
            "joint coordinates, most accurate measured settings",
            Joints::Multibody,
            best,
        ))
        .with_method(by(
            "impulse joints, engine's defaults",
            "maximal coordinates, default settings of the engine",
            Joints::Impulse,
            engine,
        ))
        .with_method(loop_of(
            "impulse joints, step only",
            "the engine's step alone: springs, friction and stops are the engine's; a sweep",
            [1, 1],
        ))
        .with_method(loop_of(
            "impulse joints, 4 substeps, step only",
            "the engine's step alone, with its default number of substeps",
            [4, 1],
        ))
        .with_method(loop_of(
            "impulse joints, 20 sweeps, step only",
            "the engine's step alone, with more sweeps",
            [1, 20],
        ))
}

/// Returns the method of the engine's step alone, with these numbers of substeps and of sweeps.
fn loop_of(name: &str, about: &str, [substeps, sweeps]: [u64; 2]) -> Method {
    Method::stepped(name, about)
        .with_option("joints", Joints::Impulse.name())
        .with_count("solver_iterations", substeps)
        .with_count("pgs_iterations", sweeps)
        .with_count("stabilization_iterations", 1)
        .step_only()
}

fn counts() -> Vec<OptionSpec> {
    let count = |name, about| option(name, about, Accepts::Natural(1..=10_000));
    vec![
        count("substeps", "engine steps per plant step"),
        count(
            "solver_iterations",
            "internal substeps of the engine, over which forces are constant",
        ),
        count(
            "pgs_iterations",
            "sweeps over the constraints per internal substep",
        ),
        count(
            "landing_iterations",
            "minimum number of sweeps in the step in which a foot lands and in the next",
        ),
        option(
            "stabilization_iterations",
            "sweeps that remove the velocity of position corrections",
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
            "natural frequency of the error correction of joints and stops",
            hertz.clone(),
        ),
        option(
            "joint_damping_ratio",
            "damping ratio of the error correction of joints and stops",
            number(Range::POSITIVE),
        ),
        option(
            "contact_natural_frequency",
            "natural frequency of the penetration correction of feet",
            hertz,
        ),
        option(
            "contact_damping_ratio",
            "damping ratio of the penetration correction of feet",
            number(Range::POSITIVE),
        ),
    ]
}

/// Builds the robot in Rapier, for custom plants that wrap it.
///
/// # Errors
/// If the plant does not support the robot or the ground.
pub fn rapier(context: &PlantContext<'_>) -> Result<Rapier, BuildError> {
    let values = &context.plant.options;
    let mut all = Joints::ALL.into_iter();
    let joints = all.find(|joints| Some(joints.name()) == values.text("joints"));
    let joints = joints.unwrap_or(Joints::Impulse);
    let options = Options {
        solver: solver(values, joints),
        step_only: values.text(STEP_ONLY).is_some(),
        ..Options::new(setup(context, STEP)?, joints)
    };
    if options.step_only && !context.pushes.is_empty() {
        return Err("the engine's step alone takes no pushes; leave `step_only` out".into());
    }
    let plant = Rapier::new(context.robot, &options, context.wanted)?;
    Ok(plant.with_pushes(&pushes(context), context.wanted)?)
}

fn solver(values: &ScenarioOptions, joints: Joints) -> Solver {
    let of = if values.text("settings") == Some(SETTINGS[1]) {
        Solver::engine_defaults()
    } else {
        Solver::best(joints)
    };
    let count = |name, other| {
        let count = values
            .natural(name)
            .and_then(|count| u32::try_from(count).ok());
        count.unwrap_or(other)
    };
    let soft = |what: &str, of: Softness| Softness {
        natural_frequency: values
            .number(&format!("{what}_natural_frequency"))
            .unwrap_or(of.natural_frequency),
        damping_ratio: values
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
