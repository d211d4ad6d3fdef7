//! Command `twin new`: crates and files to begin with.

mod name;
mod scenario;
#[cfg(test)]
mod tests;

use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::{FAILURE, SUCCESS, Terminal};
use crate::args::{NewArgs, NewKind};
use crate::assembly::registry::Registry;
use crate::error::TwinError;

/// Files of a crate: path in the crate, text.
type Template = &'static [(&'static str, &'static str)];

const CONTROLLER: Template = &[
    (
        "Cargo.toml",
        include_str!("../../templates/controller/Cargo.toml.in"),
    ),
    (
        "README.md",
        include_str!("../../templates/controller/README.md"),
    ),
    (
        "template_name.toml",
        include_str!("../../templates/controller/scenario.toml"),
    ),
    (
        "src/main.rs",
        include_str!("../../templates/controller/src/main.rs"),
    ),
    (".gitignore", include_str!("../../templates/gitignore")),
];

const DRIVER: Template = &[
    (
        "Cargo.toml",
        include_str!("../../templates/driver/Cargo.toml.in"),
    ),
    (
        "README.md",
        include_str!("../../templates/driver/README.md"),
    ),
    (
        "template_name.toml",
        include_str!("../../templates/driver/scenario.toml"),
    ),
    (
        "port.toml",
        include_str!("../../templates/driver/port.toml"),
    ),
    (
        "src/main.rs",
        include_str!("../../templates/driver/src/main.rs"),
    ),
    (
        "src/protocol.rs",
        include_str!("../../templates/driver/src/protocol.rs"),
    ),
    (
        "src/driver.rs",
        include_str!("../../templates/driver/src/driver.rs"),
    ),
    (
        "src/device.rs",
        include_str!("../../templates/driver/src/device.rs"),
    ),
    (
        "src/timing.rs",
        include_str!("../../templates/driver/src/timing.rs"),
    ),
    (".gitignore", include_str!("../../templates/gitignore")),
];

const PLANT: Template = &[
    (
        "Cargo.toml",
        include_str!("../../templates/plant/Cargo.toml.in"),
    ),
    ("README.md", include_str!("../../templates/plant/README.md")),
    (
        "template_name.toml",
        include_str!("../../templates/plant/scenario.toml"),
    ),
    (
        "src/main.rs",
        include_str!("../../templates/plant/src/main.rs"),
    ),
    (
        "src/plant.rs",
        include_str!("../../templates/plant/src/plant.rs"),
    ),
    (".gitignore", include_str!("../../templates/gitignore")),
];

const ROBOT: &str = include_str!("../../templates/robot/robot.toml");

pub(super) fn new(args: &NewArgs, registry: &Registry, terminal: &mut Terminal<'_>) -> u8 {
    match make(args, registry) {
        Ok(said) => {
            terminal.print(&said);
            SUCCESS
        }
        Err(error) => {
            terminal.print_error(&error);
            FAILURE
        }
    }
}

/// Makes it, and returns what was made and the next steps.
fn make(args: &NewArgs, registry: &Registry) -> Result<String, TwinError> {
    if args.robot.is_some() && args.kind != NewKind::Scenario {
        return Err(TwinError::Together {
            why: "--robot is for scenarios".to_owned(),
            help: format!("twin new scenario {} --robot ROBOT", args.name),
        });
    }
    match args.kind {
        NewKind::Controller => make_crate(args, registry, CONTROLLER),
        NewKind::Driver => make_crate(args, registry, DRIVER),
        NewKind::Plant => make_crate(args, registry, PLANT),
        NewKind::Scenario => {
            name::check_file(&args.name)?;
            let text = scenario::text(args)?;
            let path = args.folder.join(format!("{}.toml", args.name));
            write_new(&path, &text)?;
            let path = path.display();
            Ok(format!(
                "written {path}\n\n  twin check {path}\n  twin run {path}"
            ))
        }
        NewKind::Robot => {
            name::check_file(&args.name)?;
            let name = &args.name;
            let path = args.folder.join("robots").join(format!("{name}.toml"));
            write_new(&path, &ROBOT.replace("@NAME@", name))?;
            Ok(format!(
                "written {}\n\n  twin list {name}\n  twin draw {name}\n  twin new scenario try --robot {name}\n  \
                 twin run try.toml",
                path.display()
            ))
        }
    }
}

fn make_crate(
    args: &NewArgs,
    registry: &Registry,
    template: Template,
) -> Result<String, TwinError> {
    name::check_crate(&args.name, registry)?;
    let source = dependency(args.twinrig.as_deref())?;
    let folder = args.folder.join(&args.name);
    // An existing folder is refused as a whole, so that nothing in it is touched.
    fs::create_dir_all(&args.folder).map_err(|source| not_written(&args.folder, source))?;
    fs::create_dir(&folder).map_err(|source| not_written(&folder, source))?;
    for (file, text) in template {
        let file = folder.join(file.replace("template_name", &args.name));
        write_new(&file, &filled(text, &args.name, &source))?;
    }
    Ok(format!(
        "written {folder}: begin with {folder}/README.md\n\n  cd {folder}\n  cargo test\n  \
         cargo run --release -- run {}.toml",
        args.name,
        folder = folder.display()
    ))
}

/// Returns a file of a template with the name of the crate and the place of `twinrig`.
fn filled(text: &str, name: &str, source: &str) -> String {
    text.replace("template_name", name)
        .replace("@TWINRIG@", source)
}

/// Returns where the crate finds `twinrig`, as the inside of a table of Cargo.toml.
fn dependency(clone: Option<&Path>) -> Result<String, TwinError> {
    let path = match clone {
        Some(clone) => {
            let path = clone.join("twin/cli");
            let manifest = path.join("Cargo.toml");
            fs::canonicalize(&manifest).map_err(|_| TwinError::Together {
                why: format!("{} is not a clone of Twinrig", clone.display()),
                help: format!("there is no {}", manifest.display()),
            })?;
            fs::canonicalize(&path).map_err(|source| not_written(&path, source))?
        }
        None => PathBuf::from(env!("CARGO_MANIFEST_DIR")),
    };
    if !path.join("Cargo.toml").is_file() {
        return Ok(format!("version = \"{}\"", env!("CARGO_PKG_VERSION")));
    }
    Ok(format!(
        "path = {}",
        toml_edit::Value::from(path.display().to_string())
    ))
}

/// Writes a file that must not exist.
fn write_new(path: &Path, text: &str) -> Result<(), TwinError> {
    let written = || -> io::Result<()> {
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        let mut file = OpenOptions::new().write(true).create_new(true).open(path)?;
        file.write_all(text.as_bytes())
    };
    written().map_err(|source| not_written(path, source))
}

fn not_written(path: &Path, source: io::Error) -> TwinError {
    if source.kind() == io::ErrorKind::AlreadyExists {
        return TwinError::Together {
            why: format!("{} exists", path.display()),
            help: "nothing is overwritten: choose another name, or another folder with --in".into(),
        };
    }
    let path = path.to_owned();
    TwinError::Write { path, source }
}
