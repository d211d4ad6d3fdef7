//! A plant, in a program with all commands of `twin`: the physics (plant.rs), and the plant kind
//! that makes it known to scenarios.

mod plant;

use std::process::ExitCode;

use twinrig::document::Range;
use twinrig::plant::{
    Accepts, BuildError, DocumentError, LegFact, Method, ModelContext, OptionSpec, OptionValue,
    Options, Plant, PlantKind, PlantSpec, Port, SimDuration, StandaloneModel, Unit,
};
use twinrig::{Registry, run};

use plant::{Integrator, Parameters, SpringTrunk};

/// Name of the plant in scenarios.
const NAME: &str = "template_name";
const STEP: SimDuration = SimDuration::from_millis(1);
const SEMI_IMPLICIT: &str = "semi-implicit";

fn main() -> ExitCode {
    run(registry())
}

/// All parts of `twin`, and this plant.
fn registry() -> Registry {
    let kind = PlantKind::standalone(NAME, "a trunk on a spring and a damper", load);
    let rk4 = Method::stepped("rk4", "of fourth order").with_option("integrator", "rk4");
    let euler = Method::stepped(SEMI_IMPLICIT, "of first order, keeps the energy of springs");
    let kind = kind
        .with_step(STEP)
        // Against the first reference method `twin study` measures all others.
        .with_method(rk4.trusted_at_step(SimDuration::from_micros(10)))
        .with_method(euler.with_option("integrator", SEMI_IMPLICIT));
    twinrig::registry().with_plant(options().into_iter().fold(kind, PlantKind::with_option))
}

/// Keys of the scenario's `[plant]` table: name, unit, range, default.
fn options() -> Vec<OptionSpec> {
    let quantity = |name: &str, about: &str, (unit, range), default| OptionSpec {
        name: name.to_owned(),
        about: about.to_owned(),
        accepts: Accepts::Quantity { unit, range },
        default: Some(OptionValue::Number(default)),
    };
    let mass = (Unit::Kilogram, Range::POSITIVE);
    let stiffness = (Unit::NewtonPerMeter, Range::POSITIVE);
    let damping = (Unit::NewtonSecondPerMeter, Range::NOT_NEGATIVE);
    let start = (Unit::Meter, Range::between(-0.1, 0.1));
    let integrators = vec!["rk4".to_owned(), SEMI_IMPLICIT.to_owned()];
    vec![
        quantity("mass", "mass of the trunk", mass, 1.0),
        quantity("stiffness", "of the spring", stiffness, 400.0),
        quantity("damping", "of the damper", damping, 2.0),
        quantity("start", "height above that at rest", start, 0.02),
        OptionSpec {
            name: "integrator".to_owned(),
            about: "integration method".to_owned(),
            accepts: Accepts::Choice(integrators),
            default: Some(OptionValue::Text("rk4".to_owned())),
        },
    ]
}

/// The model of a scenario.
struct Model(Parameters);

/// Returns the model; an error would name the place of the wrong key in the scenario.
#[expect(clippy::unnecessary_wraps, reason = "models of other kinds may fail")]
fn load(context: &ModelContext<'_>) -> Result<Model, DocumentError> {
    Ok(Model(parameters(&context.plant.options)))
}

fn parameters(options: &Options) -> Parameters {
    // All have a default.
    let number = |name| options.number(name).unwrap_or_default();
    Parameters {
        mass: number("mass"),
        stiffness: number("stiffness"),
        damping: number("damping"),
        start: number("start"),
    }
}

impl StandaloneModel for Model {
    fn name(&self) -> &str {
        NAME
    }

    /// It has no legs.
    fn legs(&self) -> Option<Vec<LegFact>> {
        Some(Vec::new())
    }

    fn weight(&self) -> Option<f64> {
        Some(self.0.weight())
    }

    fn ports(&self) -> Vec<Port> {
        SpringTrunk::ports_of()
    }

    fn step(&self) -> Option<SimDuration> {
        Some(STEP)
    }

    /// It reads no files, which a recording would have to keep.
    fn files(&self) -> Vec<(String, Vec<u8>)> {
        Vec::new()
    }

    /// A plant may leave out outputs for which `wanted` does not hold; this one has few.
    fn build(
        &self,
        plant: &PlantSpec,
        _wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Box<dyn Plant>, BuildError> {
        let integrator = match plant.options.text("integrator") {
            Some(SEMI_IMPLICIT) => Integrator::SemiImplicit,
            _ => Integrator::Rk4,
        };
        let step = plant.step.unwrap_or(STEP);
        Ok(Box::new(SpringTrunk::new(self.0, integrator, step)))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use twinrig::{Assembly, Execution, execute};

    use super::*;

    #[test]
    fn scenario_meets_its_expectations_and_repeats() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("{NAME}.toml"));
        let registry = registry();
        let assembly = Assembly::builder(&registry).file(&path);
        let assembly = assembly.unwrap_or_else(|error| panic!("{error}"));
        let run = || {
            let report = execute(&assembly, &Execution::default());
            report.unwrap_or_else(|error| panic!("{error}"))
        };
        let (first, second) = (run(), run());
        for line in &first.expectations {
            assert!(line.holds(), "{:?}", line.outcome);
        }
        assert_eq!(first.fingerprint, second.fingerprint);
    }
}
