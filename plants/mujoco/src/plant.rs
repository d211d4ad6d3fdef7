//! The plant of the rig: signals, steps, faults and snapshots.

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Direction, Port, SimDuration, SimTime, Snapshot, SnapshotError, signal};
use twinrig_legged::{Signals, Window};
use twinrig_robot::Robot;
use twinrig_runtime::interrupt::LongLoop;
use twinrig_runtime::{EnergyBalance, Plant, PlantFault, PlantState, WorkCounts};

use crate::flow::{Flow, FlowFault, SavedFlow};
use crate::options::{MujocoError, Options};

/// A robot in MuJoCo.
pub struct Mujoco {
    flow: Flow,
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
    flow: SavedFlow,
}

impl Mujoco {
    /// Builds the plant with the trunk level and at rest, the legs at their start, and the lowest
    /// foot at height zero, or on the ground where that is higher; onto lower ground the robot
    /// falls. `selected` returns whether an output signal is required.
    ///
    /// # Errors
    /// [`MujocoError`] if robot and options do not fit together, or MuJoCo refuses the model.
    pub fn new(
        robot: &Robot,
        options: &Options,
        selected: &dyn Fn(&str) -> bool,
    ) -> Result<Self, MujocoError> {
        let flow = Flow::new(robot, options)?;
        let names: Vec<&str> = flow
            .model
            .legs
            .iter()
            .map(|leg| leg.name.as_str())
            .collect();
        let signals = Signals::new(&names, &options.setup, selected);
        Ok(Self {
            now: SimTime::ZERO,
            step: options.setup.step,
            signals,
            window: Window::default(),
            flow,
        })
    }

    fn fault(&self, fault: &FlowFault) -> PlantFault {
        let part = match fault {
            FlowFault::Engine(_) | FlowFault::Dissipation(_) => "integrator".to_owned(),
            FlowFault::OutsideField { leg, .. } => {
                signal::leg_path(&self.flow.model.legs[*leg].name)
            }
        };
        PlantFault {
            time: self.now,
            part,
            energy: self.energy().stored(),
            why: fault.to_string(),
        }
    }

    /// Returns the number of inputs per leg.
    fn inputs_per_leg(&self) -> usize {
        let ports = self.signals.ports().iter();
        let inputs = ports
            .filter(|port| port.direction == Direction::Input)
            .count();
        inputs.checked_div(self.flow.model.legs.len()).unwrap_or(0)
    }
}

impl Plant for Mujoco {
    fn name(&self) -> &'static str {
        "mujoco"
    }

    fn ports(&self) -> Vec<Port> {
        self.signals.ports().to_vec()
    }

    fn initial_inputs(&self, inputs: &mut [f64]) {
        let each = self.inputs_per_leg();
        let stored = self.flow.inputs.iter().flat_map(|leg| &leg[..each]);
        for (input, stored) in inputs.iter_mut().zip(stored) {
            *input = *stored;
        }
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        self.signals
            .check_inputs(inputs, self.now, || self.energy().stored())?;
        let each = self.inputs_per_leg();
        if each > 0 {
            for (stored, inputs) in self.flow.inputs.iter_mut().zip(inputs.chunks_exact(each)) {
                stored[..each].copy_from_slice(inputs);
            }
        }
        let mut steps = LongLoop::default();
        while self.now < to {
            if steps.is_interrupted() {
                return Err(PlantFault::interrupted(self, self.now));
            }
            let next = to.min(self.now + self.step);
            let seconds = (next - self.now).as_secs_f64();
            if let Err(fault) = self.flow.run(seconds) {
                return Err(self.fault(&fault));
            }
            self.now = next;
        }
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        let now_s = self.now.as_secs_f64();
        self.signals.write(&self.flow, &self.window, now_s, outputs);
    }

    fn begin_window(&mut self) {
        let impulses = &self.flow.impulses[..self.flow.model.legs.len()];
        self.window.begin(self.now.as_secs_f64(), impulses);
    }

    fn energy(&self) -> EnergyBalance {
        self.flow.ledger.balance()
    }

    fn work(&self) -> WorkCounts {
        self.flow.counts()
    }

    fn constraint_violation(&self) -> Option<f64> {
        Some(self.flow.constraint_violation())
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&Saved {
            now: self.now,
            window: self.window,
            flow: self.flow.save(),
        })
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let saved: Saved = snapshot.read()?;
        let restored = self.flow.restore(&saved.flow);
        restored.map_err(|why| SnapshotError::Mismatch {
            expected: "mujoco".to_owned(),
            found: why.to_string(),
        })?;
        (self.now, self.window) = (saved.now, saved.window);
        Ok(())
    }

    fn state(&self) -> Option<PlantState> {
        Some(self.flow.posture().state(self.now))
    }

    fn resume_from(&mut self, from: &PlantState) -> Result<Vec<String>, PlantFault> {
        let mut posture = self.flow.posture();
        let missing = posture.resume_from(from);
        if let Err(why) = self.flow.resume_from(&posture) {
            return Err(PlantFault {
                time: self.now,
                part: "mujoco".to_owned(),
                energy: self.energy().stored(),
                why,
            });
        }
        self.now = from.time;
        self.window = Window::default();
        self.begin_window();
        Ok(missing)
    }
}
