//! The FMU of a scenario, from which plants are built.

use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use thiserror::Error;
use twinrig::fmu_plant::{FILE, ISOLATED, MAY_TERMINATE, NAME, TIME_LIMIT, TOLERANCE};
use twinrig::kernel::signal::ENERGY;
use twinrig::kernel::{Direction, Port, SimDuration};
use twinrig::runtime::{Coupling, Plant};
use twinrig::scenario::{LegFact, PlantSpec};
use twinrig::{Accuracy, BuildError, ModelContext, StandaloneModel};
use twinrig_document::{DocumentError, Placed, Problem, read_file};

use crate::exceptions::Exceptions;
use crate::fmu::description::Description;
use crate::fmu::failure::Failure;
use crate::fmu::link::{Link, LinkSettings, Request};
use crate::fmu::parameters::parameters;
use crate::fmu::plant::{FmuPlant, Start};
use crate::fmu::signals::{Signal, signals};

/// Attachment of a recording: the FMU.
const KEPT: &str = "model.fmu";

/// Greatest size of an FMU \[bytes\].
const ARCHIVE_MOST: u64 = 1 << 30;

/// Limit of a call without `time_limit`.
const TIME_LIMIT_DEFAULT: Duration = Duration::from_secs(10);

/// The FMU of a scenario, with its signals.
pub(super) struct FmuModel {
    name: String,
    archive: Arc<[u8]>,
    description: Description,
    signals: Vec<Signal>,
    parameters: Vec<(String, Vec<f64>)>,
    tolerance: Option<f64>,
    may_terminate: bool,
    settings: LinkSettings,
    exceptions: Exceptions,
    /// The worker that has described the FMU, for the first plant.
    first: Mutex<Option<Link>>,
}

/// Reasons why a plant cannot be built.
#[derive(Debug, Error)]
enum FmuError {
    /// The FMU or its worker fails.
    #[error("the FMU `{fmu}`: {failure}")]
    Failed { fmu: String, failure: Failure },
    /// The FMU accepts steps of one length only.
    #[error(
        "the FMU `{fmu}` accepts communication steps of one length only{}: set `coupling = {{ grid = \"{}\" }}` in [plant], and `period` in [observe] to a multiple",
        .step.map_or(String::new(), |step| format!(", {step}")),
        .step.map_or("STEP".to_owned(), |step| step.to_string())
    )]
    FixedStep {
        fmu: String,
        step: Option<SimDuration>,
    },
}

impl FmuModel {
    /// Reads the FMU that a scenario names, or that a recording keeps.
    pub fn load(
        context: &ModelContext<'_>,
        exceptions: &Exceptions,
    ) -> Result<Self, DocumentError> {
        let (plant, options) = (context.plant, &context.plant.options);
        let Some(file) = options.name(FILE) else {
            let message = format!("`{FILE}` is missing in `plant`");
            let help = format!("add `{FILE} = …`, the FMU");
            return Err(Problem::at(&plant.place, message, help).into());
        };
        let archive: Arc<[u8]> = archive(context, file)?.into();
        let settings = LinkSettings {
            isolated: options.boolean(ISOLATED).unwrap_or(true),
            time_limit: options
                .duration(TIME_LIMIT)
                .map_or(TIME_LIMIT_DEFAULT, |it| Duration::from_nanos(it.as_nanos())),
        };
        let refused = |failure: Failure| {
            let message = format!("{} is not a usable FMU: {failure}", file.value);
            file.error(message, "")
        };
        let mut link = Link::start(settings, &archive, exceptions).map_err(refused)?;
        let described = link.call(Request::Describe, &[]).map_err(refused)?;
        let description: Description = serde_json::from_slice(&described).map_err(|error| {
            refused(Failure::Worker(format!(
                "sent a wrong description: {error}"
            )))
        })?;
        if description.once_per_process && !settings.isolated {
            let message = format!("{} allows one instance in a process only", file.value);
            return Err(file.error(message, format!("leave `{ISOLATED}` out")));
        }
        let mut problems = Vec::new();
        let signals = signals(&description, options, file, &mut problems);
        let parameters = parameters(&description, options, &mut problems);
        if !problems.is_empty() {
            return Err(DocumentError { problems });
        }
        let stem = Path::new(&file.value).file_stem();
        Ok(Self {
            name: stem.map_or_else(String::new, |stem| stem.to_string_lossy().into_owned()),
            archive,
            description,
            signals,
            parameters,
            tolerance: options.number(TOLERANCE),
            may_terminate: options.boolean(MAY_TERMINATE).unwrap_or_default(),
            settings,
            exceptions: exceptions.clone(),
            first: Mutex::new(Some(link)),
        })
    }

