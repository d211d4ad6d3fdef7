//! Facts that follow from a robot file: masses, lengths and stiffness of the legs, ranges of the
//! joints, limits of the drives. Every number is computed from the file by the crates that the
//! plants use, and names the keys of the file that it follows from.

mod assumed;
mod body;
mod drives;
mod fact;
mod leg;
mod text;

use serde::Serialize;
use twinrig_robot::leg::LegError;
use twinrig_robot::{Robot, RobotFile};

use assumed::{Assumed, MARKS};
use fact::Fact;
pub(crate) use fact::shown;
pub(crate) use leg::{LegKind, leg_kinds};

/// Facts of a robot.
#[derive(Debug, Serialize)]
pub(crate) struct RobotFacts {
    name: String,
    pub(crate) file: String,
    sections: Vec<Section>,
}

/// Facts of one part of a robot.
#[derive(Debug, Serialize)]
struct Section {
    /// Part: `body`, `leg aslp`, `drives`.
    part: String,
    /// Legs that the section is about; empty for all.
    legs: Vec<String>,
    facts: Vec<Fact>,
}

/// Returns the facts of the robot that `file` contains.
///
/// # Errors
/// [`LegError`] for a leg without the poses that the facts are about.
pub(crate) fn robot_facts(file: &RobotFile, robot: &Robot) -> Result<RobotFacts, LegError> {
    let assumed = Assumed::of_text(file.text());
    let kinds = leg_kinds(robot)?;
    let mut sections = vec![Section {
        part: "body".to_owned(),
        legs: Vec::new(),
        facts: body::facts(robot, &kinds)?,
    }];
    for kind in &kinds {
        let mut facts = kind.facts(robot)?;
        facts.extend(drives::foot_facts(robot, kind)?);
        sections.push(Section {
            part: format!("leg {}", kind.name),
            legs: kind.legs.clone(),
            facts,
        });
    }
    sections.push(Section {
        part: "drives".to_owned(),
        legs: Vec::new(),
        facts: drives::facts(robot),
    });
    for section in &mut sections {
        for fact in &mut section.facts {
            fact.mark(&assumed);
        }
    }
    Ok(RobotFacts {
        name: robot.name.clone(),
        file: file.file().to_owned(),
        sections,
    })
}

#[cfg(test)]
mod tests;
