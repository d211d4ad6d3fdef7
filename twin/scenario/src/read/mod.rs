//! Reading scenario files.

mod bus;
mod changes;
mod checks;
mod controller;
mod coupling;
mod fall;
mod plant;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use twinrig_document::{Document, DocumentError, Item, Overrides, Range, Reported, Table};
use twinrig_kernel::{SimDuration, Unit};

pub(crate) use checks::{code, print_duration};
pub(crate) use controller::time_model;

use checks::ScenarioChecks;

use crate::catalogue::{Catalogue, Kind};
use crate::expect::{Context, Expectation, expectation, placed_text};
use crate::scenario::{
    ControllerSpec, FootstepSpec, IoSpec, LoadThreshold, ObserveSpec, Placed, RecordSpec, Scenario,
    Setting,
};

/// Reads a scenario from a document.
pub(crate) fn scenario(
    mut document: Document,
    folder: &Path,
    settings: &[Setting],
    catalogue: &Catalogue,
) -> Result<Scenario, DocumentError> {
    let file = document.file().to_owned();
    let text = document.text().to_owned();
    for setting in settings {
        document.set(&setting.origin, &setting.key, &setting.value)?;
    }
    let (mut scenario, warnings) = document.check_and_warn(|table| {
        let source = Source {
            file,
            text,
            folder,
            settings,
        };
        read(table, source, catalogue)
    })?;
    scenario.warnings = warnings;
    Ok(scenario)
}

/// Reads the robot, which only a standalone plant does not require.
fn robot(table: &Table<'_>, catalogue: &Catalogue) -> Result<Option<Placed<String>>, Reported> {
    if has(table, "robot") || !is_standalone(table, catalogue) {
        return table.required("robot", placed_text).map(Some);
    }
    table.expect(["robot"]);
    if has(table, "override") {
        let message = "[override] requires a robot";
        return Err(table.report("override", message, "set `robot`, or leave the table out"));
    }
    Ok(None)
}

fn has(table: &Table<'_>, key: &str) -> bool {
    table.keys().any(|known| known == key)
}

/// Returns whether the plant is of a standalone kind, in this build or in another.
fn is_standalone(table: &Table<'_>, catalogue: &Catalogue) -> bool {
    let plant = table.get("plant");
    let model = plant.and_then(|plant| plant.peek("model"));
    let Some(Ok(name)) = model.as_ref().map(Item::text) else {
        return false;
    };
    let mut kinds = catalogue.plants.iter();
    kinds.any(|kind| kind.name == name && kind.is_standalone)
}

struct Source<'s> {
    file: String,
    text: String,
    folder: &'s Path,
    settings: &'s [Setting],
}

