//! Plant of a legged robot: steps, windows, signals, snapshots and faults, of any [`Dynamics`].

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Direction, Port, SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_robot::Robot;
use twinrig_runtime::interrupt::LongLoop;
use twinrig_runtime::{
    EnergyBalance, LimitViolation, Plant, PlantEvent, PlantFault, PlantState, WorkCounts,
};

use crate::assembly::AssemblyWatch;
use crate::dynamics::{Dynamics, FromRobot, PartFault};
use crate::error::LeggedError;
use crate::friction::Friction;
use crate::ground_friction::GroundFriction;
use crate::limits::{Excesses, Limits};
use crate::push::Push;
use crate::push_schedule::PushSchedule;
use crate::serial::{SavedServos, SerialServos};
use crate::setup::{Base, Contacts, Drives, Setup};
use crate::signals::Signals;
use crate::window::{GroundImpulses, Window};
use twinrig_actuator::{Ramp, SetPoint, SetPoints, StepInputs};

/// Plant of a legged robot with the given dynamics.
#[derive(Debug, Clone)]
pub struct LeggedPlant<D: Dynamics + ?Sized> {
    dynamics: Box<D>,
    base: Base,
    contacts: Contacts,
    legs: Vec<String>,
    assembly: Vec<AssemblyWatch>,
    limits: Limits,
    now: SimTime,
    step: SimDuration,
    signals: Signals,
    /// Rates of held inputs, one for each.
    rates: Vec<f64>,
    set_points: SetPoints,
    servos: Option<SerialServos>,
    friction: Option<GroundFriction>,
    pushes: PushSchedule,
    window: Window,
    logs_events: bool,
    events: Vec<PlantEvent>,
}

/// Serialised state.
#[derive(Serialize, Deserialize)]
struct Saved<S> {
    now: SimTime,
    window: Window,
    /// Those of linear set-points.
    ramps: Vec<Ramp>,
    /// Serial servos.
    servos: Option<SavedServos>,
    /// Coefficients of friction, where they change.
    friction: Option<Friction>,
    limits: Excesses,
    dynamics: S,
}

impl<D: FromRobot + ?Sized> LeggedPlant<D> {
    /// Builds the plant with the trunk level and at rest, the legs at their start, and the lowest
    /// foot at height zero, or on the ground where that is higher; onto lower ground the robot
    /// falls. `selected` selects the output signals.
    ///
    /// # Errors
    /// If robot and options are inconsistent.
    pub fn new(
        robot: &Robot,
        options: &D::Options,
        selected: &dyn Fn(&str) -> bool,
    ) -> Result<Self, D::Error> {
        let dynamics = D::from_robot(robot, options)?;
        let setup = D::setup(options);
        let legs = setup.selected_mounts(robot)?;
        let assembly = legs.iter().map(|mount| AssemblyWatch::new(mount));
        let assembly = assembly.collect();
        let limits = Limits::new(&legs, setup.ground.as_ref())?;
        let legs: Vec<&str> = legs.iter().map(|mount| mount.name.as_str()).collect();
        let plant = Self::of(dynamics, &legs, setup, selected);
        Ok(Self {
            assembly,
            limits,
            ..plant
        })
    }
}

impl<D: Dynamics + ?Sized> LeggedPlant<D> {
    /// Builds the plant from dynamics in their initial state, of these legs.
    fn of(dynamics: Box<D>, legs: &[&str], setup: &Setup, selected: &dyn Fn(&str) -> bool) -> Self {
        let signals = Signals::new(legs, setup, selected);
        let ports = signals.ports().iter();
        let inputs = ports.filter(|port| port.direction == Direction::Input);
        let rates = vec![0.0; inputs.count()];
        let servos = matches!(setup.drives, Drives::Ideal { .. } | Drives::Servos { .. });
        let set_point = if servos {
            setup.set_point
        } else {
            SetPoint::Held
        };
        let mut set_points = SetPoints::new(set_point, rates.len());
        set_points.reset(|inputs| dynamics.initial_inputs(inputs));
        let servos = match &setup.drives {
            Drives::Serial { servo, firmware } => {
                Some(SerialServos::new(servo, *firmware, setup, &*dynamics))
            }
            _ => None,
        };
        Self {
            rates,
            set_points,
            servos,
            friction: GroundFriction::new(setup.ground.as_ref()),
            pushes: PushSchedule::default(),
            dynamics,
            base: setup.base,
            contacts: setup.contacts,
            legs: legs.iter().map(|&leg| leg.to_owned()).collect(),
            assembly: Vec::new(),
            limits: Limits::default(),
            now: SimTime::ZERO,
            step: setup.step,
            signals,
            window: Window::default(),
            logs_events: false,
            events: Vec::new(),
        }
    }

