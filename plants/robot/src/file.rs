//! Location and reading of robot files.

use std::path::{Path, PathBuf};

use twinrig_document::{Document, DocumentError, Overrides, suggestion};

use crate::error::RobotError;
use crate::parameters::Robot;
use crate::read;

/// Robot files embedded in every build, so that an installed program works in an empty folder.
const EMBEDDED: &[(&str, &str)] = &[
    (
        "cheetah-cub",
        include_str!("../../../robots/cheetah-cub.toml"),
    ),
    ("oncilla", include_str!("../../../robots/oncilla.toml")),
];

const FOLDER: &str = "robots";

/// A robot file: its text, and the values that a scenario overrides.
#[derive(Debug, Clone)]
pub struct RobotFile {
    document: Document,
}

impl RobotFile {
    /// Reads the file of the robot `name`, for a scenario in the folder `beside`. The first of
    /// these that exists:
    ///
    /// 1. if `name` is a path (contains `/` or ends in `.toml`): that file, relative to `beside`,
    ///    and no other;
    /// 2. `robots/NAME.toml` in `beside` or in the nearest of its ancestor folders;
    /// 3. the embedded copy.
    ///
    /// The current directory has no influence, so that a run does not depend on where it is
    /// started; a relative `beside` is made absolute before its ancestors are searched.
    ///
    /// # Errors
    /// If there is no such robot, or its file cannot be read or is not TOML.
    pub fn find(name: &str, beside: &Path) -> Result<Self, RobotError> {
        if is_path(name) {
            let path = beside.join(name);
            let document = Document::read(&path)?;
            return Ok(RobotFile { document });
        }
        for path in candidates(name, beside) {
            if path.is_file() {
                let document = Document::read(&path)?;
                return Ok(RobotFile { document });
            }
        }
        let embedded = EMBEDDED.iter().find(|(known, _)| *known == name);
        if let Some((_, text)) = embedded {
            let document = Document::parse(&format!("{FOLDER}/{name}.toml"), text)?;
            return Ok(RobotFile { document });
        }
        let known = RobotFile::names(beside);
        Err(RobotError::NotFound {
            name: name.to_owned(),
            help: suggestion(name, "robots", known.iter().map(String::as_str)),
        })
    }

    /// Parses `text`, with `file` as its name in messages.
    ///
    /// # Errors
    /// If it is not TOML.
    pub fn parse(file: &str, text: &str) -> Result<Self, RobotError> {
        let document = Document::parse(file, text)?;
        Ok(RobotFile { document })
    }

    /// Returns the names that [`RobotFile::find`] finds from `beside`, sorted.
    pub fn names(beside: &Path) -> Vec<String> {
        let mut names: Vec<String> = EMBEDDED
            .iter()
            .map(|(name, _)| (*name).to_owned())
            .collect();
        for folder in folders(beside) {
            let Ok(entries) = std::fs::read_dir(folder) else {
                continue;
            };
            for path in entries.flatten().map(|entry| entry.path()) {
                let stem = path.file_stem().and_then(|stem| stem.to_str());
                if let (Some(stem), true) = (stem, path.extension().is_some_and(|e| e == "toml")) {
                    names.push(stem.to_owned());
                }
            }
        }
        names.sort();
        names.dedup();
        names
    }

    /// Replaces values, as in a scenario's `[override]` table. They are validated with the others
    /// by [`RobotFile::robot`].
    ///
    /// # Errors
    /// If a key leads through a value that is not a table.
    pub fn override_with(&mut self, overrides: &Overrides) -> Result<(), DocumentError> {
        self.document.override_with(overrides)
    }

    /// Name of the file in messages.
    pub fn file(&self) -> &str {
        self.document.file()
    }

    /// Text of the file, without overrides.
    pub fn text(&self) -> &str {
        self.document.text()
    }

    /// Reads and validates the robot.
    ///
    /// # Errors
    /// Every parameter that is missing, unknown, of a wrong unit or out of range, with its
    /// location.
    pub fn robot(&self) -> Result<Robot, RobotError> {
        Ok(self.document.check(read::robot)?)
    }
}

fn is_path(name: &str) -> bool {
    let path = Path::new(name);
    name.contains(['/', '\\'])
        || path
            .extension()
            .is_some_and(|extension| extension == "toml")
}

fn folders(beside: &Path) -> Vec<PathBuf> {
    let absolute = std::path::absolute(beside).unwrap_or_else(|_| beside.to_owned());
    absolute
        .ancestors()
        .map(|folder| folder.join(FOLDER))
        .collect()
}

fn candidates(name: &str, beside: &Path) -> Vec<PathBuf> {
    let file = format!("{name}.toml");
    folders(beside)
        .into_iter()
        .map(|folder| folder.join(&file))
        .collect()
}
