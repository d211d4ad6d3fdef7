//! Rigid constraints as the dynamics of a plant.

use twinrig_kernel::{SimTime, signal};
use twinrig_legged::{DriveModels, Dynamics, Friction, PartFault, Posture, StepInputs, StepLoad};
use twinrig_robot::Robot;
use twinrig_runtime::{PlantEvent, PlantEventKind, PlantState, WorkCounts};

use super::flow::{Flow, Window};
use crate::formulation::{Formulation, SavedFormulation};
use crate::integrators::step_error::StepError;
use crate::model::Model;
use crate::model::real::Real;
use crate::model::start::start_state;
use crate::options::{LcpError, Options};

impl<const N: usize> Formulation for Flow<N> {}

/// Builds the flow in the start state.
pub(crate) fn initial_flow<const N: usize>(
    robot: &Robot,
    options: &Options,
) -> Result<Flow<N>, LcpError> {
    let model = Model::<N>::new(robot, &options.setup)?;
    let state = start_state(&model, robot, options)?;
    let mut flow = Flow::new(model, state, options.method, options.tolerance);
    if let Some(DriveModels::Servos(_)) = flow.model.drives {
        let commands = &mut flow.run.mode.commands;
        (commands.hip, commands.pulley) = (state.angles[0], state.pulley);
    }
    Ok(flow)
}

impl StepError {
    /// Returns the fault of the part that failed.
    fn fault<const N: usize>(&self, model: &Model<N>) -> PartFault {
        let part = match self {
            Self::SolveError(_) | Self::Jammed(_) => "contact".to_owned(),
            Self::ImpactGivesEnergy(impact) => signal::leg_path(&model.legs[impact.leg].name),
            _ => "integrator".to_owned(),
        };
        PartFault::new(part, self.to_string())
    }
}

impl<const N: usize> Dynamics for Flow<N> {
    type Saved = SavedFormulation;

    fn name(&self) -> &'static str {
        "lcp"
    }

    fn initial_inputs(&self, inputs: &mut [f64]) {
        if let Some(DriveModels::Motors(_)) = self.model.drives {
            inputs.fill(0.0);
            return;
        }
        for (leg, pair) in inputs.chunks_exact_mut(2).enumerate() {
            let reference = self.model.legs[leg].pantograph.hip_reference();
            pair[0] = self.run.mode.commands.hip.lane(leg) - reference;
            pair[1] = self.run.mode.commands.pulley.lane(leg);
        }
    }

    fn set_inputs(&mut self, inputs: &StepInputs<'_>) {
        let commands = &mut self.run.mode.commands;
        if let Some(DriveModels::Motors(motors)) = &self.model.drives {
            for (leg, input) in inputs.mean.chunks_exact(4).enumerate() {
                let hip = motors.hip.line(input[0], input[1]);
                let knee = motors.knee.line(input[2], input[3]);
                commands.hip = commands.hip.with_lane(leg, hip.torque);
                commands.hip_damping = commands.hip_damping.with_lane(leg, hip.damping);
                commands.pulley = commands.pulley.with_lane(leg, knee.torque);
                commands.pulley_damping = commands.pulley_damping.with_lane(leg, knee.damping);
            }
            return;
        }
        for (leg, pair) in inputs.mean.chunks_exact(2).enumerate() {
            let reference = self.model.legs[leg].pantograph.hip_reference();
            commands.hip = commands.hip.with_lane(leg, pair[0] + reference);
            commands.pulley = commands.pulley.with_lane(leg, pair[1]);
        }
    }

    fn set_friction(&mut self, friction: &Friction) {
        self.model.friction = friction.legs;
        // A foot that sticks may slide now.
        self.modes_pending = self.method.is_event_driven();
    }

    fn set_load(&mut self, load: &StepLoad) {
        self.run.set_load(load);
    }

    fn advance(&mut self, from: SimTime, seconds: f64) -> Result<(), PartFault> {
        self.run.now_s = from.as_secs_f64();
        let window = Window {
            before: self.run.impulse_sums,
            seconds,
        };
        let before = core::mem::replace(&mut self.window, window);
        let moved = self.step(seconds);
        if moved.is_err() {
            self.window = before;
        }
        moved.map_err(|error| error.fault(&self.model))
    }

    fn counts(&self) -> WorkCounts {
        self.run.counts
    }

    fn constraint_violation(&self) -> Option<f64> {
        Some(self.violation())
    }

    fn save(&self) -> SavedFormulation {
        SavedFormulation::Rigid(self.saved())
    }

    fn restore(&mut self, saved: SavedFormulation) -> Result<(), String> {
        match saved {
            SavedFormulation::Rigid(saved) => self.restore_saved(&saved),
            SavedFormulation::Compliant(_) => Err("compliant constraints".to_owned()),
        }
    }

    fn posture(&self) -> Posture {
        self.shared_posture()
    }

    fn extra_state(&self) -> Vec<(String, Vec<f64>)> {
        self.toes()
    }

    fn resume_from(
        &mut self,
        posture: &Posture,
        extra: &PlantState,
    ) -> Result<Vec<String>, PartFault> {
        let (next, lines) = self.resumed_from(posture, extra)?;
        *self = next;
        Ok(lines)
    }

    fn log_events(&mut self, enabled: bool) {
        self.run.log.enabled = enabled;
        self.run.log.events.clear();
    }

    fn drain_events(&mut self, to: &mut Vec<PlantEvent>) {
        let legs = &self.model.legs;
        to.extend(self.run.log.events.drain(..).map(|event| PlantEvent {
            at_s: event.at_s,
            part: signal::of_leg(&legs[event.leg].name, event.what),
            kind: if event.reached {
                PlantEventKind::Reached
            } else {
                PlantEventKind::Released
            },
        }));
    }
}
