//! The parts that come with the program, a line each.

use twinrig_gait::{Abduction, Cpg, Gait, Stand};
use twinrig_kernel::SimDuration;
use twinrig_scenario::OptionSpec;

use crate::assembly::registry::Registry;
use crate::error::BuildError;
use crate::parts::controller_kind::{ControllerContext, ControllerKind};
use crate::parts::drives;
#[cfg(not(all(feature = "mujoco", feature = "rapier")))]
use crate::parts::engines;
use crate::parts::lcp;
use crate::parts::massless;
use crate::parts::method::Method;
#[cfg(not(feature = "mujoco"))]
use crate::parts::mjcf;
#[cfg(feature = "mujoco")]
use crate::parts::mujoco;
use crate::parts::option::choice;
use crate::parts::optoforce;
use crate::parts::phidget;
use crate::parts::plant_kind::PlantKind;
#[cfg(feature = "rapier")]
use crate::parts::rapier;
use crate::parts::rb110;
use crate::parts::sbcp;
use crate::parts::script;

impl Registry {
    /// The parts that come with this crate.
    pub fn standard() -> Self {
        let own = Registry::empty()
            .with_plant(massless_with_its_method())
            .with_plant(lcp_with_its_methods())
            .with_plant(drives::kind());
        engines(own)
            .with_bus(sbcp::kind())
            .with_bus(rb110::kind())
            .with_bus(optoforce::kind())
            .with_bus(phidget::kind())
            .with_controller(cpg())
            .with_controller(stand())
            .with_controller(script::kind())
    }
}

/// The plants that stand on the engines of others, or which cargo feature this build lacks for them.
fn engines(registry: Registry) -> Registry {
    #[cfg(feature = "mujoco")]
    let registry = mujoco::kinds(registry);
    #[cfg(not(feature = "mujoco"))]
    let registry = registry
        .without_plant("mujoco", engines::MUJOCO, "mujoco")
        .without(mjcf::offer(), "mujoco");
    #[cfg(feature = "rapier")]
    let registry = rapier::kinds(registry);
    #[cfg(not(feature = "rapier"))]
    let registry = registry.without_plant("rapier", engines::RAPIER, "rapier");
    registry
}

fn massless_with_its_method() -> PlantKind {
    let midpoint = Method::stepped("midpoint", "implicit, conserves the energy of its springs")
        .trusted_at_step(SimDuration::from_micros(5));
    massless::kind()
        .with_method(midpoint)
        .without_segment_masses()
}

fn lcp_with_its_methods() -> PlantKind {
    const OPTION: &str = "integrator";
    let stepped = |name, about| Method::stepped(name, about).with_option(OPTION, name);
    // Both ways: in steps as long as they are told to be, whatever the error, and as long as a tolerance lets them be.
    let both = |name, about| {
        let fixed = stepped(name, about).with_number("tolerance", f64::INFINITY);
        let adaptive = Method::tolerant(
            name,
            "the same, in steps as long as a tolerance lets them be",
        );
        (fixed, adaptive.with_option(OPTION, name))
    };
    let (rk4, adaptive_rk4) = both("rk4", "fourth order, finds events");
    let (rodas4, adaptive_rodas4) = both("rodas4", "fourth order, L-stable, finds events");
    lcp::kind()
        .with_method(adaptive_rodas4.trusted_at_tolerance(1e-13))
        .with_method(rodas4)
        .with_method(rk4.trusted_at_step(SimDuration::from_micros(10)))
        .with_method(adaptive_rk4)
        .with_method(
            stepped("moreau", "midpoint rule; constraints hold at the level of velocities, events are not looked for")
                .trusted_at_step(SimDuration::from_micros(5)),
        )
        .with_method(stepped(
            "semi-implicit",
            "symplectic; what closes is held up to a step late and stays as far past it as it came",
        ))
        .with_method(stepped(
            "explicit-euler",
            "for comparison: grows where damping is less than half the step times the square of the frequency",
        ))
        .with_method(stepped(
            "thesis",
            "as published, its signs corrected: one joint's rate is set to zero at a stop, which makes energy at any step",
        ))
}

fn cpg() -> ControllerKind {
    let about = "open-loop gait: coupled oscillators, foot locus, inverse kinematics";
    let gaits = Gait::ALL.map(|gait| gait.name().to_owned());
    ControllerKind::new(Cpg::NAME, about, |given| {
        let cpg = Cpg::new(given.robot, given.legs, gait(given)?)?.with_abduction(abduction(given));
        Ok(match given.options.text("start") {
            Some("random") => cpg.with_random_phases(given.seed),
            _ => cpg,
        })
    })
    .with_variables(|context| Ok(Cpg::variables_of(context.robot, gait(context)?)?))
    .with_option(choice("gait", "which legs step together", &gaits))
    .with_option(choice(
        "start",
        "in step with the gait, or at random phases",
        &START,
    ))
    .with_option(abducting())
}

fn gait(context: &ControllerContext<'_>) -> Result<Gait, BuildError> {
    Ok(context.options.text("gait").unwrap_or_default().parse()?)
}

const START: [&str; 2] = ["in-step", "random"];

fn stand() -> ControllerKind {
    ControllerKind::new(Stand::NAME, "holds the feet below the hips", |given| {
        Ok(Stand::new(given.robot, given.legs)?.with_abduction(abduction(given)))
    })
    .with_variables(|context| Ok(Stand::variables_of(context.robot)?))
    .with_option(abducting())
}

fn abducting() -> OptionSpec {
    let about = "command the servos of hip abduction, too: `splay`";
    choice("abduction", about, &Abduction::ALL.map(Abduction::name))
}

fn abduction(given: &ControllerContext<'_>) -> Abduction {
    let name = given.options.text("abduction");
    let mut all = Abduction::ALL.into_iter();
    all.find(|way| Some(way.name()) == name).unwrap_or_default()
}