    /// Adds pushes and those of their signals that `selected` selects.
    ///
    /// # Errors
    /// [`LeggedError::Push`].
    pub fn with_pushes(
        mut self,
        pushes: &[Push],
        selected: &dyn Fn(&str) -> bool,
    ) -> Result<Self, LeggedError> {
        let legs: Vec<&str> = self.legs.iter().map(String::as_str).collect();
        self.pushes = PushSchedule::new(pushes, self.base, &legs, selected)?;
        Ok(self)
    }

    /// Returns the dynamics.
    pub fn dynamics(&self) -> &D {
        &self.dynamics
    }

    /// Returns the dynamics, for changes of their state.
    pub fn dynamics_mut(&mut self) -> &mut D {
        &mut self.dynamics
    }

    /// Checks that no leg has left its assembly mode. Called before each step, so that the fault
    /// leaves the plant in the state in which it was found.
    fn check_assembly(&self) -> Result<(), PartFault> {
        let legs = self.assembly.iter().zip(&self.legs).enumerate();
        for (i, (watch, leg)) in legs {
            watch.check(leg, self.dynamics.angles(i))?;
        }
        Ok(())
    }

    /// Sets the inputs from the present time on.
    fn set_inputs(&mut self, inputs: &[f64]) {
        let inputs = &inputs[..self.rates.len().min(inputs.len())];
        if let Some(servos) = &mut self.servos {
            servos.set_inputs(self.now, inputs);
            return;
        }
        if self.set_points.are_linear() {
            self.set_points.command(self.now, inputs);
            return;
        }
        self.dynamics.set_inputs(&StepInputs {
            start: inputs,
            rates: &self.rates,
            mean: inputs,
        });
    }
}

impl<D: Dynamics + ?Sized> Plant for LeggedPlant<D> {
    fn name(&self) -> &str {
        self.dynamics.name()
    }

    fn ports(&self) -> Vec<Port> {
        let of_pushes = self.pushes.ports();
        self.signals
            .ports()
            .iter()
            .chain(of_pushes)
            .cloned()
            .collect()
    }

    fn initial_inputs(&self, inputs: &mut [f64]) {
        let count = self.rates.len().min(inputs.len());
        let inputs = &mut inputs[..count];
        match &self.servos {
            Some(servos) => servos.inputs(inputs),
            None => self.dynamics.initial_inputs(inputs),
        }
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        self.signals
            .check_inputs(inputs, self.now, || self.energy().stored())?;
        self.set_inputs(inputs);
        let mut steps = LongLoop::default();
        while self.now < to {
            if steps.is_interrupted() {
                return Err(PlantFault::interrupted(self, self.now));
            }
            let mut next = to.min(self.now + self.step);
            if let Some(friction) = &mut self.friction {
                next = friction.step_end(self.now, next);
                friction.apply(self.now, &mut *self.dynamics);
            }
            if self.set_points.are_linear() {
                next = self.set_points.step_end(self.now, next);
            }
            if let Some(servos) = &self.servos {
                next = servos.step_end(self.now, next);
            }
            if !self.pushes.is_empty() {
                next = self.pushes.step_end(self.now, next);
                self.dynamics.set_load(self.pushes.over(self.now));
            }
            if self.set_points.are_linear() {
                let inputs = self.set_points.over(self.now, next);
                self.dynamics.set_inputs(&inputs);
            }
            let seconds = (next - self.now).as_secs_f64();
            if let Some(servos) = &mut self.servos {
                servos.start_step(self.now, seconds, &mut *self.dynamics);
            }
            // An engine that fails cannot return to the state before the step.
            let energy = self.energy().stored();
            let advanced = self.check_assembly();
            let advanced = advanced.and_then(|()| self.dynamics.advance(self.now, seconds));
            advanced.map_err(|PartFault { part, why }| PlantFault {
                time: self.now,
                part,
                energy,
                why,
            })?;
            self.now = next;
        }
        if self.logs_events {
            self.dynamics.drain_events(&mut self.events);
        }
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        self.dynamics.update_readings();
        let (now_s, servos) = (self.now.as_secs_f64(), self.servos.as_ref());
        self.signals
            .write(&*self.dynamics, servos, &self.window, now_s, outputs);
        if !self.pushes.is_empty() {
            let work = self.dynamics.energy().external;
            let window = [self.window.begun_s(), now_s];
            let of_pushes = &mut outputs[self.signals.outputs()..];
            self.pushes.write(window, work, of_pushes);
        }
    }

