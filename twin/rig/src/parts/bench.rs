//! Test bench of tactile sensors, from scenario options.

use twinrig_bench::{Bench, BenchFile, BenchParameters, BenchSettings, LOAD, STEP};
use twinrig_document::{DocumentError, Placed, Problem, Range};
use twinrig_kernel::{Port, SimDuration, Unit};
use twinrig_runtime::Plant;
use twinrig_scenario::{Accepts, LegFact, OptionSpec, PlantSpec};
use twinrig_sensor::SensedPlant;

use crate::error::BuildError;
use crate::parts::context::{ModelContext, StandaloneModel};
use crate::parts::option::option;
use crate::parts::plant_kind::PlantKind;

const NAME: &str = "bench";
const FILE: &str = "file";
const CAM: &str = "cam";
const PRELOAD: &str = "preload";
const CELL: &str = "cell";

/// Attachment of a recording: the file of the bench.
const KEPT: &str = "bench.toml";

pub(crate) fn kind() -> PlantKind {
    let about = "test bench of tactile sensors: motor, cam, springs, sensor and reference cell";
    let kind = PlantKind::standalone(NAME, about, load).with_step(STEP);
    options().into_iter().fold(kind, PlantKind::with_option)
}

fn options() -> Vec<OptionSpec> {
    let length = |range| Accepts::Quantity {
        unit: Unit::Meter,
        range,
    };
    vec![
        option(
            FILE,
            "name or path of the file of the bench, found as robots are, in `benches/`",
            Accepts::Name,
        ),
        option(
            CAM,
            "greatest lift of the cam (of the file)",
            length(Range::between(0.0, 0.05)),
        ),
        option(
            PRELOAD,
            "compression of the springs at the lowest point of the cam; negative: gap before the sensor (of the file)",
            length(Range::between(-0.05, 0.05)),
        ),
        option(
            CELL,
            "number of the sensor's cell, whose constants are drawn within the `spread` of the file (none: those of the file)",
            Accepts::Natural(0..=u64::from(u32::MAX)),
        ),
    ]
}

/// Bench of a scenario.
struct LoadedBench {
    parameters: BenchParameters,
    text: String,
    seed: u64,
}

fn load(context: &ModelContext<'_>) -> Result<LoadedBench, DocumentError> {
    let plant = context.plant;
    let Some(file) = plant.options.name(FILE) else {
        let message = format!("`{FILE}` is missing in `plant`");
        let help = format!("add `{FILE} = \"tactile\"`");
        return Err(Problem::at(&plant.place, message, help).into());
    };
    let bench = match context.kept {
        Some(kept) => {
            let kept = kept.iter().find(|(name, _)| name == KEPT);
            let lacking = || file.error(format!("the recording does not contain `{KEPT}`"), "");
            let (_, bytes) = kept.ok_or_else(lacking)?;
            BenchFile::parse(KEPT, &String::from_utf8_lossy(bytes))?
        }
        None => BenchFile::find(&file.value, context.folder)?.ok_or_else(|| {
            let help = BenchFile::suggestion(&file.value, context.folder);
            file.error(format!("there is no bench `{}`", file.value), help)
        })?,
    };
    let set = |name: &str| {
        let value = plant.options.number(name)?;
        let place = plant.place.clone();
        Some(Placed { value, place })
    };
    let parameters = bench.bench(&BenchSettings {
        cam: set(CAM),
        preload: set(PRELOAD),
        cell: plant.options.natural(CELL).map(|value| Placed {
            value,
            place: plant.place.clone(),
        }),
    })?;
    Ok(LoadedBench {
        parameters,
        text: bench.text().to_owned(),
        seed: context.seed,
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

    fn ports(&self) -> Vec<Port> {
        [Bench::ports_of(), SensedPlant::ports_at(LOAD)].concat()
    }

    fn step(&self) -> Option<SimDuration> {
        Some(STEP)
    }

    fn files(&self) -> Vec<(String, Vec<u8>)> {
        vec![(KEPT.to_owned(), self.text.clone().into_bytes())]
    }

    fn build(
        &self,
        plant: &PlantSpec,
        requested: &dyn Fn(&str) -> bool,
    ) -> Result<Box<dyn Plant>, BuildError> {
        let step = plant.step.unwrap_or(STEP);
        let sensed = SensedPlant::ports_at(LOAD);
        let sensed = sensed.iter().any(|port| requested(&port.name));
        if !sensed {
            let bench = Bench::new(&self.parameters, step, self.seed, requested)?;
            return Ok(Box::new(bench));
        }
        let with_load = |name: &str| name == LOAD || requested(name);
        let bench = Bench::new(&self.parameters, step, self.seed, &with_load)?;
        let sensors = [(LOAD.to_owned(), self.parameters.sensor)];
        Ok(Box::new(SensedPlant::new(
            Box::new(bench),
            &sensors,
            requested,
        )?))
    }
}
