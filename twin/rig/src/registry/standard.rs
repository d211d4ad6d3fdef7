//! Registration of the standard parts.

use twinrig_kernel::SimDuration;

use super::{Registry, build_remedy};
use crate::parts;
use crate::parts::engines;
use crate::parts::fmu_plant;
use crate::parts::lcp;
use crate::parts::massless;
use crate::parts::method::Method;
use crate::parts::plant_kind::PlantKind;

/// Tolerance of the references with compliant constraints \[m\].
const COMPLIANT_REFERENCE: f64 = 2e-10;

impl Registry {
    /// Returns the registry with the parts that every build has. Plants on third-party engines are
    /// listed as missing, with the cargo feature that builds them; `twinrig::registry` has those of
    /// its build.
    pub fn standard() -> Self {
        let registry = Registry::empty()
            .with_plant(massless_with_its_methods())
            .with_plant(lcp_with_its_methods());
        let registry = parts::plants()
            .into_iter()
            .fold(registry, Registry::with_plant);
        let registry = parts::buses()
            .into_iter()
            .fold(registry, Registry::with_bus);
        let controllers = parts::controllers().into_iter();
        let registry = controllers
            .fold(registry, Registry::with_controller)
            .without_plant(fmu_plant::offer(), fmu_plant::REMEDY);
        let missing = engines::offers().into_iter();
        missing.fold(registry.mark_as_standard(), |registry, (kind, feature)| {
            registry.without_plant(kind, build_remedy(feature))
        })
    }
}

fn massless_with_its_methods() -> PlantKind {
    let midpoint = Method::stepped("midpoint", "implicit, conserves the energy of the springs")
        .with_option("integrator", "midpoint")
        .trusted_at_step(SimDuration::from_micros(5));
    let euler = Method::stepped(
        "explicit-euler",
        "as published: forces from a table, interpolated linearly; unstable without damping",
    )
    .with_option("integrator", "explicit-euler")
    .with_option("force", "linear-lookup")
    .tabulated();
    let compliant = compliant_rk4()
        .with_option("force", "solve")
        .without_option("integrator")
        .without_option("cells");
    massless::kind()
        .with_method(midpoint)
        .with_method(euler)
        .with_compliant_method(compliant)
        .without_segment_masses()
}

/// Returns the method of both plants with compliant constraints.
fn compliant_rk4() -> Method {
    Method::tolerant(
        "rk4",
        "fourth order, explicit; its steps follow every contact",
    )
    .trusted_at_tolerance(COMPLIANT_REFERENCE)
}

fn lcp_with_its_methods() -> PlantKind {
    const OPTION: &str = "integrator";
    let stepped = |name, about| Method::stepped(name, about).with_option(OPTION, name);
    // Fixed steps regardless of the error, and adaptive steps limited by a tolerance.
    let both = |name, about| {
        let fixed = stepped(name, about).with_number("tolerance", f64::INFINITY);
        let adaptive = Method::tolerant(name, "the same with adaptive steps");
        (fixed, adaptive.with_option(OPTION, name))
    };
    let (rk4, adaptive_rk4) = both("rk4", "fourth order, locates events");
    let (rodas4, adaptive_rodas4) = both("rodas4", "fourth order, L-stable, locates events");
    lcp::kind()
        .with_compliant_method(compliant_rk4().with_option(OPTION, "rk4"))
        .with_method(adaptive_rodas4.trusted_at_tolerance(1e-13))
        .with_method(rodas4)
        .with_method(rk4.trusted_at_step(SimDuration::from_micros(10)))
        .with_method(adaptive_rk4)
        .with_method(
            stepped(
                "moreau",
                "midpoint rule; velocity-level constraints, events are not located",
            )
            .trusted_at_step(SimDuration::from_micros(5)),
        )
        .with_method(stepped(
            "semi-implicit",
            "symplectic; constraints become active up to one step late, their violation persists",
        ))
        .with_method(stepped(
            "explicit-euler",
            "for comparison: unstable if damping is less than half the step times the square of the frequency",
        ))
        .with_method(stepped(
            "thesis",
            "as published, with corrected signs: the rate of one joint is set to zero at a stop, which generates energy at any step",
        ))
}
