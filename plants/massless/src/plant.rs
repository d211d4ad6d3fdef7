//! The plant as the rig sees it.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use twinrig_kernel::{Direction, Port, SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_leg::{LegCommand, Pantograph, Planar, Stop};
use twinrig_robot::Robot;
use twinrig_runtime::{EnergyBooks, Plant, PlantFault, WorkCounts};

use crate::drives::Commands;
use crate::flow::{Flow, FlowError, SavedFlow};
use crate::model::{Base, MasslessError, Model, Options, chosen_legs};
use crate::signals::{self, Signals, Window};
use crate::state::{LEGS, State};

/// A start height, as a share of the greatest leg length, where none is given.
const START_SHARE: f64 = 0.9;

/// What rounding may put a start beyond a stop \[m\].
const BEYOND: f64 = 1e-9;

/// A robot whose legs have no mass but at the foot.
#[derive(Debug, Clone)]
pub struct Massless {
    /// What moves by itself: the robot as a whole, or each leg where a fixed trunk leaves them nothing to do with each
    /// other. A leg that is taken out then changes no bit of the others.
    flows: Vec<Flow>,
    /// The flows at the start of the present step, where one that fails may leave others ahead.
    before: Vec<SavedFlow>,
    now: SimTime,
    step: SimDuration,
    signals: Signals,
    window: Window,
}

/// Everything the way ahead depends on.
#[derive(Serialize, Deserialize)]
struct Saved {
    now: SimTime,
    window: Window,
    flows: Vec<SavedFlow>,
}

impl Massless {
    /// Builds the plant with the trunk level and at rest, the pantographs closed, the drives at the start commands, and the
    /// lowest foot at height zero, or on the ground where that is higher; ground that is lower is fallen to. `wanted` says
    /// which of the output signals anybody needs.
    ///
    /// # Errors
    /// [`MasslessError`] where robot and options do not fit together.
    pub fn new(
        robot: &Robot,
        options: &Options,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Self, MasslessError> {
        let flows = islands(robot, options)?
            .iter()
            .map(|island| {
                let model = Model::new(robot, island)?;
                let (state, commands) = start(robot, &model, options)?;
                Flow::new(model, &state, commands)
                    .map_err(|error| MasslessError::Start(error.to_string()))
            })
            .collect::<Result<Vec<_>, _>>()?;
        let legs: Vec<&str> = flows
            .iter()
            .flat_map(|flow| &flow.model.legs)
            .map(|leg| leg.name.as_str())
            .collect();
        let signals = Signals::new(&legs, options.ground.is_some(), wanted);
        Ok(Self {
            before: Vec::with_capacity(flows.len()),
            flows,
            now: SimTime::ZERO,
            step: options.step,
            signals,
            window: Window::default(),
        })
    }

    /// Puts everything back to where the step began: other legs may be ahead.
    fn step_back(&mut self) {
        for (flow, before) in self.flows.iter_mut().zip(&self.before) {
            flow.restore(before)
                .expect("the plant has been there, so its legs have that pose");
        }
    }

    fn fault(&self, flow: &Flow, error: &FlowError) -> PlantFault {
        let part = match error {
            FlowError::NoPose(no_pose) => format!("leg/{}", flow.model.legs[no_pose.leg].name),
            FlowError::Unsolved(_) => "contact".to_owned(),
            FlowError::NotFinite | FlowError::NotConverged { .. } => "integrator".to_owned(),
        };
        PlantFault {
            time: self.now,
            part,
            energy: self.energy().stored(),
            why: error.to_string(),
        }
    }
}

/// What moves by itself: the robot, or each of its legs where the trunk is held.
fn islands(robot: &Robot, options: &Options) -> Result<Vec<Options>, MasslessError> {
    let chosen = chosen_legs(robot, &options.legs)?;
    if options.base != Base::Fixed || chosen.is_empty() {
        return Ok(vec![options.clone()]);
    }
    let alone = |name: &String| Options {
        legs: vec![name.clone()],
        ..options.clone()
    };
    Ok(chosen.iter().map(|mount| alone(&mount.name)).collect())
}

/// The commands of a leg at the start, and where its foot is then.
fn first_pose(
    name: &str,
    pantograph: &Pantograph,
    options: &Options,
) -> Result<(LegCommand, Planar), MasslessError> {
    let wrong = |why| MasslessError::Leg {
        leg: name.to_owned(),
        why,
    };
    let given = options
        .start
        .iter()
        .find(|(leg, _)| leg == name)
        .map(|(_, command)| *command);
    let upright = Planar::new(0.0, -START_SHARE * pantograph.length_max());
    let command = given
        .map_or_else(|| pantograph.inverse_closed(upright), Ok)
        .map_err(wrong)?;
    let foot = pantograph.foot_of(command).map_err(wrong)?;
    let first = command.hip + pantograph.hip_reference();
    let pose = pantograph
        .pose(libm::sin(first), libm::cos(first), foot)
        .map_err(wrong)?;
    let beyond = |stop: &Stop| -pantograph.gap(&pose, *stop, pose.cable);
    if let Some(stop) = Stop::ALL.into_iter().find(|stop| beyond(stop) > BEYOND) {
        let (leg, by) = (name.to_owned(), beyond(&stop));
        return Err(MasslessError::StartBeyondStop { leg, stop, by });
    }
    Ok((command, foot))
}

/// The state at the start, and the commands that keep the drives there.
fn start(
    robot: &Robot,
    model: &Model,
    options: &Options,
) -> Result<(State, Commands), MasslessError> {
    let mut state = State::zero();
    state.set_attitude([1.0, 0.0, 0.0, 0.0]);
    let mut commands = [[0.0; 2]; LEGS];
    let mut feet = Vec::new();
    for (i, leg) in model.legs.iter().enumerate() {
        let (command, foot) = first_pose(&leg.name, &leg.pantograph, options)?;
        commands[i] = [command.hip, command.knee];
        state.set_foot(i, foot);
        state.set_hip(i, command.hip + leg.pantograph.hip_reference());
        state.set_pulley(i, command.knee);
        feet.push(leg.foot_in_trunk(foot));
    }
    if options.base == Base::Fixed {
        // Where the trunk is held must not depend on which of the robot's legs are there.
        for mount in &robot.legs {
            let wrong = |why| MasslessError::Leg {
                leg: mount.name.clone(),
                why,
            };
            let pantograph = Pantograph::new(&mount.leg).map_err(wrong)?;
            let (_, foot) = first_pose(&mount.name, &pantograph, options)?;
            feet.push(Vector3::from(mount.hip) + Vector3::new(foot.x, 0.0, foot.y));
        }
    }
    state.set_position(
        Vector3::z()
            * feet
                .iter()
                .map(|foot| clearance(model, foot))
                .fold(0.0, f64::max),
    );
    Ok((state, commands))
}

/// How high the trunk has to be for a foot to be at height zero, or on the ground where that is higher.
fn clearance(model: &Model, foot: &Vector3<f64>) -> f64 {
    let ground = model.ground.as_ref().map_or(0.0, |ground| {
        let below = ground.below(&Vector3::new(foot.x, foot.y, 0.0));
        -below.gap / below.normal.z
    });
    ground.max(0.0) - foot.z
}

impl Plant for Massless {
    fn name(&self) -> &'static str {
        "massless"
    }

