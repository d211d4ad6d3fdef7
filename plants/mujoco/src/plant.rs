//! The robot in MuJoCo as the dynamics of a plant.

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimTime, signal};
use twinrig_legged::{
    Dynamics, Friction, FromRobot, LEGS, Ledger, LeggedPlant, PartFault, Posture, Setup,
    StepInputs, StepLoad, abduction_entry, adopt_abduction,
};
use twinrig_robot::Robot;
use twinrig_runtime::{PlantState, WorkCounts};

use crate::body_points::BodyForces;
use crate::flow::{Flow, FlowFault};
use crate::inputs::Inputs;
use crate::leg_forces::LegForces;
use crate::options::{MujocoError, Options};

/// A robot in MuJoCo.
pub type Mujoco = LeggedPlant<Flow>;

/// Serialised state.
#[derive(Serialize, Deserialize)]
pub struct SavedFlow {
    state: Vec<f64>,
    inputs: Inputs,
    forces: [LegForces; LEGS],
    body_forces: BodyForces,
    body_impulses: BodyForces,
    impulses: [[f64; 3]; LEGS],
    ledger: Ledger,
    in_contact: [bool; LEGS],
    events: u64,
    fallbacks: u64,
}

impl FromRobot for Flow {
    type Options = Options;
    type Error = MujocoError;

    fn setup(options: &Options) -> &Setup {
        &options.setup
    }

    fn from_robot(robot: &Robot, options: &Options) -> Result<Box<Self>, MujocoError> {
        Self::new(robot, options).map(Box::new)
    }
}

impl FlowFault {
    /// Returns the fault of the part that failed.
    fn of(&self, flow: &Flow) -> PartFault {
        let part = match self {
            Self::Engine(_) | Self::Dissipation(_) => "integrator".to_owned(),
            Self::OutsideField { leg, .. } => signal::leg_path(&flow.model.legs[*leg].name),
        };
        PartFault::new(part, self.to_string())
    }
}

impl Dynamics for Flow {
    type Saved = SavedFlow;

