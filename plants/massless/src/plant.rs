//! Implementation of the [`Plant`] interface.

use std::ops::Add;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, signal};
use twinrig_legged::{Base, DriveModels, Readings, Setup, Signals, Window};
use twinrig_robot::Robot;
use twinrig_runtime::interrupt::LongLoop;
use twinrig_runtime::{EnergyBalance, Plant, PlantFault, PlantState, WorkCounts};

use crate::drives::Inputs;
use crate::flow::{Flow, FlowError, SavedFlow};
use crate::model::{MasslessError, Model, Options};
use crate::readings::RobotReadings;
use crate::state::State;

/// Plant of a robot whose legs have mass at the foot only.
#[derive(Debug, Clone)]
pub struct Massless {
    /// Independent parts: the whole robot, or each leg where the trunk is fixed. Removing a leg
    /// then changes no bit of the others.
    pub(crate) flows: Vec<Flow>,
    /// Flows at the start of the present step, for the case that one fails after others have
    /// advanced.
    step_start: Vec<SavedFlow>,
    now: SimTime,
    step: SimDuration,
    signals: Signals,
    window: Window,
}

/// Serialised state of the plant.
#[derive(Serialize, Deserialize)]
struct Saved {
    now: SimTime,
    window: Window,
    flows: Vec<SavedFlow>,
}

impl Massless {
    /// Builds the plant with the trunk level and at rest, the legs at their start, and the lowest
    /// foot at height zero, or on the ground where that is higher; onto lower ground it falls.
    /// `requested` selects the output signals.
    ///
    /// # Errors
    /// [`MasslessError`] if robot and options are inconsistent.
    pub fn new(
        robot: &Robot,
        options: &Options,
        requested: &dyn Fn(&str) -> bool,
    ) -> Result<Self, MasslessError> {
        let flows = islands(robot, options)?
            .iter()
            .map(|island| {
                let model = Model::new(robot, island)?;
                let (state, inputs) = start(robot, &model, &island.setup)?;
                Flow::new(model, &state, inputs)
                    .map_err(|error| MasslessError::Start(error.to_string()))
            })
            .collect::<Result<Vec<_>, _>>()?;
        let legs: Vec<&str> = flows
            .iter()
            .flat_map(|flow| &flow.model.legs)
            .map(|leg| leg.name.as_str())
            .collect();
        let signals = Signals::new(&legs, &options.setup, requested);
        Ok(Self {
            step_start: Vec::with_capacity(flows.len()),
            flows,
            now: SimTime::ZERO,
            step: options.setup.step,
            signals,
            window: Window::default(),
        })
    }

    /// Replaces the flows and sets the time.
    pub(crate) fn replace_flows(&mut self, flows: Vec<Flow>, now: SimTime) {
        (self.flows, self.now) = (flows, now);
        self.window = Window::default();
        self.begin_window();
    }

    /// Restores the state at the start of the step: other flows may have advanced.
    fn roll_back(&mut self) {
        for (flow, saved) in self.flows.iter_mut().zip(&self.step_start) {
            flow.restore(saved)
                .expect("the legs have a pose in every state that was saved");
        }
    }

    fn fault(&self, flow: &Flow, error: &FlowError) -> PlantFault {
        let part = match error {
            FlowError::NoPose(no_pose) => signal::leg_path(&flow.model.legs[no_pose.leg].name),
            FlowError::SolveError(_) => "contact".to_owned(),
            FlowError::NotFinite
            | FlowError::NotConverged { .. }
            | FlowError::Penetration { .. }
            | FlowError::Dissipation { .. } => "integrator".to_owned(),
        };
        PlantFault {
            time: self.now,
            part,
            energy: self.energy().stored(),
            why: error.to_string(),
        }
    }
}

/// Options of the independent parts: the robot, or each of its legs where the trunk is fixed.
fn islands(robot: &Robot, options: &Options) -> Result<Vec<Options>, MasslessError> {
    let setup = &options.setup;
    let selected_mounts = setup.selected_mounts(robot)?;
    if setup.base != Base::Fixed || selected_mounts.is_empty() {
        return Ok(vec![options.clone()]);
    }
    let single_leg = |name: &String| Options {
        setup: Setup {
            legs: vec![name.clone()],
            ..setup.clone()
        },
        force: options.force,
    };
    Ok(selected_mounts
        .iter()
        .map(|mount| single_leg(&mount.name))
        .collect())
}

