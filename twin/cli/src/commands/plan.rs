//! Command `twin plan`: the scene of a scenario.

mod actuator;
mod contents;
mod format;
mod loads;
mod push;
mod sensor;
mod sufficient;
mod sufficient_text;
mod tables;

use twinrig_document::escaped;
use twinrig_kernel::{Direction, Port};
use twinrig_runtime::Coupling;
use twinrig_runtime::{Group, Rig};
use twinrig_scenario::Scenario;

use self::actuator::Actuator;
use self::contents::{Diagnostic, Free, Plan, Signal, Timetable, Wire};
use self::format::{ms, section};
use self::loads::Loads;
use self::push::PlannedPush;
use self::sensor::{Sensor, sensed};
use self::tables::{diagnostics, signals, undriven, wired};
use super::{FAILURE, SUCCESS, Terminal, settings, source};
use crate::args::{PlanArgs, Settings};
use crate::error::TwinError;
use crate::report::left_out;
use twinrig_report::text::grid::{Cell, Grid, Left};
use twinrig_report::text::style::{BOLD, DIM, styled};
use twinrig_rig::assembly::Assembly;
use twinrig_rig::error::Error;
use twinrig_rig::parts::coupling;
use twinrig_rig::registry::Registry;
use twinrig_rig::report::{WarningEntry, seconds};

pub(super) fn plan(registry: &Registry, args: &PlanArgs, terminal: &mut Terminal<'_>) -> u8 {
    if args.sufficient {
        return sufficient::search(registry, args, terminal);
    }
    match planned(registry, args) {
        Ok((plan, assembly)) => {
            if args.json {
                terminal.print_json(&plan);
            } else {
                terminal.warn(&assembly.scenario().warnings);
                let text = text(&plan);
                terminal.print(&text);
            }
            SUCCESS
        }
        Err(error) => {
            terminal.report_error(&error, args.json);
            FAILURE
        }
    }
}

fn planned<'r>(registry: &'r Registry, args: &PlanArgs) -> Result<(Plan, Assembly<'r>), TwinError> {
    let plant = match &args.plant[..] {
        [] => None,
        [plant] => Some(plant.clone()),
        [first, second, ..] => {
            return Err(TwinError::from(Error::InvalidOptions {
                why: format!("--plant names `{first}` and `{second}`, and a scene has one plant"),
                help: "give one, or add --sufficient to search among them".to_owned(),
            }));
        }
    };
    let set = args.set.clone();
    let settings = settings(&Settings { set, plant });
    let assembly = source::assembly(registry, &args.scenario, &settings)?;
    Ok((of(registry, &assembly)?, assembly))
}

/// Returns the object that `twin plan --json` prints.
///
/// # Errors
/// A part that cannot be built.
pub fn plan_json(registry: &Registry, assembly: &Assembly<'_>) -> Result<String, TwinError> {
    let plan = of(registry, assembly)?;
    // Serialisation fails only for keys that are not strings.
    Ok(serde_json::to_string(&plan).unwrap_or_default())
}

fn of(registry: &Registry, assembly: &Assembly<'_>) -> Result<Plan, TwinError> {
    let rig = assembly.rig()?;
    let (scene, scenario) = (assembly.scene(), assembly.scenario());
    let signals = assembly.plant_outputs().iter().map(|port| Signal {
        name: port.name.clone(),
        unit: port.unit.symbol(),
        size: port.size,
        computed: scene.wanted.contains(&port.name),
        recorded: scene.recorded.contains(&port.name),
    });
    let diagnostics = assembly.diagnostics().iter().map(|port| Diagnostic {
        name: port.name.clone(),
        unit: port.unit.symbol(),
        recorded: scene.recorded.contains(&port.name),
    });
    Ok(Plan {
        scenario: scenario.name.clone(),
        seed: scenario.seed,
        duration_s: seconds(scenario.duration.as_nanos()),
        plant: scenario.plant.model.clone(),
        constraints: assembly.constraints(),
        controller: scenario.controller.as_ref().map(|spec| spec.kind.clone()),
        robot: assembly.body().name().to_owned(),
        legs: scene.legs.iter().map(|leg| leg.name.clone()).collect(),
        schedule: Timetable {
            io_step_s: seconds(scenario.io.step.as_nanos()),
            control_period_s: seconds(assembly.period().as_nanos()),
            observe_period_s: seconds(scenario.observe.period.as_nanos()),
            frames_hz: scenario.record.frames,
            plant_step_s: registry
                .plant_step(&scenario.plant)
                .or_else(|| assembly.body().standalone_model()?.step())
                .map(|step| seconds(step.as_nanos())),
            coupling_grid_s: match scenario.plant.coupling {
                Coupling::Exact => None,
                Coupling::Grid { step, .. } => Some(seconds(step.as_nanos())),
            },
        },
        actuator: Actuator::of(assembly),
        loads: Loads::of(&scenario.plant),
        coupling: coupling::describe(scenario.plant.coupling),
        wires: wires(&rig),
        sensors: Sensor::all(assembly),
        free: free(&rig, scenario),
        signals: signals.collect(),
        diagnostics: diagnostics.collect(),
        changes: scenario.changes.len(),
        pushes: PlannedPush::all(&scenario.pushes),
        expectations: scenario
            .expectations
            .iter()
            .map(|one| one.name.clone())
            .collect(),
        left_out: scene.left_out.clone(),
        warnings: WarningEntry::all(&scenario.warnings),
    })
}

