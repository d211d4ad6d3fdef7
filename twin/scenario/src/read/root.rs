//! Reading the root table.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use twinrig_document::declaration::TableReference;
use twinrig_document::{Item, Overrides, Placed, Reported, Table};
use twinrig_kernel::SimDuration;

use super::checks::{ScenarioChecks, code, print_duration};
use super::{
    actuator, bus, changes, controller, ensemble, expect, fall, fault, footsteps, io, loads, plant,
    push, sensor,
};
use crate::actuator::ActuatorSpec;
use crate::catalogue::{Catalogue, Standalone};
use crate::expect::Expectation;
use crate::language::{Declared, Key, Shape, TableSpec, Type, contextual, table};
use crate::scenario::{
    ControllerSpec, EnsembleSpec, FootstepSpec, ObserveSpec, PlantSpec, RecordSpec, Scenario,
    Setting,
};

table! {
    /// Keys of the root table.
    pub(crate) root_table = TableSpec::new("top level", "run, its parts and its expectations");
    NAME: String = "name", Type::TEXT, "name in verdict and recording", r#"name = "trot""#,
        otherwise("the file's name");
    ROBOT: Placed<String> = "robot", Type::PLACED, "name of a robot or path of its file",
        r#"robot = "cheetah-cub""#, otherwise("none, with a standalone plant only");
    DURATION: SimDuration = "duration", Type::POSITIVE_DURATION,
        "simulated time", r#"duration = "20 s""#,
        required();
    UNTIL: SimDuration = "until", Type::POSITIVE_DURATION,
        "earlier end of the run; what begins or is judged later is left out",
        r#"until = "1 s""#, otherwise("the end of `duration`");
    SEED: u64 = "seed", Type::NATURAL, "seed of all random streams", "seed = 2", default("1");
    ENSEMBLE: EnsembleSpec = "ensemble", ensemble::ENSEMBLE,
        "number of runs from perturbed starts, in whose share the expectations hold",
        "ensemble = 32", otherwise("one run");
    HORIZON: SimDuration = "horizon", Type::POSITIVE_DURATION,
        "time up to which the trajectory is predictable, as `twin study robustness` measures it",
        r#"horizon = "7.5 s""#, otherwise("not known");
    OVERRIDE: Overrides = "override", Type::new(Shape::Settings, |item, _| item.overrides()),
        "replaced values of the robot file, or of the file of a bench, by dotted key",
        r#"override.leg.aslp.parallel.preload = "0 mm""#;
    PLANT: () = "plant", contextual(Shape::Table(plant::plant_table::TABLE)),
        "model of the physics, ground, initial pose", r#"plant = { model = "lcp" }"#, required();
    ACTUATOR: () = "actuator", contextual(Shape::Table(actuator::actuator_table::TABLE)),
        "drives of the robot", r#"actuator = { kind = "ideal" }"#;
    CONTROLLER: () = "controller", contextual(Shape::Table(controller::controller_table::TABLE)),
        "controller and its variables", r#"controller = { kind = "cpg", period = "2 ms" }"#,
        otherwise("none");
    BUS: () = "bus", contextual(Shape::TableOrTables(bus::bus_table::TABLE)),
        "driver, wire and boards", r#"bus = { kind = "sbcp" }"#, otherwise("none");
    IO: () = "io", contextual(Shape::Table(io::io_table::TABLE)), "transfers",
        r#"io = { transfer_time = "300 us" }"#;
    OBSERVE: SimDuration = "observe",
        Type::new(Shape::Table(io::observe_table::TABLE), |item, _| io::observe(item)),
        "observation of the plant", r#"observe = { period = "1 ms" }"#, default("{}");
    FALL: fall::FallTable = "fall",
        Type::new(Shape::Table(fall::fall_table::TABLE), |item, _| fall::fall(item)),
        "thresholds of a fall of the robot",
        r#"fall = { height = 0.2, tilt = "80 deg", end = true }"#, default("{}");
    FOOTSTEPS: FootstepSpec = "footsteps",
        Type::new(Shape::Table(footsteps::footsteps_table::TABLE), |item, _| {
            footsteps::footsteps(item)
        }),
        "thresholds of a footstep", "footsteps = { lift_off = 0.01 }", default("{}");
    RECORD: RecordSpec = "record",
        Type::new(Shape::Table(io::record_table::TABLE), |item, _| io::record(item)), "recording",
        r#"record = { frames = "25 Hz" }"#, default("{}");
    CHANGE: () = "change", contextual(Shape::Tables(changes::change_table::TABLE)),
        "changes of process variables",
        r#"change = [{ at = "6 s", set = "frequency", by = "0.1 Hz" }]"#, needs("controller");
    FAULT: () = "fault", contextual(Shape::Tables(fault::fault_table::TABLE)), "faults of wires",
        r#"fault = [{ at = "1 s", on = "wire/sbcp", kind = "drop" }]"#;
    SENSOR: () = "sensor", contextual(Shape::Tables(sensor::sensor_table::TABLE)),
        "sensors of inputs of the controller",
        r#"sensor = [{ of = "leg/*/foot/load", noise = "0.1 N" }]"#, needs("controller");
    PAYLOAD: () = "payload", contextual(Shape::Tables(loads::payload_table::TABLE)),
        "point masses on the trunk",
        r#"payload = [{ mass = "200 g", at = ["2 cm", "0 cm", "3 cm"] }]"#;
    SURFACE: () = "surface", contextual(Shape::Tables(loads::surface_table::TABLE)),
        "friction of parts of the ground, or for a time",
        r#"surface = [{ friction = 0.2 }], plant = { model = "lcp", ground = {} }"#;
    PUSH: () = "push", contextual(Shape::Tables(push::push_table::TABLE)),
        "pushes on trunk and feet",
        r#"push = [{ on = "body", at = "3 s", for = "0.1 s", force = "20 N", direction = "y" }]"#;
    EXPECT: () = "expect", contextual(Shape::Tables(expect::expect_table::TABLE)), "expectations",
        "expect = [{ body = { fall = false } }]";
}

