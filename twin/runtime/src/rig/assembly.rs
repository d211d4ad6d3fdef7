use twinrig_kernel::{Agenda, Direction, Layout, Port, SimTime};

use super::{Parts, Rig, RigState, TaskSlot, rank};
use crate::far_end::FarEnd;
use crate::process_slot::ProcessSlot;
use crate::wiring::{check_names, wire};
use crate::{IoTask, Manager, Plant, Process, RigError, Schedule};

impl Rig {
    /// Wires the parts by name and puts the first control step and the first observation at time 0.
    ///
    /// # Errors
    /// [`RigError::Wiring`] if a signal does not connect, [`RigError::BadPeriod`] and
    /// [`RigError::Compute`] if the schedule cannot be.
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
        let far_end = FarEnd::new(plant);
        let gauges: Vec<Port> = tasks.iter().flat_map(|task| task.gauges()).collect();
        check_names("the list of gauges of drivers and devices", &gauges)?;
        let lanes = tasks.iter().flat_map(|task| task.lanes()).collect();
        let tasks = connect(process.name(), &process_ports, tasks, &far_end, &mut agenda)?;
        let parts = Parts {
            process_end: agenda.register("process end", rank::PROCESS_END),
            control_step: agenda.register("control step", rank::CONTROL_STEP),
            observation: agenda.register("observation", rank::OBSERVATION),
        };
        agenda.arm(parts.control_step, SimTime::ZERO);
        agenda.arm(parts.observation, SimTime::ZERO);
        let gauges = Layout::of(&gauges, Direction::Output);
        let state = RigState {
            manager: Manager::new(tasks.len()),
            agenda,
            compute: compute.map_err(RigError::Compute)?,
            gauges: vec![0.0; gauges.len()],
        };
        let observe = schedule.observe;
        Ok(Self {
            process: ProcessSlot::new(process, &process_ports),
            tasks,
            far_end,
            state,
            gauges,
            lanes,
            period,
            observe,
            parts,
            failed: None,
        })
    }
}

/// Wires the tasks to the process and to the plant, and registers them.
fn connect(
    process_name: &str,
    process_ports: &[Port],
    tasks: Vec<Box<dyn IoTask>>,
    far_end: &FarEnd,
    agenda: &mut Agenda,
) -> Result<Vec<TaskSlot>, RigError> {
    let named: Vec<_> = tasks
        .iter()
        .map(|task| (task.name().to_string(), task.ports()))
        .collect();
    let links = wire((process_name, process_ports), &named)?;
    let mut slots: Vec<TaskSlot> = Vec::new();
    let (mut gauges_end, mut first_lane) = (0, 0);
    for ((mut task, (name, ports)), links) in tasks.into_iter().zip(named).zip(links) {
        task.connect(&far_end.signals)?;
        let from_process = vec![0.0; Layout::of(&ports, Direction::Input).len()];
        let part = agenda.register(name.clone(), rank::TASK);
        let gauges_start = gauges_end;
        gauges_end += Layout::of(&task.gauges(), Direction::Output).len();
        let lanes = task.lanes().len();
        slots.push(TaskSlot {
            task,
            name,
            links,
            from_process,
            gauges: gauges_start..gauges_end,
            first_lane,
            part,
        });
        first_lane += lanes;
    }
    Ok(slots)
}
