//! The plant of the rig: signals, steps, faults and snapshots.

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Direction, Port, SimDuration, SimTime, Snapshot, SnapshotError, signal};
use twinrig_legged::{DriveModels, Signals, Window};
use twinrig_robot::Robot;
use twinrig_runtime::interrupt::LongLoop;
use twinrig_runtime::{EnergyBalance, Plant, PlantFault, PlantState, WorkCounts};

use crate::assembly::Handles;
use crate::conversion::rotation;
use crate::divergence::Divergence;
use crate::options::{Options, RapierError};
use crate::robot::{Machine, State};
use crate::world::Sets;

/// A robot in Rapier.
pub struct Rapier {
    machine: Machine,
    now: SimTime,
    step: SimDuration,
    signals: Signals,
    window: Window,
}

/// Saved state.
#[derive(Serialize, Deserialize)]
struct Saved {
    now: SimTime,
    window: Window,
    state: State,
    handles: Handles,
    sets: Sets,
}

impl Rapier {
    /// Builds the plant with the trunk level and at rest, the legs at their start, and the lowest
    /// foot at height zero, or on the ground where that is higher; onto lower ground the robot
    /// falls. `selected` returns whether an output signal is required.
    ///
    /// # Errors
    /// [`RapierError`] if robot and options do not fit together.
    pub fn new(
        robot: &Robot,
        options: &Options,
        selected: &dyn Fn(&str) -> bool,
    ) -> Result<Self, RapierError> {
        let machine = Machine::new(robot, options)?;
        let legs = machine.model.legs.iter();
        let legs: Vec<&str> = legs.map(|leg| leg.name.as_str()).collect();
        Ok(Self {
            signals: Signals::new(&legs, machine.setup(), selected),
            now: SimTime::ZERO,
            step: options.setup.step,
            window: Window::default(),
            machine,
        })
    }

    fn fault(&self, part: &str, why: &str) -> PlantFault {
        PlantFault {
            time: self.now,
            part: part.to_owned(),
            energy: self.energy().stored(),
            why: why.to_owned(),
        }
    }

    fn input_count(&self) -> usize {
        let ports = self.signals.ports().iter();
        ports
            .filter(|port| port.direction == Direction::Input)
            .count()
    }

    fn apply_commands(&mut self, inputs: &[f64]) {
        let machine = &mut self.machine;
        let legs = machine.state.legs.iter_mut().zip(&machine.model.legs);
        match &machine.model.drives {
            None => {}
            Some(DriveModels::Servos(_)) => {
                for ((leg_state, leg), command) in legs.zip(inputs.chunks_exact(2)) {
                    leg_state.drives[0].command[0] = command[0] + leg.pantograph.hip_reference();
                    leg_state.drives[1].command[0] = command[1];
                }
            }
            Some(DriveModels::Motors(_)) => {
                for ((leg_state, _), command) in legs.zip(inputs.chunks_exact(4)) {
                    leg_state.drives[0].command = [command[0], command[1]];
                    leg_state.drives[1].command = [command[2], command[3]];
                }
            }
        }
    }

    /// Advances by one step of the plant, divided into substeps.
    fn run(&mut self, seconds: f64) -> Result<(), Divergence> {
        let substeps = self.machine.options.solver.substeps;
        let each = seconds / f64::from(substeps);
        (0..substeps).try_for_each(|_| self.machine.step(each))
    }
}

impl Plant for Rapier {
    fn name(&self) -> &'static str {
        "rapier"
    }

    fn ports(&self) -> Vec<Port> {
        self.signals.ports().to_vec()
    }

    fn initial_inputs(&self, inputs: &mut [f64]) {
        inputs.fill(0.0);
        if let Some(DriveModels::Servos(_)) = self.machine.model.drives {
            let legs = self.machine.state.legs.iter().zip(&self.machine.model.legs);
            for ((leg_state, leg), command) in legs.zip(inputs.chunks_exact_mut(2)) {
                command[0] = leg_state.drives[0].command[0] - leg.pantograph.hip_reference();
                command[1] = leg_state.drives[1].command[0];
            }
        }
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        self.signals
            .check_inputs(inputs, self.now, || self.energy().stored())?;
        self.apply_commands(&inputs[..self.input_count().min(inputs.len())]);
        let mut steps = LongLoop::default();
        while self.now < to {
            if steps.is_interrupted() {
                return Err(PlantFault::interrupted(self, self.now));
            }
            let next = to.min(self.now + self.step);
            let energy = self.energy().stored();
            if let Err(divergence) = self.run((next - self.now).as_secs_f64()) {
                return Err(PlantFault {
                    time: self.now,
                    part: divergence.part,
                    energy,
                    why: divergence.why,
                });
            }
            self.now = next;
        }
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        let now_s = self.now.as_secs_f64();
        self.signals
            .write(&self.machine, &self.window, now_s, outputs);
    }

    fn begin_window(&mut self) {
        let legs = self.machine.state.legs.iter();
        self.window
            .begin(self.now.as_secs_f64(), legs.map(|leg| &leg.ground));
    }

    fn energy(&self) -> EnergyBalance {
        self.machine.state.ledger.balance()
    }

    fn work(&self) -> WorkCounts {
        self.machine.state.counts
    }

    fn constraint_violation(&self) -> Option<f64> {
        Some(self.machine.constraint_violation())
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&Saved {
            now: self.now,
            window: self.window,
            state: self.machine.state.clone(),
            handles: self.machine.handles.clone(),
            sets: self.machine.world.sets.clone(),
        })
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let saved: Saved = snapshot.read()?;
        let legs = self.machine.state.legs.len();
        if saved.state.legs.len() != legs || saved.handles.legs.len() != legs {
            return Err(SnapshotError::Mismatch {
                expected: format!("rapier with {legs} legs"),
                found: format!("{} legs", saved.state.legs.len()),
            });
        }
        (self.now, self.window) = (saved.now, saved.window);
        self.machine.state = saved.state;
        self.machine.handles = saved.handles;
        self.machine.world.replace(saved.sets);
        Ok(())
    }

    fn state(&self) -> Option<PlantState> {
        Some(self.machine.posture().state(self.now))
    }

    fn resume_from(&mut self, from: &PlantState) -> Result<Vec<String>, PlantFault> {
        let mut posture = self.machine.posture();
        let missing = posture.resume_from(from);
        if rotation(posture.attitude).is_none() {
            return Err(self.fault(signal::BODY_ORIENTATION, "the quaternion has zero norm"));
        }
        if from
            .iter()
            .any(|(_, values)| values.iter().any(|x| !x.is_finite()))
        {
            return Err(self.fault("state", "it contains NaN or infinity"));
        }
        let (model, options) = (self.machine.model.clone(), self.machine.options.clone());
        self.machine = Machine::at(model, options, &posture);
        self.machine.hold_commands();
        self.now = from.time;
        self.window = Window::default();
        self.begin_window();
        Ok(missing)
    }
}