/// Returns the tables of the scenario language, beginning with the root table.
pub fn language() -> Vec<TableReference> {
    TableReference::of(root_table::TABLE)
}

/// Reads the robot, which only a standalone plant does not require.
fn robot(
    table: Declared<'_, '_>,
    catalogue: &Catalogue,
) -> Result<Option<Placed<String>>, Reported> {
    use root_table::{OVERRIDE, ROBOT};
    let (false, Some(standalone)) = (table.has(&ROBOT), standalone(table, catalogue)) else {
        return table.read(&ROBOT).map(Some);
    };
    table.expect(&ROBOT);
    if table.has(&OVERRIDE) && !standalone.is_overridable {
        let message = "[override] requires a robot";
        return Err(table.report(&OVERRIDE, message, "set `robot`, or leave the table out"));
    }
    Ok(None)
}

/// Returns the properties of a standalone plant, in this build or in another; none of others.
fn standalone(table: Declared<'_, '_>, catalogue: &Catalogue) -> Option<Standalone> {
    let plant = table.item(&root_table::PLANT);
    let model = plant.and_then(|plant| plant.peek(plant::plant_table::MODEL.name));
    let name = model?.text().ok()?;
    let mut kinds = catalogue.plants.iter().filter(|kind| kind.name == name);
    kinds.find_map(|kind| kind.standalone)
}

/// Source of a scenario.
pub(super) struct Source<'s> {
    pub file: String,
    pub text: String,
    pub folder: &'s Path,
    pub settings: &'s [Setting],
}

