//! Bench of a serial servo, from scenario options.

use twinrig_document::{DocumentError, Problem, Warning};
use twinrig_kernel::{Port, SimDuration};
use twinrig_runtime::Plant;
use twinrig_scenario::{Accepts, LegFact, PlantSpec};
use twinrig_servo::{ServoBench, ServoBenchFile, ServoBenchParameters};

use crate::error::BuildError;
use crate::parts::accuracy::Accuracy;
use crate::parts::context::{ModelContext, StandaloneModel};
use crate::parts::option::option;
use crate::parts::plant_kind::PlantKind;

const NAME: &str = "servo";
const FILE: &str = "file";

/// Attachment of a recording: the file of the bench.
const KEPT: &str = "bench.toml";

pub(crate) fn kind() -> PlantKind {
    let about =
        "bench of a serial servo: firmware, supply, motor, gear with friction, mass on an arm";
    PlantKind::standalone(NAME, about, load)
        .with_overrides()
        .with_option(option(
            FILE,
            "name or path of the file of the bench, found as robots are, in `benches/`",
            Accepts::Name,
        ))
}

/// Bench of a scenario.
struct LoadedBench {
    parameters: ServoBenchParameters,
    text: String,
    warnings: Vec<Warning>,
}

fn load(context: &ModelContext<'_>) -> Result<LoadedBench, DocumentError> {
    let plant = context.plant;
    let Some(file) = plant.options.name(FILE) else {
        let message = format!("`{FILE}` is missing in `plant`");
        let help = format!("add `{FILE} = \"xl330\"`");
        return Err(Problem::at(&plant.place, message, help).into());
    };
    let mut bench = match context.kept {
        Some(kept) => {
            let kept = kept.iter().find(|(name, _)| name == KEPT);
            let lacking = || file.error(format!("the recording does not contain `{KEPT}`"), "");
            let (_, bytes) = kept.ok_or_else(lacking)?;
            ServoBenchFile::parse(KEPT, &String::from_utf8_lossy(bytes))?
        }
        None => ServoBenchFile::find(&file.value, context.folder)?.ok_or_else(|| {
            let help = ServoBenchFile::suggestion(&file.value, context.folder);
            file.error(format!("there is no bench `{}`", file.value), help)
        })?,
    };
    bench.override_with(context.overrides)?;
    Ok(LoadedBench {
        parameters: bench.bench()?,
        text: bench.text().to_owned(),
        warnings: bench.warnings(),
    })
}

impl StandaloneModel for LoadedBench {
    fn name(&self) -> &str {
        &self.parameters.name
    }

    fn legs(&self) -> Option<Vec<LegFact>> {
        Some(Vec::new())
    }

    fn weight(&self) -> Option<f64> {
        Some(0.0)
    }

    fn warnings(&self) -> Vec<Warning> {
        self.warnings.clone()
    }

    fn ports(&self) -> Vec<Port> {
        ServoBench::ports_of()
    }

    fn step(&self) -> Option<SimDuration> {
        SimDuration::try_from_secs_f64(self.parameters.controller.period)
    }

    /// The step of a scenario is a bound of that which follows from the time constant of the motor.
    fn accuracy(&self, plant: &PlantSpec) -> Accuracy {
        match ServoBench::new(&self.parameters, &|_| false) {
            Ok(bench) => Accuracy::Set {
                step: plant
                    .step
                    .map_or(bench.substep(), |it| it.min(bench.substep())),
                tolerance: None,
            },
            Err(_) => Accuracy::Unknown,
        }
    }

    fn files(&self) -> Vec<(String, Vec<u8>)> {
        vec![(KEPT.to_owned(), self.text.clone().into_bytes())]
    }

    fn build(
        &self,
        plant: &PlantSpec,
        requested: &dyn Fn(&str) -> bool,
    ) -> Result<Box<dyn Plant>, BuildError> {
        let bench = ServoBench::new(&self.parameters, requested)?;
        Ok(Box::new(match plant.step {
            Some(step) => bench.with_substep(step)?,
            None => bench,
        }))
    }
}
