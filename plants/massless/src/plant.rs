//! The plant as the rig sees it.

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_leg::{LegCommand, Pantograph, Planar};
use twinrig_robot::Robot;
use twinrig_runtime::{EnergyBooks, Plant, PlantFault, WorkCounts};

use crate::constraints::LegForces;
use crate::flow::{Commands, Flow, FlowError};
use crate::ledger::Ledger;
use crate::model::{Base, MasslessError, Model, Options};
use crate::signals::{Signals, Window};
use crate::state::{LEGS, State};

/// A start height, as a share of the greatest leg length, where none is given.
const START_SHARE: f64 = 0.9;

/// A robot whose legs have no mass but at the foot.
#[derive(Debug, Clone)]
pub struct Massless {
    flow: Flow,
    now: SimTime,
    step: SimDuration,
    signals: Signals,
    window: Window,
}

/// Everything the way ahead depends on.
#[derive(Serialize, Deserialize)]
struct Saved {
    now: SimTime,
    state: Vec<f64>,
    commands: Commands,
    forces: [LegForces; LEGS],
    torques: [[f64; 2]; LEGS],
    impulses: [[f64; 3]; LEGS],
    owed: [f64; LEGS],
    ledger: Ledger,
    counts: WorkCounts,
    window: Window,
}

impl Massless {
    /// Builds the plant with the trunk level and at rest, the pantographs closed, the drives at the start commands, and
    /// the lowest foot on the ground. `wanted` says which of the output signals anybody needs.
    ///
    /// # Errors
    /// [`MasslessError`] where robot and options do not fit together.
    pub fn new(
        robot: &Robot,
        options: &Options,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Self, MasslessError> {
        let model = Model::new(robot, options)?;
        let (state, commands) = start(robot, &model, options)?;
        let signals = Signals::new(&model, wanted);
        let flow = Flow::new(model, &state, commands)
            .map_err(|error| MasslessError::Legs(error.to_string()))?;
        Ok(Self {
            flow,
            now: SimTime::ZERO,
            step: options.step,
            signals,
            window: Window::default(),
        })
    }

    fn fault(&self, error: &FlowError) -> PlantFault {
        let part = match error {
            FlowError::NoPose(no_pose) => format!("leg/{}", self.flow.model.legs[no_pose.leg].name),
            FlowError::Unsolved(_) => "contact".to_owned(),
            FlowError::NotFinite => "integrator".to_owned(),
        };
        PlantFault {
            time: self.now,
            part,
            energy: self.flow.energy().stored(),
            why: error.to_string(),
        }
    }
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
    Ok((command, pantograph.foot_of(command).map_err(wrong)?))
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
    let mut height = 0.0_f64;
    for (i, leg) in model.legs.iter().enumerate() {
        let (command, foot) = first_pose(&leg.name, &leg.pantograph, options)?;
        commands[i] = [command.hip, command.knee];
        state.set_foot(i, foot);
        state.set_hip(i, command.hip + leg.pantograph.hip_reference());
        state.set_pulley(i, command.knee);
        height = height.max(-foot.y - leg.hip.z);
    }
    if options.base == Base::Fixed {
        // Where the trunk is held must not depend on which of the robot's legs are there.
        for mount in &robot.legs {
            let wrong = |why| MasslessError::Leg {
                leg: mount.name.clone(),
                why,
            };
            let pantograph = Pantograph::new(&mount.leg).map_err(wrong)?;
            height = height.max(-first_pose(&mount.name, &pantograph, options)?.1.y - mount.hip[2]);
        }
    }
    state.set_position(nalgebra::Vector3::new(0.0, 0.0, height));
    Ok((state, commands))
}

impl Plant for Massless {
    fn name(&self) -> &'static str {
        "massless"
    }

    fn ports(&self) -> Vec<Port> {
        self.signals.ports().to_vec()
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        for (command, input) in self.flow.commands.iter_mut().flatten().zip(inputs) {
            *command = *input;
        }
        while self.now < to {
            let next = to.min(self.now + self.step);
            self.flow
                .run((next - self.now).as_secs_f64())
                .map_err(|error| self.fault(&error))?;
            self.now = next;
        }
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        let elapsed = self.now.as_secs_f64() - self.window.begun_s;
        self.signals
            .write(&self.flow, &self.window, elapsed, outputs);
    }

    fn begin_window(&mut self) {
        self.window.begun_s = self.now.as_secs_f64();
        for leg in 0..self.flow.model.legs.len() {
            self.window.impulses[leg] = self.flow.impulses[leg];
        }
    }

    fn energy(&self) -> EnergyBooks {
        self.flow.energy()
    }

    fn work(&self) -> WorkCounts {
        self.flow.counts
    }

    fn save(&self) -> Snapshot {
        let Flow {
            state,
            commands,
            forces,
            torques,
            impulses,
            owed,
            ledger,
            counts,
            ..
        } = &self.flow;
        Snapshot::of(&Saved {
            now: self.now,
            state: state.numbers().to_vec(),
            commands: *commands,
            forces: *forces,
            torques: *torques,
            impulses: *impulses,
            owed: *owed,
            ledger: *ledger,
            counts: *counts,
            window: self.window,
        })
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let saved: Saved = snapshot.read()?;
        let mismatch = |found: String| SnapshotError::Mismatch {
            expected: "massless".to_owned(),
            found,
        };
        let state = State::from_numbers(&saved.state)
            .ok_or_else(|| mismatch(format!("{} numbers", saved.state.len())))?;
        let flow = &mut self.flow;
        flow.replace(&state)
            .map_err(|error| mismatch(error.to_string()))?;
        (flow.commands, flow.forces, flow.torques) = (saved.commands, saved.forces, saved.torques);
        (flow.impulses, flow.owed, flow.ledger) = (saved.impulses, saved.owed, saved.ledger);
        flow.resume(saved.counts);
        (self.now, self.window) = (saved.now, saved.window);
        Ok(())
    }
}
