//! Values of a scenario from which the axes of its disturbances begin.

use std::path::Path;

use twinrig_document::{Document, Item, Range, Table};
use twinrig_kernel::{Direction, Port, SimDuration, Unit};
use twinrig_rig::assembly::Assembly;
use twinrig_rig::registry::Registry;
use twinrig_robot::Robot;
use twinrig_scenario::{Accepts, Catalogue, OptionSpec, Scenario, Setting};

use crate::error::Error;

/// Control period where there is no controller.
const PERIOD: SimDuration = SimDuration::from_millis(10);
/// Table of the buses.
const BUS: &str = "bus";

/// A scenario without disturbances.
pub(super) struct DisturbanceContext<'r> {
    pub(super) assembly: Assembly<'r>,
    pub(super) catalogue: Catalogue,
    /// The scenario with its settings.
    document: Document,
    robot: Option<Document>,
}

/// Value of a key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Found {
    /// The key is not there.
    Missing,
    /// A quantity in its SI unit.
    Quantity(f64, Unit),
    /// A list with so many elements.
    List(usize),
    /// Any other value.
    Other,
}

impl<'r> DisturbanceContext<'r> {
    /// Reads a scenario with all its files.
    pub(super) fn new(
        registry: &'r Registry,
        path: &Path,
        settings: &[Setting],
    ) -> Result<Self, Error> {
        let assembly = Assembly::builder(registry).settings(settings).file(path)?;
        let mut document = Document::read(path)?;
        for setting in settings {
            document.set(&setting.origin, &setting.key, &setting.value)?;
        }
        let robot = assembly.robot_file();
        let robot = robot.map(|(file, text)| Document::parse(file, text));
        Ok(Self {
            catalogue: registry.catalogue(assembly.robot()),
            document,
            robot: robot.transpose()?,
            assembly,
        })
    }

    pub(super) fn scenario(&self) -> &Scenario {
        self.assembly.scenario()
    }

    /// Returns the robot of a plant with legs that stand on ground or hang.
    pub(super) fn legged(&self) -> Result<&Robot, String> {
        let plant = &self.scenario().plant;
        let robot = self.assembly.robot().filter(|_| !plant.is_standalone);
        robot
            .filter(|_| plant.model != "drives")
            .ok_or_else(|| format!("the plant {} has no legs", plant.model))
    }

    /// Returns the period of the controller.
    pub(super) fn period(&self) -> SimDuration {
        let controller = self.scenario().controller.as_ref();
        controller.map_or(PERIOD, |it| it.period)
    }

    /// Returns the inputs of the controller.
    pub(super) fn inputs(&self) -> Vec<&Port> {
        let ports = self.assembly.process_ports().iter();
        ports
            .filter(|it| it.direction == Direction::Input)
            .collect()
    }

    /// Returns the value of a dotted key of the scenario.
    pub(super) fn value(&self, key: &str) -> Found {
        found(&self.document, key)
    }

    /// Returns the value of a dotted key of the robot file, or of the one that replaces it.
    pub(super) fn robot_value(&self, key: &str) -> Found {
        match (self.value(&format!("override.{key}")), &self.robot) {
            (Found::Missing, Some(robot)) => found(robot, key),
            (replaced, _) => replaced,
        }
    }

    /// Returns the names of the keys below a key of the robot file.
    pub(super) fn robot_keys(&self, key: &str) -> Vec<String> {
        let mut names = Vec::new();
        if let Some(robot) = &self.robot {
            at(robot, key, &mut |item| {
                names.extend(item.keys().into_iter().flatten().map(str::to_owned));
            });
        }
        names
    }

    /// Returns the keys of the values of all buses that an option called `name` has, if `fits`
    /// accepts its declaration.
    pub(super) fn bus_keys(&self, name: &str, fits: fn(&Accepts) -> bool) -> Vec<String> {
        let is_list = matches!(self.value(BUS), Found::List(_));
        let mut keys = Vec::new();
        for (index, bus) in self.scenario().buses.iter().enumerate() {
            let table = if is_list {
                format!("{BUS}.{index}")
            } else {
                BUS.to_owned()
            };
            let mut kinds = self.catalogue.buses.iter();
            if let Some(kind) = kinds.find(|kind| kind.name == bus.kind) {
                options(&kind.options, &table, name, fits, &mut keys);
            }
        }
        keys
    }

    /// Returns the names of the members to which a table at `key` gives values; none if it gives
    /// one value to all.
    pub(super) fn members(&self, key: &str) -> Vec<String> {
        let mut names = Vec::new();
        at(&self.document, key, &mut |item| {
            names.extend(item.keys().into_iter().flatten().map(str::to_owned));
        });
        names
    }
}

/// Collects the dotted keys of options, also of groups.
fn options(
    declared: &[OptionSpec],
    table: &str,
    name: &str,
    fits: fn(&Accepts) -> bool,
    keys: &mut Vec<String>,
) {
    for option in declared {
        let key = format!("{table}.{}", option.name);
        match &option.accepts {
            Accepts::Group(inner) => options(inner, &key, name, fits, keys),
            accepts if option.name == name && fits(accepts) => keys.push(key),
            _ => {}
        }
    }
}

fn found(document: &Document, key: &str) -> Found {
    let mut value = Found::Missing;
    at(document, key, &mut |item| value = of_item(item));
    value
}

fn of_item(item: &Item<'_>) -> Found {
    if item.is_list() {
        return Found::List(item.list().map_or(0, |items| items.len()));
    }
    if item.is_table() || item.is_boolean() {
        return Found::Other;
    }
    let quantity = item.any_unit().and_then(|unit| {
        let number = item.quantity(unit, &Range::ANY)?;
        Ok(Found::Quantity(number, unit))
    });
    quantity.unwrap_or(Found::Other)
}

/// Calls `visit` with the value of a dotted key, if it is there.
fn at(document: &Document, key: &str, visit: &mut dyn FnMut(&Item<'_>)) {
    let mut parts = key.split('.');
    let first = parts.next().unwrap_or(key);
    // Problems of the keys that are not read are none of this reader.
    let _ = document.check(|table: &Table<'_>| {
        let mut item = table.get(first);
        for part in parts {
            item = item.and_then(|item| match part.parse::<usize>() {
                Ok(index) if item.is_list() => item.list().ok()?.into_iter().nth(index),
                _ => item.peek(part),
            });
        }
        item.iter().for_each(visit);
        Ok(())
    });
}
