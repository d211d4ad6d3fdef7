//! Command `twin export`: robots and scenarios for other programs.

use std::path::PathBuf;

use super::{FAILURE, SUCCESS, Terminal, settings};
use crate::args::{ExportArgs, ExportCommand, FmuArgs, MjcfArgs};
use crate::assembly::Assembly;
use crate::assembly::registry::Registry;
use crate::error::{TwinError, guarded};
use crate::fmu::{self, FmiVersion, FmuRequest};

pub(super) fn export(registry: &Registry, args: &ExportArgs, terminal: &mut Terminal<'_>) -> u8 {
    let written = match &args.language {
        ExportCommand::Mjcf(args) => mjcf(args, terminal),
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
    let assembly = Assembly::of_file(registry, path, &settings(&args.settings))?;
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
    std::fs::write(&out, &exported.bytes).map_err(|source| TwinError::Write {
        path: out.clone(),
        source,
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
    let Some(path) = &args.out else {
        terminal.print(&text);
        return Ok(());
    };
    std::fs::write(path, text).map_err(|source| TwinError::Write {
        path: path.clone(),
        source,
    })?;
    terminal.print(&format!("written {}", path.display()));
    Ok(())
}

#[cfg(feature = "mujoco")]
mod with_mujoco {
    use std::path::Path;

    use twinrig_contact::{Ground, Terrain};
    use twinrig_document::{DocumentError, Problem};
    use twinrig_kernel::SimDuration;
    use twinrig_legged::{Base, Drives, SetPoint, Setup, Start};
    use twinrig_mujoco::{Coordinates, Engine, Options, mjcf};
    use twinrig_robot::{Robot, RobotError, RobotFile};

    use crate::args::MjcfArgs;
    use crate::error::BuildError;
    use crate::error::TwinError;

    /// Time step of the model, which determines the stiffness of the pins.
    const STEP: SimDuration = SimDuration::from_millis(1);

    /// Returns the model, verified by a compilation in MuJoCo.
    pub(super) fn written(args: &MjcfArgs) -> Result<String, TwinError> {
        let robot = RobotFile::find(&args.robot, Path::new("")).and_then(|file| file.robot());
        let robot = robot.map_err(not_found)?;
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

    fn not_found(error: RobotError) -> TwinError {
        match error {
            RobotError::Document(error) => error.into(),
            RobotError::NotFound { name, help } => {
                let message = format!("there is no robot `{name}`");
                let problems = vec![Problem::of_file(name, message, help)];
                DocumentError { problems }.into()
            }
        }
    }
}
