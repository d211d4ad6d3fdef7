use twinrig_kernel::{Agenda, SimTime};

use super::Rig;
use crate::event_loop::{EventLoop, rank};
use crate::process_slot::ProcessSlot;
use crate::schedule::implied_busy;
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
        let compute = schedule
            .compute
            .clone()
            .source(schedule.seed, "process/compute");
        let named: Vec<_> = tasks
            .iter()
            .map(|task| (task.name().to_string(), task.ports()))
            .collect();
        let process = ProcessSlot::new(process, &named)?;
        let busy = tasks.iter().map(|task| implied_busy(task.period(), period));
        let implied_busy = busy.collect();
        let parts = named.into_iter().map(|(name, _)| name).zip(tasks);
        let agenda = Agenda::new(schedule.events_max);
        let own_events = |agenda: &mut Agenda| {
            let process_end = agenda.register("process end", rank::PROCESS_END);
            let control_step = agenda.register("control step", rank::CONTROL_STEP);
            agenda.arm(control_step, SimTime::ZERO);
            (process_end, control_step)
        };
        let (events, (process_end, control_step)) =
            EventLoop::new(plant, parts.collect(), schedule.observe, agenda, own_events)?;
        Ok(Self {
            process,
            manager: Manager::new(events.parts.len()),
            implied_busy,
            events,
            compute: compute.map_err(RigError::Compute)?,
            period,
            end: None,
            sensors: Vec::new(),
            process_end,
            control_step,
            failed: None,
        })
    }
}
