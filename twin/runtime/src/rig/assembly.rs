use twinrig_kernel::{Agenda, Direction, Layout, Port, SimTime};

use super::{Parts, Rig, RigState, TaskSlot, rank};
use crate::plant_host::PlantHost;
use crate::process_slot::ProcessSlot;
use crate::wiring::{check_names, wire};
use crate::{IoTask, Manager, Plant, Process, RigError, Schedule};

impl Rig {
    /// Wires the parts by name and schedules the first control step and the first observation at
    /// time 0.
    ///
    /// # Errors
    /// [`RigError::Wiring`] if a signal does not connect, [`RigError::BadPeriod`] and
    /// [`RigError::Compute`] if the schedule is invalid.
    pub fn new(
        schedule: &Schedule,
        process: Box<dyn Process>,
        tasks: Vec<Box<dyn IoTask>>,
        plant: Box<dyn Plant>,
    ) -> Result<Self, RigError> {
        let period = schedule.period()?;
        if schedule.observe.is_zero() {
            return Err(RigError::BadPeriod {
                what: "observation",
            });
        }
        let compute = schedule
            .compute
            .clone()
            .source(schedule.seed, "process/compute");
        let process_ports = process.ports();
        check_names(plant.name(), &plant.ports())?;
        let mut agenda = Agenda::new(schedule.events_max);
        let plant_host = PlantHost::new(plant);
        let diagnostics: Vec<Port> = tasks.iter().flat_map(|task| task.diagnostics()).collect();
        check_names(
            "the list of diagnostics of drivers and devices",
            &diagnostics,
        )?;
        let traces = tasks.iter().flat_map(|task| task.traces()).collect();
        let tasks = connect(
            process.name(),
            &process_ports,
            tasks,
            &plant_host,
            &mut agenda,
        )?;
        let parts = Parts {
            process_end: agenda.register("process end", rank::PROCESS_END),
            control_step: agenda.register("control step", rank::CONTROL_STEP),
            observation: agenda.register("observation", rank::OBSERVATION),
        };
        agenda.arm(parts.control_step, SimTime::ZERO);
        agenda.arm(parts.observation, SimTime::ZERO);
        let diagnostics = Layout::of(&diagnostics, Direction::Output);
        let state = RigState {
            manager: Manager::new(tasks.len()),
            agenda,
            compute: compute.map_err(RigError::Compute)?,
            diagnostics: vec![0.0; diagnostics.len()],
        };
        let observe = schedule.observe;
        Ok(Self {
            process: ProcessSlot::new(process, &process_ports),
            tasks,
            plant_host,
            state,
            diagnostics,
            traces,
            period,
            observe,
            parts,
            failed: None,
        })
    }
}

/// Wires the tasks to process and plant, and registers them with the agenda.
fn connect(
    process_name: &str,
    process_ports: &[Port],
    tasks: Vec<Box<dyn IoTask>>,
    plant_host: &PlantHost,
    agenda: &mut Agenda,
) -> Result<Vec<TaskSlot>, RigError> {
    let named: Vec<_> = tasks
        .iter()
        .map(|task| (task.name().to_string(), task.ports()))
        .collect();
    let links = wire((process_name, process_ports), &named)?;
    let mut slots: Vec<TaskSlot> = Vec::new();
    let (mut diagnostics_end, mut first_trace) = (0, 0);
    for ((mut task, (name, ports)), links) in tasks.into_iter().zip(named).zip(links) {
        task.connect(&name, &plant_host.signals)?;
        let from_process = vec![0.0; Layout::of(&ports, Direction::Input).len()];
        let part = agenda.register(name.clone(), rank::TASK);
        let diagnostics_start = diagnostics_end;
        diagnostics_end += Layout::of(&task.diagnostics(), Direction::Output).len();
        let traces = task.traces().len();
        slots.push(TaskSlot {
            task,
            name,
            links,
            from_process,
            diagnostics: diagnostics_start..diagnostics_end,
            first_trace,
            part,
        });
        first_trace += traces;
    }
    Ok(slots)
}
