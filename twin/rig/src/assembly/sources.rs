//! Sources of an assembly: a scenario and its robot.

use std::path::{Path, PathBuf};

use twinrig_document::{Document, DocumentError, Item, Overrides, Placed};
use twinrig_robot::{Robot, RobotError, RobotFile};
use twinrig_scenario::{Scenario, Setting};

use crate::assembly::body::{Body, placed};
use crate::error::Error;
use crate::parts::constraints::{CONSTRAINTS, DefaultRules};
use crate::parts::method::TOLERANCE;
use crate::registry::Registry;

/// Name of the scenario file in a recording.
pub const SCENARIO_FILE: &str = "scenario.toml";
/// Name of the robot file in a recording.
pub const ROBOT_FILE: &str = "robot.toml";

/// Substitutes for a robot that cannot be read: their lengths differ.
const ANY_ROBOTS: [&str; 2] = ["cheetah-cub", "oncilla"];

/// Documents of an assembly.
pub struct Sources {
    /// The scenario.
    pub document: Document,
    /// Folder that its paths are relative to.
    pub folder: PathBuf,
    /// Text of the robot file; `None`: the file is searched.
    pub robot: Option<String>,
    /// Files of a standalone plant from a recording; `None`: they are read from disk.
    pub kept: Option<Vec<(String, Vec<u8>)>>,
    /// Rules for values that the scenario leaves open.
    pub rules: DefaultRules,
    /// Options that every plant accepts, and ignores if it has none of that name.
    pub shared_options: &'static [&'static str],
}

/// Keys that are needed before the scenario is read.
#[derive(Default)]
struct Peeked {
    /// Name of the robot.
    robot: Option<Placed<String>>,
    /// Overrides of its values.
    overrides: Overrides,
}

impl Sources {
    /// Returns the sources of a scenario whose paths are relative to `folder`.
    pub fn of(document: Document, folder: &Path) -> Self {
        Self {
            document,
            folder: folder.to_owned(),
            robot: None,
            kept: None,
            rules: DefaultRules::Present,
            shared_options: &[],
        }
    }

    /// Returns the sources for another plant than that of the scenario: one without constraints or
    /// a tolerance ignores those of the scenario.
    #[must_use]
    pub fn on_another_plant(self) -> Self {
        Self {
            shared_options: &[CONSTRAINTS, TOLERANCE],
            ..self
        }
    }

    /// Reads the scenario. The keys of its controllers depend on the robot, which the scenario
    /// names: the robot is read first, and if it is wrong, the scenario is still checked.
    ///
    /// # Errors
    /// Mistakes of both, with their places.
    pub fn read(
        &self,
        registry: &Registry,
        settings: &[Setting],
    ) -> Result<(Scenario, Option<RobotFile>), Error> {
        let Peeked {
            robot: word,
            overrides,
        } = self.peek(settings);
        let parse = |robot: Option<&Robot>| self.parse(registry, settings, robot);
        let Some(word) = word else {
            let [any, _] = substitutes();
            return match parse(any.as_ref()) {
                Ok(scenario) => Ok((scenario, None)),
                Err(error) => Err(problems_with_any_robot(parse).unwrap_or(error).into()),
            };
        };
        match self.robot(&word.value, &overrides) {
            Ok((file, robot)) => Ok((parse(Some(&robot))?, Some(file))),
            Err(error) => {
                let mut error = placed(error, Some(&word), self.document.file());
                let further = problems_with_any_robot(parse).into_iter();
                let further = further.flat_map(|error| error.problems);
                error.problems.extend(further);
                Err(error.into())
            }
        }
    }