/// Returns the connections between the process and the plant, and their tasks.
fn wires(rig: &Rig) -> Vec<Wire> {
    let (process, plant) = (rig.process().name(), rig.plant().name());
    let wire = |port: &Port| {
        let task = rig.carrier(port).unwrap_or_default();
        let ends = [process.to_owned(), format!("{task} → {plant}")];
        let [process, plant] = match port.direction {
            Direction::Output => ends,
            Direction::Input => [format!("{plant} → {task}"), process.to_owned()],
        };
        Wire {
            signal: port.name.clone(),
            unit: port.unit.symbol(),
            from: process,
            to: plant,
        }
    };
    let fields = [Group::ProcessInputs, Group::ProcessOutputs];
    let fields = fields
        .into_iter()
        .flat_map(|group| rig.layout(group).fields());
    fields.map(|field| wire(&field.port)).collect()
}

/// Returns the inputs of the plant that no process drives; none for scenarios with a bus, whose
/// boards drive the inputs.
fn free(rig: &Rig, scenario: &Scenario) -> Vec<Free> {
    let written = rig.layout(Group::ProcessOutputs);
    let ports = rig.plant().ports().into_iter();
    let inputs = ports.filter(|port| port.direction == Direction::Input);
    let free = inputs.filter(|port| {
        let mut written = written.fields();
        scenario.buses.is_empty() && written.all(|field| field.port.name != port.name)
    });
    let one = |port: Port| Free {
        name: port.name,
        unit: port.unit.symbol(),
        size: port.size,
    };
    free.map(one).collect()
}

/// Formats a time, rounded to nanoseconds, the resolution of the schedule.
fn text(plan: &Plan) -> String {
    let times = &plan.schedule;
    let mut facts = Grid::new(&[Left, Left]);
    let mut fact = |name: &str, value: String| facts.row([Cell::new(name, DIM), value.into()]);
    let legs = match &plan.legs[..] {
        [] => String::new(),
        legs => format!(", legs {}", legs.join(" ")),
    };
    fact("robot", format!("{}{legs}", plan.robot));
    fact(
        "plant",
        format!(
            "{}{}{}, observed every {}",
            plan.plant,
            plan.constraints
                .map_or_else(String::new, |it| format!(", {it} constraints")),
            times
                .plant_step_s
                .map_or_else(String::new, |step| format!(", step {}", ms(step))),
            ms(times.observe_period_s)
        ),
    );
    if let Some(actuator) = &plan.actuator {
        fact("actuator", actuator.describe());
    }
    fact("coupling", plan.coupling.clone());
    let controller = plan.controller.as_deref().unwrap_or("none");
    let period = ms(times.control_period_s);
    fact(
        "controller",
        format!(
            "{controller}, every {period}; I/O step {}",
            ms(times.io_step_s)
        ),
    );
    let changes = match plan.changes {
        0 => String::new(),
        1 => ", 1 scheduled change".to_owned(),
        count => format!(", {count} scheduled changes"),
    };
    fact(
        "run",
        format!("{} s, seed {}{changes}", plan.duration_s, plan.seed),
    );
    let mut lines = vec![styled(BOLD, &plan.scenario)];
    lines.extend(facts.lines(2));
    plan.loads.sections(&mut lines);
    section(&mut lines, "connections", &wired(plan));
    section(&mut lines, "sensors", &sensed(&plan.sensors, &plan.legs));
    let title = "undriven inputs of the plant";
    section(&mut lines, title, &undriven(plan));
    section(&mut lines, "signals of the plant", &signals(plan));
    section(
        &mut lines,
        "counters of drivers and boards",
        &diagnostics(plan),
    );
    section(&mut lines, "pushes", &PlannedPush::grid(&plan.pushes));
    let mut expected = Grid::new(&[Left]);
    for name in &plan.expectations {
        expected.row([name.as_str().into()]);
    }
    section(&mut lines, "expectations", &expected);
    let mut left_out = Grid::new(&[Left]);
    for [parts, why] in left_out::lines(&plan.left_out) {
        let why = styled(DIM, &format!("({why})"));
        left_out.row([Cell::of_styled(format!("{} {why}", escaped(&parts)))]);
    }
    section(&mut lines, "left out", &left_out);
    lines.join("\n")
}
