//! Command `twin export`: robots, scenarios and recordings for other programs.

mod recorded;

use std::path::{Path, PathBuf};

use twinrig_description::urdf;
use twinrig_robot::RobotFile;

use super::{FAILURE, SUCCESS, Terminal, settings};
use crate::args::{ExportArgs, ExportCommand, FmuArgs, MjcfArgs, UrdfArgs};
use crate::error::TwinError;
use twinrig_rig::assembly::Assembly;
use twinrig_rig::error::{Error, guarded};
use twinrig_rig::fmu::{self, FmiVersion, FmuRequest};
use twinrig_rig::registry::Registry;

pub(super) fn export(registry: &Registry, args: &ExportArgs, terminal: &mut Terminal<'_>) -> u8 {
    let written = match &args.language {
        ExportCommand::Mjcf(args) => mjcf(args, terminal),
        ExportCommand::Urdf(args) => export_urdf(args, terminal),
        ExportCommand::Csv(args) => recorded::csv(args, terminal),
        ExportCommand::Npz(args) => recorded::npz(args, terminal),
        ExportCommand::Fmu(args) => {
            let file = args.scenario.display().to_string();
            guarded(&file, || export_fmu(registry, args, terminal))
        }
    };
    match written {
        Ok(()) => SUCCESS,
        Err(error) => {
            terminal.print_error(&error);
            FAILURE
        }
    }
}

/// Writes the FMU of a scenario.
fn export_fmu(
    registry: &Registry,
    args: &FmuArgs,
    terminal: &mut Terminal<'_>,
) -> Result<(), TwinError> {
    let path = &args.scenario;
    let assembly = Assembly::builder(registry)
        .settings(&settings(&args.settings))
        .file(path)?;
    terminal.warn(&assembly.scenario().warnings);
    let request = FmuRequest {
        part: args.part.parse().unwrap_or_default(),
        fmi: match args.fmi.as_str() {
            "3" => FmiVersion::Fmi3,
            _ => FmiVersion::Fmi2,
        },
        library: args.library.clone(),
    };
    let exported = fmu::export(&assembly, &request)?;
    let out = args.out.clone().unwrap_or_else(|| {
        let name = path.file_stem().unwrap_or(path.as_os_str());
        PathBuf::from(name).with_extension("fmu")
    });
    std::fs::write(&out, &exported.bytes).map_err(|source| {
        TwinError::from(Error::Write {
            path: out.clone(),
            source,
        })
    })?;
    terminal.print(&format!(
        "written {}: FMI {}.0, {} with {} inputs and {} outputs",
        out.display(),
        args.fmi,
        request.part,
        exported.inputs,
        exported.outputs,
    ));
    Ok(())
}

/// Writes a robot as URDF.
fn export_urdf(args: &UrdfArgs, terminal: &mut Terminal<'_>) -> Result<(), TwinError> {
    let robot = RobotFile::find(&args.robot, Path::new(""))?.robot()?;
    let text = urdf(&robot).map_err(|source| TwinError::Leg {
        robot: args.robot.clone(),
        source,
    })?;
    write_model(&text, args.out.as_ref(), terminal)
}

/// Writes a model to a file, or to standard output without one.
fn write_model(
    text: &str,
    out: Option<&PathBuf>,
    terminal: &mut Terminal<'_>,
) -> Result<(), TwinError> {
    let Some(path) = out else {
        terminal.print_plain(text);
        return Ok(());
    };
    std::fs::write(path, text).map_err(|source| {
        TwinError::from(Error::Write {
            path: path.clone(),
            source,
        })
    })?;
    terminal.print(&format!("written {}", path.display()));
    Ok(())
}

#[cfg(not(feature = "mujoco"))]
fn mjcf(_: &MjcfArgs, _: &mut Terminal<'_>) -> Result<(), TwinError> {
    Err(TwinError::MissingFeature {
        what: "write MJCF",
        feature: "mujoco",
    })
}

#[cfg(feature = "mujoco")]
fn mjcf(args: &MjcfArgs, terminal: &mut Terminal<'_>) -> Result<(), TwinError> {
    let text = with_mujoco::written(args)?;
    write_model(&text, args.out.as_ref(), terminal)
}

#[cfg(feature = "mujoco")]
mod with_mujoco {
    use std::path::Path;

    use twinrig_contact::{Ground, Terrain};
    use twinrig_kernel::SimDuration;
    use twinrig_legged::{Abduction, Base, Contacts, Drives, SetPoint, Setup, Start};
    use twinrig_mujoco::{Coordinates, Engine, Options, mjcf};
    use twinrig_robot::{Robot, RobotFile};

    use crate::args::MjcfArgs;
    use crate::error::TwinError;
    use twinrig_rig::error::BuildError;

    /// Time step of the model, which determines the stiffness of the pins.
    const STEP: SimDuration = SimDuration::from_millis(1);

    /// Returns the model, verified by a compilation in MuJoCo.
    pub(super) fn written(args: &MjcfArgs) -> Result<String, TwinError> {
        let robot = RobotFile::find(&args.robot, Path::new(""))?.robot()?;
        let text = model(&robot, &args.coordinates);
        text.map_err(|source| TwinError::Export {
            robot: args.robot.clone(),
            language: "MJCF",
            source,
        })
    }

    fn model(robot: &Robot, coordinates: &str) -> Result<String, BuildError> {
        let mut all = Coordinates::ALL.into_iter();
        let coordinates = all.find(|one| one.name() == coordinates);
        let coordinates = coordinates.ok_or("unknown coordinates")?;
        let servos = &robot.actuators;
        let setup = Setup {
            base: Base::Free,
            legs: robot.legs.iter().map(|leg| leg.name.clone()).collect(),
            ground: Some(Ground::new(Terrain::Flat, robot.friction, 0.0)?),
            step: STEP,
            drives: Drives::Servos {
                hip: servos.hip,
                knee: servos.knee,
            },
            // All legs upright.
            abduction: Abduction::Locked,
            contacts: Contacts::Feet,
            set_point: SetPoint::Held,
            start: Start::Commands(Vec::new()),
        };
        let options = Options::new(setup, coordinates);
        let text = tidy(&mjcf(robot, &options)?);
        Engine::compile(&text)?;
        Ok(text)
    }

    /// Formats XML with one element per line, indented by depth, and without negative zeros.
    fn tidy(text: &str) -> String {
        let (mut tidied, mut depth, mut rest) = (String::new(), 0_usize, text.trim_start());
        while !rest.is_empty() {
            // Attribute values contain no `>`; comments may.
            let end = if rest.starts_with("<!--") { "-->" } else { ">" };
            let length = rest.find(end).map_or(rest.len(), |at| at + end.len());
            let (tag, after) = rest.split_at(length);
            let closes = tag.starts_with("</");
            depth -= usize::from(closes && depth > 0);
            let tag = tag.split('"').enumerate().map(|(n, part)| match n % 2 {
                1 => without_negative_zeros(part),
                _ => part.to_owned(),
            });
            let tag = tag.collect::<Vec<_>>().join("\"");
            tidied.extend([&"  ".repeat(depth), tag.as_str(), "\n"]);
            depth += usize::from(!closes && !tag.ends_with("/>") && !tag.starts_with("<!"));
            rest = after.trim_start();
        }
        tidied
    }

    fn without_negative_zeros(value: &str) -> String {
        let numbers = value.split(' ');
        let numbers = numbers.map(|number| if number == "-0" { "0" } else { number });
        numbers.collect::<Vec<_>>().join(" ")
    }
}