/// State at the start, and inputs that keep servos there; motors coast.
fn start(robot: &Robot, model: &Model, setup: &Setup) -> Result<(State, Inputs), MasslessError> {
    let mut state = State::zero();
    state.set_attitude([1.0, 0.0, 0.0, 0.0]);
    let mut inputs = Inputs::default();
    for (i, leg) in model.legs.iter().enumerate() {
        let start = setup.start.of_leg(&leg.name, &leg.pantograph)?;
        let pose = leg.pantograph.pose_of_angles(start.angles);
        let pose = pose.map_err(|error| MasslessError::Start(error.to_string()))?;
        if !leg.pantograph.is_unfolded(&pose) {
            let why = "the ankle is folded up to the second segment, where hip and foot do not determine the pose";
            return Err(MasslessError::Start(format!("leg {}: {why}", leg.name)));
        }
        if let Some(DriveModels::Servos(_)) = model.drives {
            inputs[i][..2].copy_from_slice(&[start.command.hip, start.command.knee]);
        }
        state.set_foot(i, start.foot);
        state.set_hip(i, start.angles[0]);
        state.set_pulley(i, start.command.knee);
        state.set_foot_velocity(i, start.foot_velocity);
        state.set_hip_rate(i, start.rates[0]);
    }
    let height = setup.height(robot, |mount, start| {
        let foot = Vector3::new(start.foot.x, 0.0, start.foot.y);
        Vector3::from(mount.hip) - model.centre + foot
    })?;
    state.set_position(Vector3::z() * height);
    Ok((state, inputs))
}

impl Plant for Massless {
    fn name(&self) -> &'static str {
        "massless"
    }

    fn ports(&self) -> Vec<Port> {
        self.signals.ports().to_vec()
    }

    fn initial_inputs(&self, inputs: &mut [f64]) {
        let initial_inputs = self.flows.iter().flat_map(Flow::port_inputs);
        for (input, first) in inputs.iter_mut().zip(initial_inputs) {
            *input = *first;
        }
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        self.signals
            .check_inputs(inputs, self.now, || self.energy().stored())?;
        let mut remaining = inputs.iter();
        for flow in &mut self.flows {
            for (port_input, input) in flow.port_inputs_mut().zip(&mut remaining) {
                *port_input = *input;
            }
        }
        let mut steps = LongLoop::default();
        while self.now < to {
            if steps.is_interrupted() {
                return Err(PlantFault::interrupted(self, self.now));
            }
            let next = to.min(self.now + self.step);
            let seconds = (next - self.now).as_secs_f64();
            if self.flows.len() > 1 {
                self.step_start.clear();
                self.step_start.extend(self.flows.iter().map(Flow::save));
            }
            for i in 0..self.flows.len() {
                if let Err(error) = self.flows[i].run(seconds) {
                    self.roll_back();
                    return Err(self.fault(&self.flows[i], &error));
                }
            }
            self.now = next;
        }
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        let now_s = self.now.as_secs_f64();
        self.signals
            .write(&RobotReadings(&self.flows), &self.window, now_s, outputs);
    }

    fn begin_window(&mut self) {
        let flows = self.flows.iter();
        let impulses = flows.flat_map(|flow| &flow.impulses[..flow.model.legs.len()]);
        self.window.begin(self.now.as_secs_f64(), impulses);
    }

    fn energy(&self) -> EnergyBalance {
        RobotReadings(&self.flows).energy()
    }

    fn work(&self) -> WorkCounts {
        let counts = self.flows.iter().map(|flow| flow.counts);
        counts.fold(WorkCounts::default(), Add::add)
    }

    fn save(&self) -> Snapshot {
        let flows = self.flows.iter().map(Flow::save).collect();
        Snapshot::of(&Saved {
            now: self.now,
            window: self.window,
            flows,
        })
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let saved: Saved = snapshot.read()?;
        let mismatch = |found: String| SnapshotError::Mismatch {
            expected: "massless".to_owned(),
            found,
        };
        if saved.flows.len() != self.flows.len() {
            return Err(mismatch(format!("{} independent parts", saved.flows.len())));
        }
        for (flow, saved) in self.flows.iter_mut().zip(&saved.flows) {
            flow.restore(saved)
                .map_err(|no_pose| mismatch(no_pose.to_string()))?;
        }
        (self.now, self.window) = (saved.now, saved.window);
        Ok(())
    }

    fn state(&self) -> Option<PlantState> {
        Some(self.posture().state(self.now))
    }

    fn resume_from(&mut self, from: &PlantState) -> Result<Vec<String>, PlantFault> {
        self.resume_from_state(from)
    }
}

#[cfg(test)]
mod tests;
