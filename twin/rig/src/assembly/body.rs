//! Simulated body: a robot file, a standalone model of the plant, or both.

use std::sync::Arc;

use twinrig_document::{DocumentError, Overrides, Placed, Problem, Warning};
use twinrig_kernel::{Port, signal};
use twinrig_robot::{LegMount, PointMass, Robot, RobotError, RobotFile};
use twinrig_scenario::{LegFact, PayloadSpec, Scenario};

use crate::assembly::plausibility;
use crate::assembly::sensors::Sensors;
use crate::error::Error;
use crate::parts::context::{ModelContext, StandaloneModel};
use crate::registry::Registry;

/// Robot and model of a scenario. A robot beside a standalone model serves the controller.
#[derive(Clone)]
pub struct Body {
    robot: Option<FiledRobot>,
    standalone_model: Option<Arc<dyn StandaloneModel>>,
    sensors: Sensors,
}

/// Robot with its file.
#[derive(Clone)]
struct FiledRobot {
    robot: Robot,
    file: String,
    text: String,
    /// Values that contradict each other, or are outside of the data of a fit.
    warnings: Vec<Warning>,
}

impl Body {
    /// Reads the robot of `file` and the standalone model of the plant, where the scenario has
    /// them; `kept` are the files of a recording.
    pub(crate) fn of(
        registry: &Registry,
        scenario: &Scenario,
        file: Option<&RobotFile>,
        kept: Option<&[(String, Vec<u8>)]>,
    ) -> Result<Self, Error> {
        let robot = file
            .map(|file| FiledRobot::of(file, scenario))
            .transpose()?;
        let standalone_model = registry.standalone_model(&ModelContext {
            plant: &scenario.plant,
            folder: &scenario.folder,
            overrides: &scenario.overrides,
            seed: scenario.seed,
            kept,
        });
        let standalone_model = standalone_model.transpose()?.map(Arc::from);
        Ok(Self {
            robot,
            standalone_model,
            sensors: Sensors::of(registry, scenario, kept)?,
        })
    }

    /// Returns the body with further values of its file replaced. No file is read.
    pub(crate) fn overridden(
        &self,
        registry: &Registry,
        scenario: &Scenario,
        overrides: &Overrides,
    ) -> Result<Self, Error> {
        let overrides = &scenario.overrides.and(overrides);
        let files = self.files();
        let standalone_model = registry.standalone_model(&ModelContext {
            plant: &scenario.plant,
            folder: &scenario.folder,
            overrides,
            seed: scenario.seed,
            kept: Some(&files),
        });
        let robot = self.robot.as_ref().map(|filed| {
            let placed = |error| placed(error, scenario.robot.as_ref(), &scenario.file);
            let mut file = RobotFile::parse(&filed.file, &filed.text).map_err(placed)?;
            file.override_with(overrides)?;
            FiledRobot::of(&file, scenario)
        });
        Ok(Self {
            robot: robot.transpose()?,
            standalone_model: standalone_model.transpose()?.map(Arc::from),
            sensors: self.sensors.clone(),
        })
    }

    /// Returns the robot; none of a standalone plant.
    pub fn robot(&self) -> Option<&Robot> {
        self.robot.as_ref().map(|filed| &filed.robot)
    }

    /// Returns the warnings of the files of robot and bench.
    pub(crate) fn warnings(&self) -> Vec<Warning> {
        let of_robot = self.robot.iter().flat_map(|filed| filed.warnings.clone());
        let of_model = self.standalone_model.iter();
        of_robot
            .chain(of_model.flat_map(|it| it.warnings()))
            .collect()
    }

    /// Returns name and text of the robot file.
    pub fn robot_file(&self) -> Option<(&str, &str)> {
        let filed = self.robot.as_ref()?;
        Some((&filed.file, &filed.text))
    }

    /// Returns the standalone model.
    pub fn standalone_model(&self) -> Option<&dyn StandaloneModel> {
        self.standalone_model.as_deref()
    }

    /// Returns the tactile sensors that buses mount.
    pub(crate) fn sensors(&self) -> &Sensors {
        &self.sensors
    }

    /// Returns the files that a recording keeps besides scenario and robot.
    pub fn files(&self) -> Vec<(String, Vec<u8>)> {
        let model = self.standalone_model().map(StandaloneModel::files);
        [model.unwrap_or_default(), self.sensors.files().to_vec()].concat()
    }

    /// Returns the name of the simulated model or robot.
    pub fn name(&self) -> &str {
        let own = self.standalone_model().map(StandaloneModel::name);
        let robot = || Some(self.robot()?.name.as_str());
        own.or_else(robot).unwrap_or_default()
    }

    /// Returns the legs.
    pub(crate) fn legs(&self) -> Vec<LegFact> {
        let fact = |mount: &LegMount| LegFact {
            name: mount.name.clone(),
            fore: mount.hip[0] >= 0.0,
            left: mount.hip[1] >= 0.0,
        };
        let own = self.standalone_model().and_then(StandaloneModel::legs);
        let of_robot = || {
            let robot = self.robot()?;
            Some(robot.legs.iter().map(fact).collect())
        };
        let named = || {
            self.standalone_model()
                .map(|model| named_legs(&model.ports()))
        };
        own.or_else(of_robot).or_else(named).unwrap_or_default()
    }

    /// Returns the weight \[N\].
    pub(crate) fn weight(&self) -> f64 {
        let own = self.standalone_model().and_then(StandaloneModel::weight);
        own.or_else(|| self.robot().map(Robot::weight))
            .unwrap_or_default()
    }
}

/// Returns the legs in the names of signals, in the order of their first occurrence. Fore and left
/// are those with an F and an L in their names, as in `LF`.
fn named_legs(ports: &[Port]) -> Vec<LegFact> {
    let mut legs: Vec<LegFact> = Vec::new();
    for (name, _) in ports
        .iter()
        .filter_map(|port| signal::parse_leg(&port.name))
    {
        if legs.iter().all(|leg| leg.name != name) {
            legs.push(LegFact {
                name: name.to_owned(),
                fore: name.contains('F'),
                left: name.contains('L'),
            });
        }
    }
    legs
}

impl FiledRobot {
    fn of(file: &RobotFile, scenario: &Scenario) -> Result<Self, Error> {
        let robot = file.robot();
        let placed = |error| placed(error, scenario.robot.as_ref(), &scenario.file);
        let mut robot = robot.map_err(placed)?;
        let payloads = scenario.plant.payloads.iter();
        let point = |load: &PayloadSpec| PointMass {
            mass: load.mass,
            at: load.at,
        };
        robot.trunk.payloads = payloads.map(point).collect();
        Ok(Self {
            warnings: plausibility::warnings(file, &robot),
            robot,
            file: file.file().to_owned(),
            text: file.text().to_owned(),
        })
    }
}

/// Places the error at `robot`, the key of the scenario in `file`.
pub(crate) fn placed(
    error: RobotError,
    robot: Option<&Placed<String>>,
    file: &str,
) -> DocumentError {
    match error {
        RobotError::Document(error) => error,
        RobotError::NotFound { name, help } => {
            let message = format!("there is no robot `{name}`");
            match robot {
                Some(robot) => robot.error(message, help),
                // None is looked for then.
                None => Problem::of_file(file, message, help).into(),
            }
        }
    }
}
