use std::ops::Range;

use twinrig_kernel::{Agenda, Layout, PartId, SimDuration, SimTime, Snapshot, SnapshotError};

use crate::plant_host::PlantHost;
use crate::schedule::check_observation_period;
use crate::wiring::{append_ports, check_names, diagnostics_layout};
use crate::{
    Group, IoTask, Observer, Part, PartKind, Plant, PlantAccess, Progress, RigError, TaskError,
    in_part,
};

/// Order of the events of one instant.
pub(crate) mod rank {
    use twinrig_kernel::Rank;

    /// First, transfers end, so that their tasks are idle at a control step at the same instant.
    pub(crate) const TASK: Rank = Rank(0);
    /// Then the process ends, so that an iteration of exactly one period is not late.
    pub(crate) const PROCESS_END: Rank = Rank(1);
    /// Then the process begins.
    pub(crate) const CONTROL_STEP: Rank = Rank(2);
    /// Last, the plant is observed.
    pub(crate) const OBSERVATION: Rank = Rank(3);
}

/// Part that the event loop wakes at the instants requested by it.
pub(crate) trait Wakeable: Part {
    /// Handles the wake-up at `now`.
    fn wake(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<Progress, TaskError>;

    /// Returns the wake-up time outside transfers, if any.
    fn idle_wake(&self) -> Option<SimTime>;
}

impl Wakeable for Box<dyn IoTask> {
    fn wake(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<Progress, TaskError> {
        (**self).wake(now, plant)
    }

    fn idle_wake(&self) -> Option<SimTime> {
        (**self).idle_wake()
    }
}

/// Parts with wake-ups, a plant and its observation grid, in virtual time: the event loop of the
/// lockstep rig ([`crate::Rig`]) and of a served twin ([`crate::real_time::Serve`]), which keeps it
/// behind the clock.
///
/// The owner adds its own events; the loop returns them to it when they are due.
pub(crate) struct EventLoop<T> {
    pub(crate) parts: Vec<PartSlot<T>>,
    pub(crate) plant_host: PlantHost,
    pub(crate) agenda: Agenda,
    /// Diagnostics of all parts, concatenated.
    pub(crate) diagnostics: Layout,
    pub(crate) values: Vec<f64>,
    pub(crate) traces: Vec<String>,
    /// Period of the observation grid.
    pub(crate) observe: SimDuration,
    observation: PartId,
}

/// A part, its name and its ranges of the values of all parts.
pub(crate) struct PartSlot<T> {
    pub(crate) part: T,
    pub(crate) name: String,
    diagnostics: Range<usize>,
    /// Index of its first byte trace.
    first_trace: usize,
    id: PartId,
}

/// An event that has been handled, or must be handled by the owner of the loop.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Event {
    /// The plant was observed.
    Observed,
    /// A part was woken.
    Woken { part: usize, progress: Progress },
    /// An event of the owner is due.
    Own(PartId),
}

impl<T> PartSlot<T> {
    /// Returns the error of a failed call; a fault of the plant is not attributed to the part.
    pub(crate) fn error(&self, time: SimTime, source: TaskError) -> RigError {
        match source {
            TaskError::Plant(fault) => fault.into(),
            source => RigError::Task {
                task: self.name.clone(),
                time,
                source,
            },
        }
    }
}

impl<T: Wakeable> EventLoop<T> {
    /// Connects the parts to the plant and schedules the first observation at time 0; `register`
    /// adds the events of the owner to the agenda.
    pub(crate) fn new<R>(
        plant: Box<dyn Plant>,
        parts: Vec<(String, T)>,
        observe: SimDuration,
        mut agenda: Agenda,
        register: impl FnOnce(&mut Agenda) -> R,
    ) -> Result<(Self, R), RigError> {
        check_observation_period(observe)?;
        check_names(plant.name(), &plant.ports())?;
        let plant_host = PlantHost::new(plant);
        let (mut diagnostics, mut traces) = (Vec::new(), Vec::new());
        let mut slots = Vec::new();
        for (name, mut part) in parts {
            part.connect(&name, &plant_host.signals)?;
            let first_trace = traces.len();
            traces.extend(part.traces());
            slots.push(PartSlot {
                diagnostics: append_ports(&mut diagnostics, part.diagnostics()),
                first_trace,
                id: agenda.register(name.clone(), rank::TASK),
                part,
                name,
            });
        }
        let diagnostics = diagnostics_layout(&diagnostics)?;
        let own = register(&mut agenda);
        let observation = agenda.register("observation", rank::OBSERVATION);
        agenda.arm(observation, SimTime::ZERO);
        let event_loop = Self {
            parts: slots,
            plant_host,
            agenda,
            values: vec![0.0; diagnostics.len()],
            diagnostics,
            traces,
            observe,
            observation,
        };
        Ok((event_loop, own))
    }