/// Reads the root table.
pub(super) fn read(
    root: &Table<'_>,
    source: Source<'_>,
    catalogue: &Catalogue,
) -> Result<Scenario, Reported> {
    use root_table::{
        BUS, CHANGE, DURATION, ENSEMBLE, FALL, FAULT, FOOTSTEPS, HORIZON, IO, NAME, OBSERVE,
        OVERRIDE, PAYLOAD, PLANT, PUSH, RECORD, SEED, SENSOR, SURFACE, UNTIL,
    };
    let table = root_table::TABLE.of(root);
    let (name, robot) = (table.get(&NAME), robot(table, catalogue));
    let (overrides, duration) = (table.get(&OVERRIDE), table.read(&DURATION));
    let until = table.get(&UNTIL);
    let run = *duration.as_ref().unwrap_or(&SimDuration::MAX);
    let (seed, observe) = (table.read(&SEED), table.read(&OBSERVE));
    let (ensemble, horizon) = (table.get(&ENSEMBLE), table.get(&HORIZON));
    let observed = observe.unwrap_or(io::OBSERVE_PERIOD);
    let plant = table.read_with(&PLANT, |item| plant::plant(item, catalogue, observed));
    let plant = loads::loads(table, [&PAYLOAD, &SURFACE], plant, run);
    let actuator = actuator(table, catalogue, plant.as_ref().ok(), run);
    let controller = controller(table, catalogue);
    let buses = table.get_with(&BUS, |item| bus::buses(item, &catalogue.buses));
    let (fall, footsteps, record) = (
        table.read(&FALL),
        table.read(&FOOTSTEPS),
        table.read(&RECORD),
    );
    let control = controller.as_ref().map(Option::as_ref);
    let control = control.map_err(|reported| *reported);
    let io = table.get_with(&IO, |item| io::io(item, control.unwrap_or(None)));
    let changes = changes::changes(table, &CHANGE, control, catalogue, run);
    let faults = table.get_with(&FAULT, |item| item.each(|item| fault::fault(item, run)));
    let has_controller = control.map(|control| control.is_some()).ok();
    let sensors = sensor::sensors(table, &SENSOR, has_controller, run);
    let pushed = push::Context {
        run,
        plant: plant.as_ref().ok(),
        catalogue,
    };
    let pushes = table.get_with(&PUSH, |item| push::pushes(item, &pushed));
    let changed = changes.as_deref().unwrap_or_default();
    let plants = catalogue.plants.iter().map(|kind| kind.name.as_str());
    let pushed_by = pushes.as_ref().ok().and_then(Option::as_deref);
    let context = expect::Context {
        plants: plants.collect(),
        duration: run,
        horizon: *horizon.as_ref().unwrap_or(&None),
        first_change: changed.first().map(|change| change.at),
        pushes: pushed_by.unwrap_or_default(),
    };
    let expectations = expectations(table, &context);
    let (controller, io, plant) = (controller?, io?, plant?);
    let applies = |one: &Expectation| one.plants.is_empty() || one.plants.contains(&plant.model);
    let (expectations, of_other_plants): (Vec<_>, _) = expectations?.into_iter().partition(applies);
    let (buses, faults) = (buses?.unwrap_or_default(), faults?.unwrap_or_default());
    fault::check_sites(table, &FAULT, &buses, &faults)?;
    let io = io.unwrap_or_else(|| controller::io_default(controller.as_ref()));
    let footsteps = footsteps?;
    let checks = ScenarioChecks {
        duration: duration?.min(until?.unwrap_or(SimDuration::MAX)),
        observe: observed,
        footsteps: &footsteps,
        plant: &plant,
        controller: controller.as_ref(),
        io: &io,
        expectations: &expectations,
        of_other_plants: of_other_plants.len(),
    };
    checks.check(root)?;
    let mut scenario = Scenario {
        name: name?.unwrap_or_else(|| stem(&source.file)),
        file: source.file,
        text: source.text,
        settings: source.settings.to_vec(),
        folder: source.folder.to_owned(),
        robot: robot?,
        overrides: overrides?.unwrap_or_else(Overrides::default),
        duration: duration?,
        seed: seed?,
        ensemble: ensemble?,
        horizon: horizon?,
        plant,
        actuator: actuator?.unwrap_or_default(),
        controller,
        io,
        buses,
        faults,
        sensors: sensors?,
        pushes: pushes?.unwrap_or_default(),
        observe: ObserveSpec {
            period: observe?,
            footsteps,
        },
        fall: fall::spec(fall?, &expectations),
        record: record?,
        changes: changes?,
        expectations: distinct(expectations),
        of_other_plants,
        beyond_end: Vec::new(),
        warnings: Vec::new(),
    };
    end_early(table, &mut scenario, until?);
    Ok(scenario)
}