fn read(
    table: &Table<'_>,
    source: Source<'_>,
    catalogue: &Catalogue,
) -> Result<Scenario, Reported> {
    let name = table.optional("name", |item| item.text().map(str::to_owned));
    let robot = robot(table, catalogue);
    let overrides = table.optional("override", Item::overrides);
    let duration = table.required("duration", Item::positive_duration);
    let run = *duration.as_ref().unwrap_or(&SimDuration::MAX);
    let seed = table.optional("seed", Item::natural);
    let observe = table.optional("observe", |item| observe(&item.table()?));
    let observed = observe.as_ref().ok().copied().flatten();
    let observed = observed.unwrap_or(OBSERVE_PERIOD);
    let plant = table.required("plant", |item| plant::plant(item, catalogue, observed));
    let actuator = match &plant {
        Ok(plant) if plant.is_standalone && table.get("actuator").is_some() => {
            let message = format!("the plant `{}` brings its own actuators", plant.model);
            Err(table.report("actuator", message, "leave the table out"))
        }
        _ => table.optional("actuator", |item| plant::actuator(&item.table()?, run)),
    };
    let controller = table.optional("controller", |item| {
        controller::controller(item, &catalogue.controllers)
    });
    let buses = table.optional("bus", |item| bus::buses(item, &catalogue.buses));
    let fall = table.optional("fall", fall::fall);
    let footsteps = table.optional("footsteps", |item| footsteps(&item.table()?));
    let record = table.optional("record", |item| record(&item.table()?));
    let controller = controller.map(Option::flatten);
    let control = controller
        .as_ref()
        .map(Option::as_ref)
        .map_err(|reported| *reported);
    let io = table.optional("io", |item| io(&item.table()?, control.unwrap_or(None)));
    let changes = changes::changes(table, control, catalogue, run);
    let faults = table.optional("fault", |item| item.each(|item| bus::fault(item, run)));
    let context = Context {
        plants: catalogue
            .plants
            .iter()
            .map(|kind| kind.name.as_str())
            .collect(),
        duration: run,
        first_change: changes
            .as_ref()
            .map_or(None, |changes| changes.first().map(|c| c.at)),
    };
    let expectations = table.optional("expect", |item| {
        item.each(|item| expectation(item, &context))
    });
    let (controller, io, plant) = (controller?, io?, plant?);
    let applies = |expectation: &Expectation| {
        expectation.plants.is_empty() || expectation.plants.contains(&plant.model)
    };
    let (expectations, of_other_plants): (Vec<_>, Vec<_>) = expectations?
        .unwrap_or_default()
        .into_iter()
        .partition(applies);
    let (buses, faults) = (buses?.unwrap_or_default(), faults?.unwrap_or_default());
    bus::check_sites(table, &buses, &faults)?;
    let io = io.unwrap_or_else(|| controller::io_default(controller.as_ref()));
    let footsteps = footsteps?.unwrap_or(FOOTSTEPS);
    let checks = ScenarioChecks {
        duration: duration?,
        observe: observed,
        footsteps: &footsteps,
        plant: &plant,
        controller: controller.as_ref(),
        io: &io,
        expectations: &expectations,
        of_other_plants: of_other_plants.len(),
    };
    checks.check(table)?;
    Ok(Scenario {
        name: name?.unwrap_or_else(|| stem(&source.file)),
        file: source.file,
        text: source.text,
        settings: source.settings.to_vec(),
        folder: source.folder.to_owned(),
        robot: robot?,
        overrides: overrides?.unwrap_or_else(Overrides::default),
        duration: duration?,
        seed: seed?.unwrap_or(1),
        plant,
        actuator: actuator?.unwrap_or_default(),
        controller,
        io,
        buses,
        faults,
        observe: ObserveSpec {
            period: observe?.unwrap_or(OBSERVE_PERIOD),
            footsteps,
        },
        fall: fall::spec(fall?.unwrap_or_default(), &expectations),
        record: record?.unwrap_or(RECORD),
        changes: changes?,
        expectations: distinct(expectations),
        of_other_plants,
        warnings: Vec::new(),
    })
}

const OBSERVE_PERIOD: SimDuration = SimDuration::from_millis(2);

const RECORD: RecordSpec = RecordSpec {
    signals: None,
    frames: Some(50.0),
    bytes: false,
};

/// Default thresholds of footsteps. The load of a stance foot is a quarter of the body weight in
/// standing and up to the whole in a trot; residual loads in swing are below a twentieth, and
/// stance loads above a fiftieth. A swing of the gaits takes at least 100 ms, a bounce at most 30
/// ms.
const FOOTSTEPS: FootstepSpec = FootstepSpec {
    touch_down: LoadThreshold::OfWeight(0.05),
    lift_off: LoadThreshold::OfWeight(0.02),
    shortest_swing: SimDuration::from_millis(40),
    least_impulse: 5e-3,
};

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

