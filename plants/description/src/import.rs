//! From a description to a robot file.

use std::sync::Arc;

use twinrig_document::{DocumentError, Problem, Source};
use twinrig_robot::{RobotError, RobotFile};

use crate::quadruped::quadruped;
use crate::robot_file::{Imported, robot_file};
use crate::tree::Tree;
use crate::xml::Text;
use crate::{read_mjcf, read_urdf};

/// Language of a description.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Language {
    /// URDF, of ROS.
    Urdf,
    /// MJCF, of MuJoCo.
    Mjcf,
}

/// Makes a robot file of the description `text`, with `file` as its name in messages. The robot is
/// called `name`, or as the description calls it.
///
/// # Errors
/// A text that is not of the language, and a robot that is no quadruped with legs of two or three
/// segments, each with its place; values beyond those of robot files.
pub fn import(
    language: Language,
    file: &str,
    text: &str,
    name: Option<&str>,
) -> Result<Imported, DocumentError> {
    let source = Arc::new(Source::new(file, text.to_owned()));
    let text = Text::new(&source);
    let tree: Tree = match language {
        Language::Urdf => read_urdf::tree(text)?,
        Language::Mjcf => read_mjcf::tree(text)?,
    };
    let place = tree.place.clone();
    let name = name.unwrap_or(&tree.name).to_owned();
    let robot = quadruped(tree)?;
    let made = robot_file(&name, file, &robot).and_then(|imported| {
        RobotFile::parse(file, &imported.text)?.robot()?;
        Ok(imported)
    });
    match made {
        Ok(imported) => Ok(imported),
        Err(RobotError::Document(error)) => {
            let problems = error.problems.iter();
            let problems = problems.map(|problem| {
                let line = problem.place.as_ref().map_or("", |place| place.line_text());
                let entry = line.split('#').next().unwrap_or(line).trim();
                let message = format!("the robot file would be invalid: {}", problem.message);
                let help = format!("{}; the entry would be {entry}", problem.help);
                Problem::at(&place, message, help)
            });
            Err(DocumentError {
                problems: problems.collect(),
            })
        }
        Err(error) => Err(Problem::at(&place, error.to_string(), "").into()),
    }
}
