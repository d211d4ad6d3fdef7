//! The compliant flow as the dynamics of a plant.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use twinrig_compliant::StepControl;
use twinrig_compliant::lanes::{Features, Quad};
use twinrig_contact::Surface;
use twinrig_kernel::{SimTime, signal};
use twinrig_legged::{
    DriveModels, Dynamics, FootMotion, LEGS, Ledger, LegPosture, PartFault, Posture, Readings,
    StepInputs,
};
use twinrig_robot::Robot;
use twinrig_runtime::{EnergyBalance, PlantEvent, PlantState, WorkCounts};

use super::flow::CompliantFlow;
use super::model::CompliantModel;
use super::state::{Flows, Slope, State};
use crate::articulated::{into_trunk, into_world, rotation};
use crate::model::Model;
use crate::options::{LcpError, Options};
use crate::plant::{Formulation, SavedFormulation, start_state};
use crate::readings;
use crate::real::Lanes;
use crate::state::State as RigidState;

/// Serialised state of the compliant formulation.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SavedCompliant {
    /// State, sums and commands, in the order of `CompliantFlow::visit`.
    numbers: Vec<Quad>,
    slope: Option<Vec<Quad>>,
    control: StepControl,
    ledger: Ledger,
    rotors_at_start: f64,
    step_seconds: f64,
}

/// Builds the compliant flow in the start state.
pub(crate) fn initial<const N: usize, const P: usize>(
    robot: &Robot,
    options: &Options,
) -> Result<CompliantFlow<N, P>, LcpError> {
    let model = Model::<N>::new(robot, &options.setup)?;
    let state = start_state(&model, robot, options)?;
    let mounts = options.setup.selected_mounts(robot)?;
    let mut compliances = Vec::new();
    for mount in mounts {
        let Some(compliance) = mount.leg.compliance else {
            let leg = mount.name.clone();
            return Err(LcpError::Compliance { leg });
        };
        compliances.push(compliance);
    }
    let compliant = CompliantModel::new(model, &compliances);
    let tolerance = options.tolerance;
    Ok(CompliantFlow::new(
        compliant,
        compliant_state(&state),
        tolerance,
        Features::Detected,
    ))
}

fn quad(lanes: Lanes) -> Quad {
    Quad(lanes.to_array())
}

fn four([x, y, z]: [f64; 3]) -> Quad {
    Quad([x, y, z, 0.0])
}

fn three(quad: Quad) -> [f64; 3] {
    let [x, y, z, _] = quad.0;
    [x, y, z]
}

/// Returns a state of the rigid model with relaxed soles.
pub(crate) fn compliant_state<const N: usize, const P: usize>(
    rigid: &RigidState<Lanes, N>,
) -> State<Quad, N, P> {
    State {
        position: four(rigid.position),
        attitude: Quad(rigid.attitude),
        velocity: four(rigid.velocity),
        turning: four(rigid.turning),
        angles: rigid.angles.map(quad),
        rates: rigid.rates.map(quad),
        pulley: quad(rigid.pulley),
        pulley_rate: quad(rigid.pulley_rate),
        bristles: [[Quad::splat(0.0); 2]; P],
    }
}

impl<const N: usize, const P: usize> CompliantFlow<N, P> {
    /// Returns the state in the form of the rigid model.
    fn rigid_state(&self) -> RigidState<Lanes, N> {
        let lanes = |quad: Quad| Lanes::new(quad.0);
        let state = &self.state;
        RigidState {
            position: three(state.position),
            attitude: state.attitude.0,
            velocity: three(state.velocity),
            turning: three(state.turning),
            angles: state.angles.map(lanes),
            rates: state.rates.map(lanes),
            pulley: lanes(state.pulley),
            pulley_rate: lanes(state.pulley_rate),
        }
    }

    /// Returns the mean of a force or torque over the last step.
    fn mean(&self, of: impl Fn(&Flows<Quad>) -> Quad, leg: usize) -> f64 {
        let [before, after] = [&self.sums_before, &self.sums].map(|sums| of(sums).0[leg]);
        if self.step_seconds > 0.0 {
            (after - before) / self.step_seconds
        } else {
            0.0
        }
    }

    /// Passes all numbers of state, sums and commands on, in a fixed order.
    fn visit(&mut self, mut to: impl FnMut(&mut Quad)) {
        let mut pass = |quad: Quad| {
            let mut quad = quad;
            to(&mut quad);
            quad
        };
        self.state = self.state.map(&mut pass);
        self.sums = self.sums.map(&mut pass);
        self.sums_before = self.sums_before.map(&mut pass);
        self.rates_before = self.rates_before.map(&mut pass);
        for pair in [
            &mut self.commands.hip,
            &mut self.commands.knee,
            &mut self.commands.damping,
        ] {
            *pair = pair.map(&mut pass);
        }
    }

