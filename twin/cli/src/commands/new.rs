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
use crate::error::TwinError;
use twinrig_rig::build_key::file_of_this_code;
use twinrig_rig::error::Error;
use twinrig_rig::registry::Registry;

/// Version of the crate that new ones depend on.
const VERSION: &str = env!("CARGO_PKG_VERSION");

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
        "oncilla.toml",
        include_str!("../../templates/controller/oncilla.toml"),
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
        "src/bus.rs",
        include_str!("../../templates/driver/src/bus.rs"),
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
        return Err(TwinError::from(Error::InvalidOptions {
            why: "--robot is for scenarios".to_owned(),
            help: format!("twin new scenario {} --robot ROBOT", args.name),
        }));
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
    let source = Dependency::of(args)?;
    let folder = args.folder.join(&args.name);
    // An existing folder is refused as a whole, so that nothing in it is touched.
    fs::create_dir_all(&args.folder).map_err(|source| not_written(&args.folder, source))?;
    fs::create_dir(&folder).map_err(|source| not_written(&folder, source))?;
    for (file, text) in template {
        let file = folder.join(file.replace("template_name", &args.name));
        write_new(&file, &filled(text, &args.name, &source.toml()))?;
    }
    Ok(format!(
        "written {folder}: begin with {folder}/README.md\n\n  cd {folder}\n  cargo test\n  \
         cargo run --release -- run {}.toml{}",
        args.name,
        source.note(),
        folder = folder.display()
    ))
}

/// Returns a file of a template with the name of the crate and the place of `twinrig`.
fn filled(text: &str, name: &str, source: &str) -> String {
    text.replace("template_name", name)
        .replace("@TWINRIG@", source)
}

/// Where a new crate finds `twinrig`.
enum Dependency {
    /// A crate in a clone.
    Clone(PathBuf),
    /// The crate of this version in the registry of cargo.
    Published,
}

impl Dependency {
    /// Returns the given clone. Without it, the one that this program was built from, where the
    /// program or the new crate is in it: elsewhere its path has nothing to do with the user.
    fn of(args: &NewArgs) -> Result<Self, TwinError> {
        if let Some(clone) = &args.twinrig {
            let path = clone.join("twin/cli");
            let manifest = path.join("Cargo.toml");
            fs::canonicalize(&manifest).map_err(|_| {
                TwinError::from(Error::InvalidOptions {
                    why: format!("{} is not a clone of Twinrig", clone.display()),
                    help: format!("there is no {}", manifest.display()),
                })
            })?;
            let path = fs::canonicalize(&path).map_err(|source| not_written(&path, source))?;
            return Ok(Self::Clone(path));
        }
        let folder = fs::canonicalize(&args.folder);
        let folder = folder.or_else(|_| std::path::absolute(&args.folder));
        let places = [file_of_this_code(), folder.ok()];
        Ok(Self::of_places(
            Path::new(env!("CARGO_MANIFEST_DIR")),
            places.into_iter().flatten(),
        ))
    }

    /// Returns the crate at `path` in a clone, if one of the places is in the clone.
    fn of_places(path: &Path, mut places: impl Iterator<Item = PathBuf>) -> Self {
        let root = path.ancestors().nth(2).unwrap_or(path);
        if places.any(|place| place.starts_with(root)) && path.join("Cargo.toml").is_file() {
            Self::Clone(path.to_owned())
        } else {
            Self::Published
        }
    }

    /// Returns it as the inside of a table of Cargo.toml.
    fn toml(&self) -> String {
        match self {
            Self::Clone(path) => {
                let path = toml_edit::Value::from(path.display().to_string());
                format!("path = {path}")
            }
            Self::Published => format!("version = \"{VERSION}\""),
        }
    }

    /// Returns what the user should know about it; may be empty.
    fn note(&self) -> String {
        match self {
            Self::Clone(_) => {
                "\n\nCargo.toml has the path of a clone of Twinrig on this machine; others need \
                 their own"
                    .to_owned()
            }
            Self::Published => format!(
                "\n\ntwinrig {VERSION} is that of crates.io; `--twinrig CLONE` takes it from a clone"
            ),
        }
    }
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
        return TwinError::from(Error::InvalidOptions {
            why: format!("{} exists", path.display()),
            help: "nothing is overwritten: choose another name, or another folder with --in".into(),
        });
    }
    let path = path.to_owned();
    TwinError::from(Error::Write { path, source })
}