/// Returns the kind that `item` names, if the build has it.
fn kind<'k>(item: &Item<'_>, label: &str, kinds: &'k [Kind]) -> Result<&'k Kind, Reported> {
    let name = item.text()?;
    let Some(kind) = kinds.iter().find(|kind| kind.name == name) else {
        let names = kinds.iter().map(|kind| kind.name.as_str());
        let message = format!("there is no {label} `{name}`");
        let plural = if label == "bus" {
            "buses".to_owned()
        } else {
            format!("{label}s")
        };
        return Err(item.report_word(message, name, &plural, names));
    };
    if let Some(feature) = &kind.missing_feature {
        let message = format!("this build has no {label} `{name}`");
        let needs = kind.build_needs.as_ref();
        let after = needs.map_or_else(String::new, |needs| format!(", after `{needs}`"));
        let help = format!("build with `--features {feature}`{after}");
        return Err(item.report(message, help));
    }
    Ok(kind)
}

fn observe(table: &Table<'_>) -> Result<SimDuration, Reported> {
    let period = table.optional("period", Item::positive_duration)?;
    Ok(period.unwrap_or(OBSERVE_PERIOD))
}

fn footsteps(table: &Table<'_>) -> Result<FootstepSpec, Reported> {
    let touch_down = table.optional("touch_down", load);
    let lift_off = table.optional("lift_off", load);
    let shortest_swing = table.optional("shortest_swing", Item::duration);
    let least_impulse = table.optional("least_impulse", |item| {
        item.quantity(Unit::Second, &Range::NOT_NEGATIVE)
    });
    let spec = FootstepSpec {
        touch_down: touch_down?.unwrap_or(FOOTSTEPS.touch_down),
        lift_off: lift_off?.unwrap_or(FOOTSTEPS.lift_off),
        shortest_swing: shortest_swing?.unwrap_or(FOOTSTEPS.shortest_swing),
        least_impulse: least_impulse?.unwrap_or(FOOTSTEPS.least_impulse),
    };
    let order = match (spec.lift_off, spec.touch_down) {
        (LoadThreshold::OfWeight(low), LoadThreshold::OfWeight(high))
        | (LoadThreshold::Newton(low), LoadThreshold::Newton(high)) => low <= high,
        _ => {
            let message =
                "`touch_down` and `lift_off` are not both forces or both shares of the weight";
            let help = "as in \"0.5 N\" and \"0.2 N\", or 0.05 and 0.02";
            return Err(table.report("touch_down", message, help));
        }
    };
    if !order {
        let message = "`lift_off` is more than `touch_down`";
        let help = "`lift_off` must not exceed `touch_down` (hysteresis)";
        return Err(table.report("lift_off", message, help));
    }
    Ok(spec)
}

fn load(item: &Item<'_>) -> Result<LoadThreshold, Reported> {
    if item.spelled_unit() == Unit::Newton {
        let load = item.quantity(Unit::Newton, &Range::POSITIVE)?;
        return Ok(LoadThreshold::Newton(load));
    }
    Ok(LoadThreshold::OfWeight(item.number(&Range::POSITIVE)?))
}

fn record(table: &Table<'_>) -> Result<RecordSpec, Reported> {
    let signals = table.optional("signals", |item| item.each(placed_text));
    let frames = table.optional("frames", |item| {
        item.quantity(Unit::Hertz, &Range::NOT_NEGATIVE)
    });
    let bytes = table.optional("bytes", Item::boolean);
    let frames = frames?.map_or(RECORD.frames, |rate| (rate > 0.0).then_some(rate));
    Ok(RecordSpec {
        signals: signals?,
        frames,
        bytes: bytes?.unwrap_or(RECORD.bytes),
    })
}

fn io(table: &Table<'_>, control: Option<&ControllerSpec>) -> Result<IoSpec, Reported> {
    let default = controller::io_default(control);
    let step = table.optional("step", Item::positive_duration);
    let transfer_time = table.optional("transfer_time", controller::time_model);
    let step = step?.unwrap_or(default.step);
    if let Some(control) = control
        && !control.period.is_multiple_of(step)
    {
        let message = "the controller's period is not a multiple of the step of its I/O";
        let help = format!("the period is {}; the step must divide it", control.period);
        return Err(table.report("step", message, help));
    }
    Ok(IoSpec {
        step,
        transfer_time: transfer_time?.unwrap_or(default.transfer_time),
    })
}