    fn name(&self) -> &'static str {
        "mujoco"
    }

    fn initial_inputs(&self, inputs: &mut [f64]) {
        let (each, legs) = (self.model.inputs, self.model.legs.len());
        let (of_drives, of_abduction) = inputs.split_at_mut(each * legs);
        for (leg, stored) in self.inputs.iter().enumerate().take(legs) {
            of_drives[leg * each..][..each].copy_from_slice(&stored.drives[..each]);
        }
        let each = self.model.abduction_inputs();
        for (inputs, stored) in of_abduction.chunks_exact_mut(each).zip(&self.inputs) {
            inputs.copy_from_slice(&stored.abduction[..each]);
        }
    }

    fn set_inputs(&mut self, inputs: &StepInputs<'_>) {
        let (each, legs) = (self.model.inputs, self.model.legs.len());
        let (of_drives, of_abduction) = inputs.mean.split_at(each * legs);
        for (leg, stored) in self.inputs.iter_mut().enumerate().take(legs) {
            stored.drives[..each].copy_from_slice(&of_drives[leg * each..][..each]);
        }
        let each = self.model.abduction_inputs();
        for (stored, inputs) in self.inputs.iter_mut().zip(of_abduction.chunks_exact(each)) {
            stored.abduction[..each].copy_from_slice(inputs);
        }
    }

    fn set_friction(&mut self, friction: &Friction) {
        let feet = self.at.legs.iter().map(|leg| leg.foot).zip(friction.legs);
        let feet = feet.filter_map(|(foot, friction)| Some((foot?, friction)));
        let body = self.at.body.iter().map(|point| {
            let leg = point.place.leg();
            let friction = leg.map_or(friction.trunk, |leg| friction.legs[leg]);
            (point.geom, friction)
        });
        let points: Vec<_> = feet.chain(body).collect();
        // For both copies of the model, of which the present one then has its other parameters.
        for _ in 0..2 {
            self.engine.set_parameters(|model| {
                let geoms = model.geom_friction_mut();
                for (geom, friction) in &points {
                    geoms[*geom][0] = *friction;
                }
            });
        }
    }

    fn set_load(&mut self, load: &StepLoad) {
        self.set_push_load(load);
    }

    fn advance(&mut self, _from: SimTime, seconds: f64) -> Result<(), PartFault> {
        self.run(seconds).map_err(|fault| fault.of(self))
    }

    fn counts(&self) -> WorkCounts {
        let [steps, evaluations, iterations] = self.engine.counts();
        WorkCounts {
            steps,
            evaluations,
            factorisations: evaluations,
            events: self.events,
            solver_iterations: iterations,
            fallbacks: self.fallbacks,
        }
    }

    fn update_readings(&mut self) {
        if self.model.step_only {
            self.read_engine();
        }
    }

    /// Pins, stops, cable length, ground penetration.
    fn constraint_violation(&self) -> Option<f64> {
        let mut worst = 0.0_f64;
        for (i, leg) in self.model.legs.iter().enumerate() {
            if let Some(frame) = &self.legs[i] {
                worst = worst.max(frame.constraint_violation(leg, self.model.drives.is_some()));
            }
            worst = worst.max(-self.below(i).gap);
        }
        if let Some(ground) = &self.model.ground {
            for point in &self.at.body {
                let [place, _] = point.place.motion(&self.model, &self.trunk, &self.legs);
                worst = worst.max(-ground.ground.below(&place).gap);
            }
        }
        Some(worst)
    }

    fn save(&self) -> SavedFlow {
        SavedFlow {
            state: self.engine.save(),
            inputs: self.inputs,
            forces: self.forces,
            body_forces: self.body_forces,
            body_impulses: self.body_impulses,
            impulses: self.impulses,
            ledger: self.ledger,
            in_contact: self.in_contact,
            events: self.events,
            fallbacks: self.fallbacks,
        }
    }

    fn restore(&mut self, saved: SavedFlow) -> Result<(), String> {
        let restored = self.engine.restore(&saved.state);
        restored.map_err(|why| why.to_string())?;
        self.inputs = saved.inputs;
        self.forces = saved.forces;
        self.body_forces = saved.body_forces;
        self.body_impulses = saved.body_impulses;
        self.impulses = saved.impulses;
        self.ledger = saved.ledger;
        self.in_contact = saved.in_contact;
        self.events = saved.events;
        self.fallbacks = saved.fallbacks;
        self.forget_pushes();
        self.update_kinematics();
        Ok(())
    }

    // Of the engine's state: steps of MuJoCo alone leave the kinematics behind it.
    fn posture(&self) -> Posture {
        let (trunk, frames) = self.kinematics();
        let legs = self.model.legs.iter().zip(frames.iter().flatten());
        Posture {
            position: trunk.position,
            attitude: trunk.attitude,
            velocity: trunk.velocity,
            angular_velocity: trunk.angular_velocity,
            legs: legs
                .map(|(leg, frame)| (leg.name.clone(), frame.posture()))
                .collect(),
        }
    }

    fn extra_state(&self) -> Vec<(String, Vec<f64>)> {
        let (_, frames) = self.kinematics();
        let legs = self.model.legs.iter().zip(frames.iter().flatten());
        legs.filter(|(leg, _)| leg.abduction.is_some())
            .map(|(leg, frame)| {
                let carrier = &frame.carrier;
                abduction_entry(&leg.name, [carrier.angle, carrier.rate])
            })
            .collect()
    }

    fn resume_from(
        &mut self,
        posture: &Posture,
        extra: &PlantState,
    ) -> Result<Vec<String>, PartFault> {
        self.check_base(posture)?;
        let (mut abduction, mut lines) = ([[0.0; 2]; LEGS], Vec::new());
        let legs = self.model.legs.iter().filter(|leg| leg.abduction.is_some());
        for (joint, leg) in abduction.iter_mut().zip(legs) {
            *joint = adopt_abduction(extra, &leg.name, &mut lines);
        }
        self.set_posture(posture, &abduction);
        Ok(lines)
    }
}