    /// Returns each last link of a leg with a toe: its name in a state, its angle and its rate.
    fn toes(&self) -> Vec<(String, Vec<f64>)> {
        let toe = |(i, leg): (usize, &crate::model::LegModel<N>)| {
            let (angle, rate) = (self.state.angles[N - 1], self.state.rates[N - 1]);
            (
                signal::of_leg(&leg.name, "toe"),
                vec![angle.0[i], rate.0[i]],
            )
        };
        let legs = self.model.rigid.legs.iter().enumerate();
        legs.filter(|_| N > 3).map(toe).collect()
    }

    fn state_in(&self, posture: &Posture) -> State<Quad, N, P> {
        let mut state = self.state;
        let upright = rotation(posture.attitude);
        state.position = four(posture.position.into());
        state.attitude = Quad(posture.attitude);
        state.velocity = four(into_trunk(&upright, posture.velocity.into()));
        state.turning = four(posture.angular_velocity.into());
        let legs = self.model.rigid.legs.iter().zip(&posture.legs);
        for (i, (leg, (_, from))) in legs.enumerate() {
            for k in 0..N {
                let toe = if k > 2 { leg.constants.toe[1] } else { 0.0 };
                state.angles[k].0[i] = from.angles[k.min(2)] + toe;
                state.rates[k].0[i] = from.rates[k.min(2)];
            }
            state.pulley.0[i] = from.pulley;
            state.pulley_rate.0[i] = from.pulley_rate;
        }
        state.bristles = [[Quad::splat(0.0); 2]; P];
        state
    }
}

impl<const N: usize, const P: usize> Readings for CompliantFlow<N, P> {
    fn position(&self) -> Vector3<f64> {
        three(self.state.position).into()
    }

    fn attitude(&self) -> [f64; 4] {
        let attitude = self.state.attitude.0;
        let square: f64 = attitude.iter().map(|c| c * c).sum();
        let scale = 1.0 / libm::sqrt(square);
        attitude.map(|c| c * scale)
    }

    fn rotation(&self) -> Matrix3<f64> {
        let rows = rotation(self.state.attitude.0);
        Matrix3::from_fn(|i, j| rows[i][j])
    }

    fn velocity(&self) -> Vector3<f64> {
        let upright = rotation(self.state.attitude.0);
        into_world(&upright, three(self.state.velocity)).into()
    }

    fn angular_velocity(&self) -> Vector3<f64> {
        three(self.state.turning).into()
    }

    fn energy(&self) -> EnergyBalance {
        self.ledger.balance()
    }

    fn hip(&self, leg: usize) -> f64 {
        self.state.angles[0].0[leg] - self.model.rigid.legs[leg].pantograph.hip_reference()
    }

    fn hip_rate(&self, leg: usize) -> f64 {
        self.state.rates[0].0[leg]
    }

    fn hip_torque(&self, leg: usize) -> f64 {
        let [inertia, _] = self.model.drive_inertias();
        self.mean(|sums| sums.hip, leg)
            + inertia * self.mean_acceleration(self.state.rates[0], self.rates_before[0], leg)
    }

    fn pulley(&self, leg: usize) -> f64 {
        self.state.pulley.0[leg]
    }

    fn pulley_rate(&self, leg: usize) -> f64 {
        self.state.pulley_rate.0[leg]
    }

    fn knee_torque(&self, leg: usize) -> f64 {
        let [_, inertia] = self.model.drive_inertias();
        self.mean(|sums| sums.knee, leg)
            + inertia * self.mean_acceleration(self.state.pulley_rate, self.rates_before[1], leg)
    }

    fn cable_tension(&self, leg: usize) -> f64 {
        self.mean(|sums| sums.cable, leg)
    }

    fn angles(&self, leg: usize) -> [f64; 3] {
        std::array::from_fn(|i| self.state.angles[i].0[leg])
    }

    fn feet(&self) -> [FootMotion; LEGS] {
        readings::feet(&self.model.rigid, &self.rigid_state())
    }

    fn surfaces(&self, feet: &[FootMotion; LEGS]) -> [Surface; LEGS] {
        readings::surfaces(&self.model.rigid, &self.rigid_state(), feet)
    }

    fn ground_impulse(&self, leg: usize) -> [f64; 3] {
        self.sums.ground.map(|quad| quad.0[leg])
    }
}

impl<const N: usize, const P: usize> CompliantFlow<N, P> {
    fn mean_acceleration(&self, now: Quad, before: Quad, leg: usize) -> f64 {
        if self.step_seconds > 0.0 {
            (now.0[leg] - before.0[leg]) / self.step_seconds
        } else {
            0.0
        }
    }
}

impl<const N: usize, const P: usize> Formulation for CompliantFlow<N, P> {}

impl<const N: usize, const P: usize> Dynamics for CompliantFlow<N, P> {
    type Saved = SavedFormulation;