    /// Schedules the wake-ups that the parts request before their first call.
    pub(crate) fn arm_parts(&mut self) {
        for slot in &self.parts {
            if let Some(at) = slot.part.idle_wake() {
                self.agenda.arm(slot.id, at);
            }
        }
    }

    /// Returns the time of the last event, or that to which the loop was advanced.
    pub(crate) fn now(&self) -> SimTime {
        self.plant_host.state.now
    }

    /// Handles the next event, if it is at `limit` or before. An event of the owner is returned at
    /// its instant.
    pub(crate) fn step<O: Observer>(
        &mut self,
        limit: SimTime,
        observer: &mut O,
    ) -> Result<Option<Event>, RigError> {
        let Some(wake) = self.agenda.pop_until(limit)? else {
            return Ok(None);
        };
        self.plant_host.state.now = wake.time;
        let part = wake.part.index();
        let event = if wake.part == self.observation {
            self.observe(observer)?;
            Event::Observed
        } else if part < self.parts.len() {
            let next = self.agenda.next_time().unwrap_or(SimTime::MAX);
            let before = SimTime::from_nanos(next.as_nanos().saturating_sub(1));
            self.plant_host.horizon = before.min(limit);
            let progress = self.call(part, observer, |part, now, plant| part.wake(now, plant));
            self.plant_host.horizon = SimTime::ZERO;
            Event::Woken {
                part,
                progress: progress?,
            }
        } else {
            Event::Own(wake.part)
        };
        Ok(Some(event))
    }

    /// Sets the time to `now`. All events up to and at it must have been handled.
    pub(crate) fn advance_to(&mut self, now: SimTime) {
        self.plant_host.state.now = now;
    }

    /// Calls a part now, passes its traffic to the observer and schedules its next wake-up. If the
    /// part has run ahead, now is its last event afterwards. A panic is attributed to it.
    pub(crate) fn call<O: Observer>(
        &mut self,
        part: usize,
        observer: &mut O,
        call: impl FnOnce(&mut T, SimTime, &mut PlantHost) -> Result<Progress, TaskError>,
    ) -> Result<Progress, RigError> {
        let now = self.now();
        let slot = &mut self.parts[part];
        let (part, plant_host) = (&mut slot.part, &mut self.plant_host);
        let progress = in_part(PartKind::Task, &slot.name, || call(part, now, plant_host));
        let now = plant_host.state.now;
        let first_trace = slot.first_trace;
        part.drain_traffic(&mut |trace, bytes| observer.bytes(now, first_trace + trace, bytes));
        let progress = progress.map_err(|source| slot.error(now, source))?;
        let wake_at = match progress {
            Progress::WakeAt(at) => Some(at),
            Progress::Done => slot.part.idle_wake(),
        };
        match wake_at {
            Some(wanted) if wanted < now => Err(RigError::WakeInThePast {
                task: slot.name.clone(),
                time: now,
                wanted,
            }),
            Some(at) => {
                self.agenda.arm(slot.id, at);
                Ok(progress)
            }
            None => Ok(progress),
        }
    }

    /// Saves the states of the parts.
    pub(crate) fn save_parts(&self) -> Vec<Snapshot> {
        let slots = self.parts.iter();
        slots
            .map(|slot| in_part(PartKind::Task, &slot.name, || slot.part.save()))
            .collect()
    }

    /// Restores the states of the parts.
    pub(crate) fn restore_parts(&mut self, snapshots: &[Snapshot]) -> Result<(), SnapshotError> {
        let mut slots = self.parts.iter_mut().zip(snapshots);
        slots.try_for_each(|(slot, snapshot)| slot.part.restore(snapshot))
    }

    fn observe<O: Observer>(&mut self, observer: &mut O) -> Result<(), RigError> {
        let now = self.now();
        self.agenda.arm(self.observation, now + self.observe);
        observer.samples(now, Group::Plant, self.plant_host.observe()?);
        self.plant_host.begin_window();
        if !self.values.is_empty() {
            for slot in self
                .parts
                .iter()
                .filter(|slot| !slot.diagnostics.is_empty())
            {
                let values = &mut self.values[slot.diagnostics.clone()];
                in_part(PartKind::Task, &slot.name, || {
                    slot.part.read_diagnostics(now, values);
                });
            }
            observer.samples(now, Group::Diagnostics, &self.values);
        }
        Ok(())
    }
}