    fn begin_window(&mut self) {
        let mut impulses = GroundImpulses::default();
        for leg in 0..self.legs.len() {
            impulses.feet[leg] = self.dynamics.ground_impulse(leg);
            if self.contacts == Contacts::All {
                impulses.segments[leg] = self.dynamics.segments_impulse(leg);
            }
        }
        if self.contacts != Contacts::Feet {
            impulses.trunk = self.dynamics.trunk_impulse();
        }
        self.window.begin(self.now.as_secs_f64(), impulses);
        self.limits.check(self.now, &*self.dynamics);
    }

    fn energy(&self) -> EnergyBalance {
        self.dynamics.energy()
    }

    fn work(&self) -> WorkCounts {
        self.dynamics.counts()
    }

    fn constraint_violation(&self) -> Option<f64> {
        self.dynamics.constraint_violation()
    }

    fn limit_violations(&self) -> Vec<LimitViolation> {
        self.limits.violations(&self.legs)
    }

    fn least_substep_s(&self) -> Option<f64> {
        self.dynamics.least_substep_s()
    }

    fn log_events(&mut self, enabled: bool) {
        self.dynamics.log_events(enabled);
        self.logs_events = enabled;
        self.events.clear();
    }

    fn events(&self) -> &[PlantEvent] {
        &self.events
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&Saved {
            now: self.now,
            window: self.window,
            ramps: self.set_points.save(),
            servos: self.servos.as_ref().map(SerialServos::save),
            friction: self.friction.as_ref().map(GroundFriction::save),
            limits: self.limits.save(),
            dynamics: self.dynamics.save(),
        })
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let saved: Saved<D::Saved> = snapshot.read()?;
        let name = self.dynamics.name();
        let mismatch = |found| SnapshotError::Mismatch {
            expected: name.to_owned(),
            found,
        };
        let checked = self.set_points.check(&saved.ramps);
        checked.map_err(&mismatch)?;
        let servos = saved.servos.unwrap_or_default();
        let checked = match &self.servos {
            Some(of_plant) => of_plant.check(&servos),
            None => servos.check_none(),
        };
        checked.map_err(&mismatch)?;
        if let (Some(friction), Some(saved)) = (&mut self.friction, saved.friction) {
            friction.restore(saved);
            friction.set(&mut *self.dynamics);
        }
        let restored = self.dynamics.restore(saved.dynamics);
        restored.map_err(mismatch)?;
        self.set_points.restore(saved.ramps);
        if let Some(of_plant) = &mut self.servos {
            of_plant.restore(servos);
        }
        self.limits.restore(saved.limits);
        (self.now, self.window) = (saved.now, saved.window);
        Ok(())
    }

    fn state(&self) -> Option<PlantState> {
        let extra = self.dynamics.extra_state();
        let state = self.dynamics.posture().state(self.now);
        Some(
            extra
                .iter()
                .fold(state, |state, (name, values)| state.with(name, values)),
        )
    }

    fn resume_from(&mut self, from: &PlantState) -> Result<Vec<String>, PlantFault> {
        let energy = self.energy().stored();
        let fault = |PartFault { part, why }| PlantFault {
            time: from.time,
            part,
            energy,
            why,
        };
        let extra = self.dynamics.extra_state();
        let is_extra = |name: &str| extra.iter().any(|(known, _)| known == name);
        let mut posture = self.dynamics.posture();
        let mut lines = posture.resume_from(&from.only(|name| !is_extra(name)));
        let valid = posture.validate();
        valid.map_err(|why| fault(PartFault::new("body", why)))?;
        lines.extend(posture.project_onto(self.base));
        let resumed = self.dynamics.resume_from(&posture, from);
        lines.extend(resumed.map_err(fault)?);
        if let Some(friction) = &self.friction {
            friction.set(&mut *self.dynamics);
        }
        self.now = from.time;
        let initial_inputs = |inputs: &mut [f64]| self.dynamics.initial_inputs(inputs);
        self.set_points.reset(initial_inputs);
        if let Some(servos) = &mut self.servos {
            servos.restart(self.now, &*self.dynamics);
            lines.push(SerialServos::RESTARTED.to_owned());
        }
        self.events.clear();
        self.limits.restore(Excesses::default());
        self.window = Window::default();
        self.begin_window();
        Ok(lines)
    }
}
