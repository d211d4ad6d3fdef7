//! Location and reading of robot files.

use std::path::Path;

use twinrig_document::declaration::TableReference;
use twinrig_document::{
    AssumedValue, Document, DocumentError, Import, Library, Overrides, Place, Warning, suggestion,
};

use crate::error::RobotError;
use crate::parameters::Robot;
use crate::read;

/// Robot files.
const ROBOTS: Library = Library {
    folder: "robots",
    embedded: &[
        ("cheetah-cub", include_str!("../files/cheetah-cub.toml")),
        (
            "cheetah-cub-sts3215",
            include_str!("../files/cheetah-cub-sts3215.toml"),
        ),
        (
            "half-cub-xl330",
            include_str!("../files/half-cub-xl330.toml"),
        ),
        ("oncilla", include_str!("../files/oncilla.toml")),
    ],
};

/// Files of servo benches, whose servos the legs of robots may have.
pub const SERVO_BENCHES: Library = Library {
    folder: "benches",
    embedded: &[
        ("sts3215", include_str!("../files/sts3215.toml")),
        ("sts3250", include_str!("../files/sts3250.toml")),
        ("xl330", include_str!("../files/xl330.toml")),
    ],
};

/// `base = "NAME"`: the robot is that one but for the values of the file.
const BASE: Import<'_> = Import {
    table: None,
    key: "base",
    entries: None,
};

/// `[serial] bench = "NAME"`: the servo is that of the bench.
const SERIAL: Import<'_> = Import {
    table: Some("serial"),
    key: "bench",
    entries: Some(&["supply", "motor", "friction", "gear", "controller"]),
};

/// A robot file: its text, and the values that a scenario overrides.
#[derive(Debug, Clone)]
pub struct RobotFile {
    document: Document,
    assumed: Vec<AssumedValue>,
}

impl RobotFile {
    /// Reads the file of the robot `name`, for a scenario in the folder `beside`, as
    /// [`Library::find`] does in the folder `robots`.
    ///
    /// # Errors
    /// If there is no such robot, or its file cannot be read or is not TOML.
    pub fn find(name: &str, beside: &Path) -> Result<Self, RobotError> {
        let is_path = name.contains(['/', '\\'])
            || Path::new(name).extension().is_some_and(|end| end == "toml");
        let file = beside.join(name);
        if is_path && !file.exists() {
            return Err(RobotError::NotFound {
                name: name.to_owned(),
                help: if name.starts_with('~') {
                    "`~` is not expanded here: write the whole path".to_owned()
                } else {
                    format!("there is no file {}", file.display())
                },
            });
        }
        if let Some(document) = ROBOTS.find(name, beside)? {
            return RobotFile::of(document);
        }
        let known = RobotFile::names(beside);
        Err(RobotError::NotFound {
            name: name.to_owned(),
            help: match suggestion(name, "known are", known.iter().map(String::as_str)) {
                meant if meant.starts_with("did you mean") => meant,
                known => format!(
                    "there is no robots/{name}.toml in the scenario's folder or above; {known}"
                ),
            },
        })
    }

    /// Returns the names and the texts of the robot files that every build contains.
    pub fn embedded() -> &'static [(&'static str, &'static str)] {
        ROBOTS.embedded
    }

    /// Parses `text`, with `file` as its name in messages. Its base and its serial servo may be
    /// those of files that every build contains.
    ///
    /// # Errors
    /// If it is not TOML, there is no such file, or the interval of an assumed value is none.
    pub fn parse(file: &str, text: &str) -> Result<Self, RobotError> {
        RobotFile::of(Document::parse(file, text)?)
    }

    fn of(document: Document) -> Result<Self, RobotError> {
        let document = document.with_imported(&BASE, &ROBOTS)?;
        let mut document = document.with_imported(&SERIAL, &SERVO_BENCHES)?;
        let assumed = document.take_assumed()?;
        Ok(RobotFile { document, assumed })
    }

    /// Returns the assumed values with their intervals, in the order of the text, whatever is
    /// overridden.
    pub fn assumed(&self) -> &[AssumedValue] {
        &self.assumed
    }

    /// Returns the tables of robot files with their keys, beginning with the top level.
    pub fn tables() -> Vec<TableReference> {
        TableReference::of(read::robot_table::TABLE)
    }

    /// Returns the names that [`RobotFile::find`] finds from `beside`, sorted.
    pub fn names(beside: &Path) -> Vec<String> {
        ROBOTS.names(beside)
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

    /// Returns the place of a dotted key, as of `leg.aslp.l1` or `mount.LF.hip`; none if the file
    /// does not have it.
    pub fn place(&self, key: &str) -> Option<Place> {
        self.document.place(key)
    }

    /// Returns a warning for each value outside of the data of an included fit.
    pub fn warnings(&self) -> Vec<Warning> {
        self.document.beyond_fits()
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
