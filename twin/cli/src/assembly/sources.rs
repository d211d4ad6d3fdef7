//! Sources of an assembly: a scenario and its robot.

use std::path::{Path, PathBuf};

use twinrig_document::{Document, DocumentError, Item, Overrides, Problem};
use twinrig_robot::{RobotError, RobotFile};
use twinrig_scenario::{Scenario, Setting};

use crate::assembly::body::Body;
use crate::assembly::registry::Registry;
use crate::error::TwinError;
use crate::parts::constraints::DefaultRules;

/// Names of the files in a recording.
pub(crate) const SCENARIO_FILE: &str = "scenario.toml";
pub(crate) const ROBOT_FILE: &str = "robot.toml";

/// Substitute for a robot that cannot be read.
const ANY_ROBOT: &str = "cheetah-cub";

/// Documents of an assembly.
pub(crate) struct Sources {
    pub(crate) document: Document,
    pub(crate) folder: PathBuf,
    /// Text of the robot file; `None`: the file is searched.
    pub(crate) robot: Option<String>,
    /// Files of a standalone plant from a recording; `None`: they are read from disk.
    pub(crate) kept: Option<Vec<(String, Vec<u8>)>>,
    /// Rules for values that the scenario leaves open.
    pub(crate) rules: DefaultRules,
    /// Options that every plant accepts, and ignores if it has none of that name.
    pub(crate) shared_options: &'static [&'static str],
}

/// Keys that are needed before the scenario is read.
#[derive(Default)]
struct Peeked {
    /// Name of the robot.
    robot: Option<String>,
    /// Overrides of its values.
    overrides: Overrides,
}

impl Sources {
    /// Returns the sources of a scenario whose paths are relative to `folder`.
    pub(crate) fn of(document: Document, folder: &Path) -> Self {
        Self {
            document,
            folder: folder.to_owned(),
            robot: None,
            kept: None,
            rules: DefaultRules::Present,
            shared_options: &[],
        }
    }

    /// Reads the scenario. The keys of its controllers depend on the robot, which the scenario
    /// names: the robot is read first, and if it is wrong, the scenario is still checked.
    pub(crate) fn read(
        &self,
        registry: &Registry,
        settings: &[Setting],
    ) -> Result<(Scenario, Option<RobotFile>), TwinError> {
        let Peeked {
            robot: word,
            overrides,
        } = self.peek(settings);
        let find = |word: &str| match &self.robot {
            Some(text) => RobotFile::parse(ROBOT_FILE, text),
            // A file that a recording lacks is not searched on disk, where it may have changed.
            None if self.kept.is_some() => Err(RobotError::NotFound {
                name: word.to_owned(),
                help: "the recording does not keep it".to_owned(),
            }),
            None => RobotFile::find(word, &self.folder),
        };
        let replaced = |mut file: RobotFile| {
            let sound = file.robot().is_ok();
            file.override_with(&overrides)?;
            match file.robot() {
                Ok(robot) => Ok((file, robot)),
                Err(error) if sound => Err(blamed(error, file.file(), &overrides)),
                Err(error) => Err(error),
            }
        };
        let found = word.map(|word| find(&word).and_then(replaced)).transpose();
        let robot = found.as_ref().ok().and_then(Option::as_ref);
        let robot = robot.map(|(_, robot)| robot.clone());
        // Any robot suffices to check the rest of a scenario whose robot cannot be read.
        let robot = robot.or_else(|| RobotFile::find(ANY_ROBOT, Path::new("")).ok()?.robot().ok());
        let mut catalogue = registry.catalogue(robot.as_ref());
        catalogue.share_plant_options(self.shared_options);
        let scenario = Scenario::parse(
            self.document.file(),
            self.document.text(),
            &self.folder,
            settings,
            &catalogue,
        );
        let scenario = scenario?;
        match found {
            Ok(found) => Ok((scenario, found.map(|(file, _)| file))),
            Err(error) => Err(placed(error, &scenario)),
        }
    }

    /// Reads the scenario and the robot and model that it simulates.
    pub(crate) fn body(
        &self,
        registry: &Registry,
        settings: &[Setting],
    ) -> Result<(Scenario, Body), TwinError> {
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
            if let Some(Ok(word)) = table.get("robot").map(|item| item.text()) {
                found.robot = Some(word.to_owned());
            }
            if let Some(Ok(overrides)) = table.get("override").as_ref().map(Item::overrides) {
                found.overrides = overrides;
            }
            Ok(())
        });
        found
    }
}

/// Adds the overridden keys to the help of each problem in `file`, which is valid without
/// `overrides`.
fn blamed(error: RobotError, file: &str, overrides: &Overrides) -> RobotError {
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

/// Places the error at the scenario's `robot` key.
pub(crate) fn placed(error: RobotError, scenario: &Scenario) -> TwinError {
    match error {
        RobotError::Document(error) => error.into(),
        RobotError::NotFound { ref name, ref help } => {
            let message = format!("there is no robot `{name}`");
            match &scenario.robot {
                Some(robot) => robot.error(message, help).into(),
                // None is looked for then.
                None => TwinError::Document(DocumentError {
                    problems: vec![Problem::of_file(&scenario.file, message, help)],
                }),
            }
        }
    }
}
