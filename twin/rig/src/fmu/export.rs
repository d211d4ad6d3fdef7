//! From a scenario to the archive of an FMU.

use std::path::PathBuf;

use twinrig_scenario::BusSpec;

use crate::assembly::Assembly;
use crate::fmu::archive::archive;
use crate::fmu::description::Description;
use crate::fmu::error::ExportError;
use crate::fmu::instance::FmuInstance;
use crate::fmu::part::FmuPart;
use crate::fmu::resources::Resources;
use crate::fmu::variables::FmuVariable;
use crate::fmu::{FmiVersion, MODEL_IDENTIFIER, library};
use crate::registry::PartSort;

/// Request for an export.
pub struct FmuRequest {
    /// Part of the scenario.
    pub part: FmuPart,
    /// Version of FMI.
    pub fmi: FmiVersion,
    /// The library; none for the one beside the program.
    pub library: Option<PathBuf>,
}

/// An exported FMU.
pub struct ExportedFmu {
    /// The archive.
    pub bytes: Vec<u8>,
    /// Number of inputs of the model description.
    pub inputs: usize,
    /// Number of its outputs.
    pub outputs: usize,
}

/// Returns the FMU of a part of a scenario. Its instance is built as a master builds it, so that an
/// FMU that cannot be instantiated is not exported.
///
/// # Errors
/// Parts that an FMU cannot have, a missing library, or an instance that cannot be built.
pub fn export(assembly: &Assembly<'_>, request: &FmuRequest) -> Result<ExportedFmu, ExportError> {
    check_parts(assembly)?;
    let library = library::read(request.library.as_deref())?;
    let resources = Resources::of(assembly, request.part);
    let instance = FmuInstance::of(resources.clone())?;
    let variables = instance.variables();
    let scenario = assembly.scenario();
    let part = match request.part {
        FmuPart::Plant => "the plant",
        FmuPart::Rig => "controller, input and output, and plant",
    };
    let description = Description {
        name: &scenario.name,
        about: format!("{part} of a scenario of Twinrig"),
        token: &resources.token(),
        variables,
        duration: scenario.duration,
        period: assembly.period(),
    };
    let document = description.document(request.fmi);
    let listed = |signal: &FmuVariable| match request.fmi {
        FmiVersion::Fmi2 => signal.size,
        FmiVersion::Fmi3 => 1,
    };
    let binary = format!("binaries/{}/{MODEL_IDENTIFIER}.so", platform(request.fmi)?);
    let kept = resources.files();
    let kept = kept
        .iter()
        .map(|(name, bytes)| (format!("resources/{name}"), &bytes[..]));
    let mut files = vec![
        ("modelDescription.xml".to_owned(), document.as_bytes()),
        (binary, &library),
    ];
    files.extend(kept);
    Ok(ExportedFmu {
        bytes: archive(&files)?,
        inputs: variables.inputs().map(listed).sum(),
        outputs: variables.outputs().map(listed).sum::<usize>()
            + usize::from(variables.fingerprint().is_some()),
    })
}

/// Refuses parts that the library of FMUs lacks: it reads the whole scenario, also for the plant
/// alone.
fn check_parts(assembly: &Assembly<'_>) -> Result<(), ExportError> {
    let scenario = assembly.scenario();
    let is_known = |sort, name: &str| assembly.registry.is_in_every_build(sort, name);
    let refused = |sort, name: &str, (why, help)| ExportError::Part {
        sort,
        name: name.to_owned(),
        file: scenario.file.clone(),
        why,
        help,
    };
    let plant = &scenario.plant.model;
    if !is_known(PartSort::Plant, plant) {
        return Err(refused("plant", plant, reason(plant)));
    }
    let controller = scenario.controller.as_ref().map(|spec| &spec.kind);
    if let Some(kind) = controller.filter(|kind| !is_known(PartSort::Controller, kind)) {
        return Err(refused("controller", kind, OF_PROGRAM));
    }
    let unknown = |bus: &&BusSpec| !is_known(PartSort::Bus, &bus.kind);
    match scenario.buses.iter().find(unknown) {
        Some(bus) => Err(refused("bus", &bus.kind, OF_PROGRAM)),
        None => Ok(()),
    }
}

/// Reason and remedy for a custom part.
const OF_PROGRAM: (&str, &str) = (
    "it is a part of this program, and the library of FMUs has the standard parts only",
    "export a scenario with standard parts; `twin list` of a program without your own has them",
);

/// Returns reason and remedy for a plant.
fn reason(plant: &str) -> (&'static str, &'static str) {
    match plant {
        "mujoco" | "mjcf" => (
            "it needs the library of MuJoCo, which the FMU cannot contain",
            "export another plant: `--plant lcp` has the same model of a robot",
        ),
        "rapier" => (
            "the library of FMUs is built without engines of others",
            "export another plant: `--plant lcp` has the same model of a robot",
        ),
        "fmu" => ("it is an FMU itself", "use that FMU in the master directly"),
        _ => (
            "it is a part of this program, and the library of FMUs has the standard parts only",
            "export a standard plant: `--plant MODEL`",
        ),
    }
}

/// Returns the name of this platform in the folder `binaries`.
fn platform(fmi: FmiVersion) -> Result<&'static str, ExportError> {
    match (fmi, std::env::consts::ARCH) {
        (FmiVersion::Fmi2, "x86_64") => Ok("linux64"),
        (FmiVersion::Fmi3, "x86_64") => Ok("x86_64-linux"),
        (FmiVersion::Fmi3, "aarch64") => Ok("aarch64-linux"),
        (FmiVersion::Fmi2, platform) => Err(ExportError::Platform {
            fmi: "2.0",
            platform,
        }),
        (FmiVersion::Fmi3, platform) => Err(ExportError::Platform {
            fmi: "3.0",
            platform,
        }),
    }
}
