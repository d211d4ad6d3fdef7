//! Reading a scenario from its file.

use std::path::Path;

use twinrig_document::{Document, DocumentError, Problem};

use super::elsewhere;
use super::root::{Source, read, root_table};
use crate::catalogue::Catalogue;
use crate::scenario::{Scenario, Setting};

impl Scenario {
    /// Reads the scenario file at `path` and applies `settings`.
    ///
    /// # Errors
    /// The file cannot be read, or its content is invalid: all problems, each with its position.
    pub fn load(
        path: &Path,
        settings: &[Setting],
        catalogue: &Catalogue,
    ) -> Result<Self, DocumentError> {
        let document = Document::read(path)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        scenario(document, folder, settings, catalogue)
    }

    /// Reads the scenario `text`, which messages call `file`; robots are searched from `folder`.
    ///
    /// # Errors
    /// All problems, each with its position.
    pub fn parse(
        file: &str,
        text: &str,
        folder: &Path,
        settings: &[Setting],
        catalogue: &Catalogue,
    ) -> Result<Self, DocumentError> {
        scenario(Document::parse(file, text)?, folder, settings, catalogue)
    }
}

/// Reads a scenario from a document.
fn scenario(
    mut document: Document,
    folder: &Path,
    settings: &[Setting],
    catalogue: &Catalogue,
) -> Result<Scenario, DocumentError> {
    if let Some(problem) = other_file(&document) {
        return Err(problem.into());
    }
    let file = document.file().to_owned();
    let text = document.text().to_owned();
    for setting in settings {
        set(&mut document, setting)?;
    }
    let read = document.check_and_warn(|table| {
        let source = Source {
            file,
            text,
            folder,
            settings,
        };
        read(table, source, catalogue)
    });
    let (mut scenario, warnings) =
        read.map_err(|error| elsewhere::with_other_tables(error, catalogue))?;
    scenario.warnings = warnings;
    Ok(scenario)
}

/// Applies a setting. One below `robot` is meant for the robot file.
fn set(document: &mut Document, setting: &Setting) -> Result<(), DocumentError> {
    let Setting { origin, key, value } = setting;
    let set = document.set(origin, key, value);
    let Some(of_robot) = key.strip_prefix("robot.") else {
        return set;
    };
    set.map_err(|mut error| {
        for problem in &mut error.problems {
            problem.message =
                format!("`robot` is the name of a robot file, which has `{of_robot}`");
            problem.help = format!("set `{}.{of_robot}`", root_table::OVERRIDE.name);
        }
        error
    })
}

/// Problem of a file that is no scenario but one of the other kinds of this program.
fn other_file(document: &Document) -> Option<Problem> {
    let has = |key: &str| document.keys().any(|known| known == key);
    if has(root_table::PLANT.name) {
        return None;
    }
    let file = document.file();
    let (what, help) = if has("trunk") && has("mount") {
        let help = "name it in a scenario, as `robot = \"robots/mine.toml\"`";
        ("a robot file", help.to_owned())
    } else if has("dimension") && (has("minimize") || has("maximize")) {
        let help = format!("`twin optimize SCENARIO --space {file}` searches in it");
        ("a search space", help)
    } else if has("dimension") {
        (
            "the specification of a sweep",
            format!("`twin sweep SCENARIO {file}` runs it"),
        )
    } else {
        return None;
    };
    Some(Problem::of_file(
        file,
        format!("this is {what}, not a scenario"),
        help,
    ))
}