    /// Reads the robot `name` with `overrides`.
    fn robot(&self, name: &str, overrides: &Overrides) -> Result<(RobotFile, Robot), RobotError> {
        let mut file = match &self.robot {
            Some(text) => RobotFile::parse(ROBOT_FILE, text),
            // A file that a recording lacks is not searched on disk, where it may have changed.
            None if self.kept.is_some() => Err(RobotError::NotFound {
                name: name.to_owned(),
                help: "the recording does not keep it".to_owned(),
            }),
            None => RobotFile::find(name, &self.folder),
        }?;
        let sound = file.robot().is_ok();
        file.override_with(overrides)?;
        match file.robot() {
            Ok(robot) => Ok((file, robot)),
            Err(error) if sound => Err(with_override_hint(error, file.file(), overrides)),
            Err(error) => Err(error),
        }
    }

    /// Reads the scenario with the keys that `robot` has.
    fn parse(
        &self,
        registry: &Registry,
        settings: &[Setting],
        robot: Option<&Robot>,
    ) -> Result<Scenario, DocumentError> {
        let mut catalogue = registry.catalogue(robot);
        catalogue.share_plant_options(self.shared_options);
        let (file, text) = (self.document.file(), self.document.text());
        Scenario::parse(file, text, &self.folder, settings, &catalogue)
    }

    /// Reads the scenario and the robot and model that it simulates.
    ///
    /// # Errors
    /// As [`Self::read`], and files of the model that cannot be read.
    pub fn body(
        &self,
        registry: &Registry,
        settings: &[Setting],
    ) -> Result<(Scenario, Body), Error> {
        let (scenario, file) = self.read(registry, settings)?;
        let body = Body::of(registry, &scenario, file.as_ref(), self.kept.as_deref())?;
        Ok((scenario, body))
    }

    /// Reads the keys of [`Peeked`], whatever other errors the scenario has.
    fn peek(&self, settings: &[Setting]) -> Peeked {
        let mut document = self.document.clone();
        for setting in settings {
            // A setting that cannot be is reported when the scenario is read.
            let _ = document.set(&setting.origin, &setting.key, &setting.value);
        }
        let mut found = Peeked::default();
        let _ = document.check(|table| {
            if let Some(Ok(word)) = table.get("robot").map(|item| item.placed_text()) {
                found.robot = Some(word);
            }
            if let Some(Ok(overrides)) = table.get("override").as_ref().map(Item::overrides) {
                found.overrides = overrides;
            }
            Ok(())
        });
        found
    }
}

/// Returns the robots of [`ANY_ROBOTS`]; the legs of the second have names that no robot has.
fn substitutes() -> [Option<Robot>; 2] {
    let read = |name| RobotFile::find(name, Path::new("")).ok()?.robot().ok();
    let [one, mut other] = ANY_ROBOTS.map(read);
    for mount in other.iter_mut().flat_map(|robot| &mut robot.legs) {
        mount.name.push('~');
    }
    [one, other]
}

/// Returns the problems that a scenario has with any robot. A problem with one substitute alone, as
/// a height that is out of its reach, may be none with the robot that is meant.
fn problems_with_any_robot(
    parse: impl Fn(Option<&Robot>) -> Result<Scenario, DocumentError>,
) -> Option<DocumentError> {
    let [one, other] = substitutes().map(|robot| parse(robot.as_ref()).err());
    let (mut one, other) = (one?, other?);
    one.problems
        .retain(|problem| other.problems.contains(problem));
    (!one.problems.is_empty()).then_some(one)
}

/// Adds the overridden keys to the help of each problem in `file`, which is valid without
/// `overrides`.
fn with_override_hint(error: RobotError, file: &str, overrides: &Overrides) -> RobotError {
    let RobotError::Document(mut error) = error else {
        return error;
    };
    let keys: Vec<String> = overrides.keys().map(|key| format!("`{key}`")).collect();
    for problem in &mut error.problems {
        if problem.file == file {
            let ends = if problem.help.is_empty() { "" } else { "; " };
            problem.help = format!(
                "{}{ends}the file itself is sound, overridden are {}",
                problem.help,
                keys.join(", ")
            );
        }
    }
    RobotError::Document(error)
}