    fn ports(&self) -> Vec<Port> {
        self.signals.ports().to_vec()
    }

    fn first_inputs(&self, inputs: &mut [f64]) {
        let commands = self
            .flows
            .iter()
            .flat_map(|flow| flow.commands[..flow.model.legs.len()].iter().flatten());
        for (input, command) in inputs.iter_mut().zip(commands) {
            *input = *command;
        }
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        if let Some(i) = inputs.iter().position(|input| !input.is_finite()) {
            let inputs = self
                .signals
                .ports()
                .iter()
                .filter(|port| port.direction == Direction::Input);
            let part = inputs
                .map(|port| port.name.clone())
                .nth(i)
                .unwrap_or_default();
            let why = "the command is not a number".to_owned();
            return Err(PlantFault {
                time: self.now,
                part,
                energy: self.energy().stored(),
                why,
            });
        }
        let mut rest = inputs.iter();
        for flow in &mut self.flows {
            let legs = flow.model.legs.len();
            for (command, input) in flow.commands[..legs].iter_mut().flatten().zip(&mut rest) {
                *command = *input;
            }
        }
        while self.now < to {
            let next = to.min(self.now + self.step);
            let seconds = (next - self.now).as_secs_f64();
            if self.flows.len() > 1 {
                self.before.clear();
                self.before.extend(self.flows.iter().map(Flow::save));
            }
            for i in 0..self.flows.len() {
                if let Err(error) = self.flows[i].run(seconds) {
                    self.step_back();
                    return Err(self.fault(&self.flows[i], &error));
                }
            }
            self.now = next;
        }
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        let elapsed = self.now.as_secs_f64() - self.window.begun_s;
        self.signals
            .write(&self.flows, &self.window, elapsed, outputs);
    }

    fn begin_window(&mut self) {
        self.window.begun_s = self.now.as_secs_f64();
        let felt = self
            .flows
            .iter()
            .flat_map(|flow| &flow.impulses[..flow.model.legs.len()]);
        for (before, now) in self.window.impulses.iter_mut().zip(felt) {
            *before = *now;
        }
    }

    fn energy(&self) -> EnergyBooks {
        signals::energy(&self.flows)
    }

    fn work(&self) -> WorkCounts {
        let mut sum = WorkCounts::default();
        for flow in &self.flows {
            let part = flow.counts;
            sum.steps += part.steps;
            sum.evaluations += part.evaluations;
            sum.factorisations += part.factorisations;
            sum.events += part.events;
            sum.solver_iterations += part.solver_iterations;
            sum.fallbacks += part.fallbacks;
        }
        sum
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
            return Err(mismatch(format!(
                "{} parts that move by themselves",
                saved.flows.len()
            )));
        }
        for (flow, saved) in self.flows.iter_mut().zip(&saved.flows) {
            flow.restore(saved)
                .map_err(|no_pose| mismatch(no_pose.to_string()))?;
        }
        (self.now, self.window) = (saved.now, saved.window);
        Ok(())
    }
}

#[cfg(test)]
mod tests;