    /// Returns the step of an FMU that accepts one only.
    fn own_step(&self) -> Option<SimDuration> {
        self.description
            .step
            .and_then(SimDuration::try_from_secs_f64)
    }

    fn check_coupling(&self, coupling: Coupling) -> Result<(), FmuError> {
        let own = self.own_step();
        let fits = match coupling {
            Coupling::Grid { step, .. } => own.is_none_or(|own| own == step),
            Coupling::Exact => false,
        };
        if fits || !self.description.fixed_step {
            return Ok(());
        }
        Err(FmuError::FixedStep {
            fmu: self.name.clone(),
            step: own,
        })
    }

    /// Returns a worker that has no instance yet.
    fn link(&self) -> Result<Link, Failure> {
        let mut first = self.first.lock().unwrap_or_else(PoisonError::into_inner);
        match first.take() {
            Some(link) => Ok(link),
            None => Link::start(self.settings, &self.archive, &self.exceptions),
        }
    }
}

/// Returns the bytes of the FMU: of the file, or of a recording.
fn archive(context: &ModelContext<'_>, file: &Placed<String>) -> Result<Vec<u8>, DocumentError> {
    if let Some(kept) = context.kept {
        let found = kept.iter().find(|(name, _)| name == KEPT);
        let lacking = || file.error(format!("the recording does not contain `{KEPT}`"), "");
        return found.map(|(_, bytes)| bytes.clone()).ok_or_else(lacking);
    }
    let path = context.folder.join(&file.value);
    let read = read_file(&path, ARCHIVE_MOST);
    read.map_err(|why| {
        let message = format!("cannot read {}: {why}", path.display());
        file.error(message, "paths are relative to the scenario's folder")
    })
}

/// Returns the signals of an energy balance, in its order; none if the FMU lacks one of them.
fn energy(signals: &[Signal]) -> Vec<Signal> {
    let find = |name: &str| {
        let mut signals = signals.iter();
        signals.find(|signal| signal.port.name == name).cloned()
    };
    let balance = ENERGY.iter().map(|term| find(term.name));
    balance.collect::<Option<Vec<_>>>().unwrap_or_default()
}

impl StandaloneModel for FmuModel {
    fn name(&self) -> &str {
        &self.name
    }

    fn legs(&self) -> Option<Vec<LegFact>> {
        None
    }

    fn weight(&self) -> Option<f64> {
        None
    }

    fn ports(&self) -> Vec<Port> {
        self.signals.iter().map(|it| it.port.clone()).collect()
    }

    fn step(&self) -> Option<SimDuration> {
        self.description
            .fixed_step
            .then(|| self.own_step())
            .flatten()
    }

    /// Its solver is unknown, and only some FMUs read a tolerance.
    fn accuracy(&self, _: &PlantSpec) -> Accuracy {
        Accuracy::Unknown
    }

    fn files(&self) -> Vec<(String, Vec<u8>)> {
        vec![(KEPT.to_owned(), self.archive.to_vec())]
    }

    fn build(
        &self,
        plant: &PlantSpec,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Box<dyn Plant>, BuildError> {
        self.check_coupling(plant.coupling)?;
        let is_wanted = |signal: &&Signal| {
            signal.port.direction == Direction::Input || wanted(&signal.port.name)
        };
        let signals: Vec<Signal> = self.signals.iter().filter(is_wanted).cloned().collect();
        let energy = energy(&self.signals);
        let failed = |failure| FmuError::Failed {
            fmu: self.name.clone(),
            failure,
        };
        let start = Start {
            kind: NAME,
            name: &self.name,
            token: &self.description.token,
            missing_state: self.description.missing_state.as_deref(),
            parameters: &self.parameters,
            tolerance: self.tolerance,
            may_terminate: self.may_terminate,
            step: plant.step,
        };
        let link = self.link().map_err(failed)?;
        let plant = FmuPlant::start(link, &signals, &energy, &start);
        Ok(Box::new(plant.map_err(failed)?))
    }
}