/// Ends a run at `until`, with a warning if it is after the end, or no expectation remains.
fn end_early(table: Declared<'_, '_>, scenario: &mut Scenario, until: Option<SimDuration>) {
    let (Some(until), Some(item)) = (until, table.item(&root_table::UNTIL)) else {
        return;
    };
    if until > scenario.duration {
        item.warn(
            code::UNTIL_BEYOND,
            format!(
                "the run ends before, at {}",
                print_duration(scenario.duration)
            ),
            "give a greater `duration`, or leave it out",
        );
    }
    let expected = !scenario.expectations.is_empty();
    scenario.end_early(until);
    if expected && scenario.expectations.is_empty() {
        item.warn(
            code::UNTIL,
            "every expectation is judged later",
            "this run cannot fail: give a later time",
        );
    }
}

/// Returns whether the plant refuses the actuators of a scenario.
fn brings_actuators(plant: &PlantSpec, catalogue: &Catalogue) -> bool {
    let mut kinds = catalogue.plants.iter();
    kinds.any(|kind| kind.name == plant.model && !kind.has_robot_keys())
}

/// Reads `[actuator]`, which a plant that brings its own does not have.
fn actuator(
    table: Declared<'_, '_>,
    catalogue: &Catalogue,
    plant: Option<&PlantSpec>,
    run: SimDuration,
) -> Result<Option<ActuatorSpec>, Reported> {
    use root_table::ACTUATOR;
    match plant {
        Some(plant) if brings_actuators(plant, catalogue) && table.has(&ACTUATOR) => {
            let message = format!("the plant `{}` brings its own actuators", plant.model);
            table.expect(&ACTUATOR);
            Err(table.report(&ACTUATOR, message, "leave the table out"))
        }
        _ => table.get_with(&ACTUATOR, |item| actuator::actuator(item, run)),
    }
}

/// Reads `[controller]`.
fn controller(
    table: Declared<'_, '_>,
    catalogue: &Catalogue,
) -> Result<Option<ControllerSpec>, Reported> {
    let read = |item: &Item<'_>| controller::controller(item, &catalogue.controllers);
    Ok(table.get_with(&root_table::CONTROLLER, read)?.flatten())
}

/// Reads all `[[expect]]`.
fn expectations(
    table: Declared<'_, '_>,
    context: &expect::Context<'_>,
) -> Result<Vec<Expectation>, Reported> {
    let read = |item: &Item<'_>| item.each(|item| expect::expectation(item, context));
    Ok(table
        .get_with(&root_table::EXPECT, read)?
        .unwrap_or_default())
}

fn stem(file: &str) -> String {
    let stem = Path::new(file).file_stem();
    stem.map_or_else(
        || file.to_owned(),
        |stem| stem.to_string_lossy().into_owned(),
    )
}

/// Numbers expectations of the same name.
fn distinct(mut expectations: Vec<Expectation>) -> Vec<Expectation> {
    let mut used = BTreeSet::new();
    // Last number of each name, from which the search for a free one continues.
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for expectation in &mut expectations {
        let name = &expectation.name;
        let mut distinct = name.clone();
        while !used.insert(distinct.clone()) {
            let count = counts.entry(name.clone()).or_insert(1);
            *count += 1;
            distinct = format!("{name} ({count})");
        }
        expectation.name = distinct;
    }
    expectations
}