    fn name(&self) -> &'static str {
        "lcp"
    }

    fn initial_inputs(&self, inputs: &mut [f64]) {
        if let Some(DriveModels::Motors(_)) = self.model.rigid.drives {
            inputs.fill(0.0);
            return;
        }
        for (leg, pair) in inputs.chunks_exact_mut(2).enumerate() {
            (pair[0], pair[1]) = (self.hip(leg), self.pulley(leg));
        }
    }

    fn set_inputs(&mut self, inputs: &StepInputs<'_>) {
        let mut commands = self.commands;
        if let Some(DriveModels::Motors(motors)) = &self.model.rigid.drives {
            for (leg, input) in inputs.start.chunks_exact(4).enumerate() {
                let hip = motors.hip.line(input[0], input[1]);
                let knee = motors.knee.line(input[2], input[3]);
                (commands.hip[0].0[leg], commands.damping[0].0[leg]) = (hip.torque, hip.damping);
                (commands.knee[0].0[leg], commands.damping[1].0[leg]) = (knee.torque, knee.damping);
            }
        } else {
            let pairs = inputs.start.chunks_exact(2);
            for (leg, (start, rate)) in pairs.zip(inputs.rates.chunks_exact(2)).enumerate() {
                let reference = self.model.rigid.legs[leg].pantograph.hip_reference();
                (commands.hip[0].0[leg], commands.hip[1].0[leg]) = (start[0] + reference, rate[0]);
                (commands.knee[0].0[leg], commands.knee[1].0[leg]) = (start[1], rate[1]);
            }
        }
        self.command(commands);
    }

    fn advance(&mut self, _: SimTime, seconds: f64) -> Result<(), PartFault> {
        self.step(seconds)
            .map_err(|error| PartFault::new("integrator", error.to_string()))
    }

    fn counts(&self) -> WorkCounts {
        WorkCounts {
            steps: self.control.work.accepted,
            evaluations: self.control.work.evaluations,
            fallbacks: self.control.work.rejected,
            ..WorkCounts::default()
        }
    }

    fn constraint_violation(&self) -> Option<f64> {
        Some(self.greatest_depth())
    }

    fn save(&self) -> SavedFormulation {
        let mut numbers = Vec::new();
        let mut copy = self.clone();
        copy.visit(|quad| numbers.push(*quad));
        SavedFormulation::Compliant(SavedCompliant {
            numbers,
            slope: self.slope.map(|slope| {
                let mut numbers = Vec::new();
                slope.map(|quad| numbers.push(quad));
                numbers
            }),
            control: self.control,
            ledger: self.ledger,
            rotors_at_start: self.rotors_at_start,
            step_seconds: self.step_seconds,
        })
    }

    fn restore(&mut self, saved: SavedFormulation) -> Result<(), String> {
        let SavedFormulation::Compliant(saved) = saved else {
            return Err("rigid constraints".to_owned());
        };
        let mut expected = 0;
        self.clone().visit(|_| expected += 1);
        let found = saved.numbers.len();
        if found != expected {
            return Err(format!("{found} numbers, expected {expected}"));
        }
        let mut numbers = saved.numbers.iter().copied();
        self.visit(|quad| *quad = numbers.next().unwrap_or(*quad));
        self.control = saved.control;
        (self.ledger, self.rotors_at_start) = (saved.ledger, saved.rotors_at_start);
        self.step_seconds = saved.step_seconds;
        self.slope = match saved.slope {
            None => None,
            Some(numbers) => {
                let slope = Slope::of(self.state, self.sums);
                let mut expected = 0;
                slope.map(|_| expected += 1);
                let found = numbers.len();
                if found != expected {
                    return Err(format!("a slope of {found} numbers, expected {expected}"));
                }
                let mut numbers = numbers.into_iter();
                Some(slope.map(|quad| numbers.next().unwrap_or(quad)))
            }
        };
        Ok(())
    }

    fn posture(&self) -> Posture {
        let legs = self.model.rigid.legs.iter().enumerate();
        let legs = legs.map(|(i, leg)| {
            let of = |quads: &[Quad; N]| std::array::from_fn(|k| quads[k].0[i]);
            let posture = LegPosture {
                angles: of(&self.state.angles),
                rates: of(&self.state.rates),
                pulley: self.pulley(i),
                pulley_rate: self.pulley_rate(i),
            };
            (leg.name.clone(), posture)
        });
        Posture {
            position: self.position(),
            attitude: self.attitude(),
            velocity: self.velocity(),
            angular_velocity: self.angular_velocity(),
            legs: legs.collect(),
        }
    }

    fn extra_state(&self) -> Vec<(String, Vec<f64>)> {
        self.toes()
    }

    fn resume_from(
        &mut self,
        posture: &Posture,
        extra: &PlantState,
    ) -> Result<Vec<String>, PartFault> {
        let mut lines = Vec::new();
        let mut state = self.state_in(posture);
        for (i, (name, _)) in self.toes().iter().enumerate() {
            let values = extra.get(name).filter(|values| values.len() == 2);
            if let Some(values) = values.filter(|values| values.iter().all(|x| x.is_finite())) {
                state.angles[N - 1].0[i] = values[0];
                state.rates[N - 1].0[i] = values[1];
            } else {
                lines.push(format!(
                    "{name} is missing; the toe follows the third segment"
                ));
            }
        }
        let (tolerance, features) = (self.control.tolerance(), self.features);
        *self = Self::new(self.model.clone(), state, tolerance, features);
        Ok(lines)
    }

    fn drain_events(&mut self, _: &mut Vec<PlantEvent>) {}
}
