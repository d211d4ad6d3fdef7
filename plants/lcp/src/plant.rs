//! Flows as the dynamics of a plant.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use twinrig_compliant::SavedCompliant;
use twinrig_kernel::{SimTime, signal};
use twinrig_legged::{
    Constraints, DriveModels, Drives, Dynamics, FromRobot, LeggedPlant, PartFault, Posture, Setup,
    StepInputs,
};
use twinrig_robot::Robot;
use twinrig_runtime::{PlantEvent, PlantEventKind, PlantState, WorkCounts};

use crate::compliant;
use crate::flow::{Flow, FlowError};
use crate::model::Model;
use crate::options::{LcpError, Method, Options};
use crate::real::{Lanes, Real};
use crate::saved::SavedFlow;
use crate::state::State;

/// Plant in which every segment of the robot has inertia.
pub type Lcp = LeggedPlant<dyn Formulation>;

/// Equations of motion with any number of links per leg, and rigid or compliant constraints.
pub trait Formulation: Dynamics<Saved = SavedFormulation> {}

/// Serialised state of a formulation.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum SavedFormulation {
    /// Of rigid constraints.
    Rigid(SavedFlow),
    /// Of compliant constraints.
    Compliant(SavedCompliant),
}

impl<const N: usize> Formulation for Flow<N> {}

impl FromRobot for dyn Formulation {
    type Options = Options;
    type Error = LcpError;

    fn setup(options: &Options) -> &Setup {
        &options.setup
    }

    fn from_robot(robot: &Robot, options: &Options) -> Result<Box<Self>, LcpError> {
        if options.tolerance.is_nan() || options.tolerance <= 0.0 {
            return Err(LcpError::Tolerance(options.tolerance));
        }
        if options.constraints == Constraints::Compliant && options.method != Method::Rk4 {
            return Err(LcpError::CompliantMethod(options.method.name()));
        }
        let motors = matches!(options.setup.drives, Drives::Motors { .. });
        if motors && options.method == Method::Thesis {
            return Err(LcpError::Motors);
        }
        let selected_mounts = options.setup.selected_mounts(robot)?;
        let toes = options.toe && selected_mounts.iter().any(|mount| mount.leg.toe.is_some());
        if let Some(mount) = selected_mounts
            .iter()
            .find(|mount| toes && mount.leg.toe.is_none())
        {
            let leg = mount.name.clone();
            return Err(LcpError::Toe { leg });
        }
        Ok(match (options.constraints, toes) {
            (Constraints::Rigid, false) => Box::new(initial_flow::<3>(robot, options)?),
            (Constraints::Rigid, true) => Box::new(initial_flow::<4>(robot, options)?),
            (Constraints::Compliant, false) => {
                Box::new(compliant::initial::<3, 1>(robot, options)?)
            }
            (Constraints::Compliant, true) => Box::new(compliant::initial::<4, 2>(robot, options)?),
        })
    }
}

/// Builds the flow in the start state.
pub(crate) fn initial_flow<const N: usize>(
    robot: &Robot,
    options: &Options,
) -> Result<Flow<N>, LcpError> {
    let model = Model::<N>::new(robot, &options.setup)?;
    let state = start_state(&model, robot, options)?;
    let mut flow = Flow::new(model, state, options.method, options.tolerance);
    if let Some(DriveModels::Servos(_)) = flow.model.drives {
        let commands = &mut flow.mode.commands;
        (commands.hip, commands.pulley) = (state.angles[0], state.pulley);
    }
    Ok(flow)
}

/// Returns the start state: a taut cable, and toes without load.
pub(crate) fn start_state<const N: usize>(
    model: &Model<N>,
    robot: &Robot,
    options: &Options,
) -> Result<State<Lanes, N>, LcpError> {
    let setup = &options.setup;
    let zero = Lanes::zero();
    let mut state = State {
        position: [0.0, 0.0, height::<N>(robot, setup)?],
        attitude: [1.0, 0.0, 0.0, 0.0],
        velocity: [0.0; 3],
        turning: [0.0; 3],
        angles: [zero; N],
        rates: [zero; N],
        pulley: zero,
        pulley_rate: zero,
    };
    for (i, leg) in model.legs.iter().enumerate() {
        let start = setup.start.of_leg(&leg.name, &leg.pantograph)?;
        for k in 0..N {
            // An unloaded toe follows the third segment.
            let (angle, rate) = if k < 3 {
                (start.angles[k], start.rates[k])
            } else {
                (start.angles[2] + leg.constants.toe[1], start.rates[2])
            };
            state.angles[k] = state.angles[k].with_lane(i, angle);
            state.rates[k] = state.rates[k].with_lane(i, rate);
        }
        state.pulley = state.pulley.with_lane(i, start.command.knee);
    }
    Ok(state)
}

/// Returns the initial height of the trunk \[m\].
fn height<const N: usize>(robot: &Robot, setup: &Setup) -> Result<f64, LcpError> {
    let lowest = |mount: &twinrig_robot::LegMount, start: &twinrig_legged::LegStart| {
        let foot = Vector3::from(mount.hip) + Vector3::new(start.foot.x, 0.0, start.foot.y);
        let Some(toe) = mount.leg.toe.filter(|_| N > 3) else {
            return foot;
        };
        let angle = start.angles[2] + toe.rest;
        let tip = foot + Vector3::new(libm::sin(angle), 0.0, -libm::cos(angle)) * toe.length;
        if tip.z < foot.z { tip } else { foot }
    };
    Ok(setup.height(robot, lowest)?)
}

impl FlowError {
    /// Returns the fault of the part that failed.
    fn fault(&self) -> PartFault {
        let part = match self {
            Self::SolveError(_) | Self::Jammed(_) => "contact",
            _ => "integrator",
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
            pair[0] = self.mode.commands.hip.lane(leg) - reference;
            pair[1] = self.mode.commands.pulley.lane(leg);
        }
    }

    fn set_inputs(&mut self, inputs: &StepInputs<'_>) {
        let commands = &mut self.mode.commands;
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

    fn advance(&mut self, from: SimTime, seconds: f64) -> Result<(), PartFault> {
        self.now_s = from.as_secs_f64();
        let before = (self.impulse_sums_before, self.run_seconds);
        (self.impulse_sums_before, self.run_seconds) = (self.impulse_sums, seconds);
        let moved = self.step(seconds);
        if moved.is_err() {
            (self.impulse_sums_before, self.run_seconds) = before;
        }
        moved.map_err(|error| error.fault())
    }

    fn counts(&self) -> WorkCounts {
        self.counts
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
        self.logging = enabled;
        self.log.clear();
    }

    fn drain_events(&mut self, to: &mut Vec<PlantEvent>) {
        let legs = &self.model.legs;
        to.extend(self.log.drain(..).map(|event| PlantEvent {
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
