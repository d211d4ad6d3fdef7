//! Time stepping of the robot, with its energy balance.

use nalgebra::Vector3;
use twinrig_contact::Surface;
use twinrig_legged::{
    Base, DriveModels, LEGS, Ledger, NegativeDissipation, PartFault, Posture, Stored,
};
use twinrig_robot::{GRAVITY, Robot};

use crate::addresses::Addresses;
use crate::body_points::{self, BodyForces, POINTS, PointVelocities};
use crate::drives::{self, DriveStates, Limits, MotorParameters};
use crate::engine::{Engine, EngineError, EngineFault, STAGES};
use crate::frame::{LegFrame, TrunkFrame, set_coordinates};
use crate::inputs::Inputs;
use crate::leg_forces::{Constraints, LegForces, constraints, forces_on_legs};
use crate::mjcf::write_model;
use crate::model::{Area, Model};
use crate::options::{Integrator, MujocoError, Options};
use crate::powers::Powers;
use crate::push_load::PushLoad;
use crate::rates::{self, LegRates, mean};

/// Tolerance of a trunk's position outside the degrees of freedom of the base, on resuming from
/// another plant \[m, 1\].
const BASE_TOLERANCE: f64 = 1e-6;

/// Limits of the energy gain by friction in soft contacts, above which the step is too long: as a
/// share of the energy exchanged, and as the height by which it lifts the trunk \[m\].
const GAIN_SHARE: f64 = 0.05;
const GAIN_LIFT: f64 = 1e-3;

/// Maximum number of reductions of the clutches' limits in a step.
const SATURATION_ROUNDS_MAX: u32 = 4;

/// Maximum number of corrected contacts; feet touch the ground more than once at its edges. Further
/// contacts keep MuJoCo's forces.
pub(crate) const CONTACTS: usize = 4 * LEGS + 2 * POINTS;

/// Reason why a step failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum FlowFault {
    #[error(transparent)]
    Engine(#[from] EngineFault),
    #[error(
        "the foot has left the height field, which ends at {at:.3} m along {axis}; give the scenario a larger field"
    )]
    OutsideField { leg: usize, axis: char, at: f64 },
    #[error("{0}: take a shorter step")]
    Dissipation(#[from] NegativeDissipation),
}

/// The robot in motion: engine, kinematics, forces and energy balance.
pub struct Flow {
    pub(crate) model: Model,
    pub(crate) engine: Engine,
    pub(crate) at: Addresses,
    pub(crate) inputs: Inputs,
    pub(crate) trunk: TrunkFrame,
    pub(crate) legs: [Option<LegFrame>; LEGS],
    pub(crate) forces: [LegForces; LEGS],
    /// Forces of the ground on trunk and segments in the last step, and their impulses since the
    /// start \[N·s\].
    pub(crate) body_forces: BodyForces,
    pub(crate) body_impulses: BodyForces,
    /// Impulses of the ground since the start, world axes \[N·s\].
    pub(crate) impulses: [[f64; 3]; LEGS],
    pub(crate) ledger: Ledger,
    pub(crate) in_contact: [bool; LEGS],
    pub(crate) events: u64,
    pub(crate) fallbacks: u64,
    motor_parameters: MotorParameters,
    /// Velocities before a step.
    qvel: Vec<f64>,
    /// Velocities at the end of the step, predicted from the accelerations.
    pub(crate) qvel_next: Vec<f64>,
    /// First constraint row of each contact, and its changed margin.
    pub(crate) rows: [Option<(usize, f64)>; CONTACTS],
    pub(crate) push_load: PushLoad,
}

impl Flow {
    pub(crate) fn new(robot: &Robot, options: &Options) -> Result<Self, MujocoError> {
        let model = Model::new(robot, options)?;
        let text = write_model(robot, &model);
        let engine = Engine::compile(&text)?;
        Ok(Self::of(model, engine)?)
    }

    pub(crate) fn of(model: Model, engine: Engine) -> Result<Self, EngineError> {
        let at = Addresses::new(&model, engine.model())?;
        let trunk = TrunkFrame::new(&model, &at, engine.data().qpos(), engine.data().qvel());
        let mut flow = Self {
            inputs: Inputs::default(),
            trunk,
            legs: [None; LEGS],
            forces: [LegForces::default(); LEGS],
            body_forces: BodyForces::default(),
            body_impulses: BodyForces::default(),
            impulses: [[0.0; 3]; LEGS],
            ledger: Ledger::default(),
            in_contact: [false; LEGS],
            events: 0,
            fallbacks: 0,
            motor_parameters: MotorParameters::new(&engine, &at.legs),
            qvel: vec![0.0; engine.data().qvel().len()],
            qvel_next: vec![0.0; engine.data().qvel().len()],
            rows: [None; CONTACTS],
            push_load: PushLoad::default(),
            model,
            engine,
            at,
        };
        let start = flow.model.start.clone();
        flow.set_posture(&start, &[[0.0; 2]; LEGS]);
        Ok(flow)
    }

    /// Checks that a posture is within the degrees of freedom of the base.
    pub(crate) fn check_base(&self, posture: &Posture) -> Result<(), PartFault> {
        let [_, x, y, z] = posture.attitude;
        let deviation = match self.model.base {
            Base::Free => 0.0,
            Base::Planar => x.abs().max(z.abs()).max((posture.position.y).abs()),
            Base::Fixed => {
                let moved = (posture.position - self.model.start.position).abs().max();
                moved.max(x.abs()).max(y.abs()).max(z.abs())
            }
        };
        if deviation > BASE_TOLERANCE {
            let why = "the trunk of the other plant is outside this one's degrees of freedom: use the same base";
            return Err(PartFault::new("body", why));
        }
        Ok(())
    }

    /// Sets the posture, with angles and rates of abduction, and opens a new energy balance.
    pub(crate) fn set_posture(&mut self, posture: &Posture, abduction: &[[f64; 2]; LEGS]) {
        let data = self.engine.data_mut();
        data.reset();
        let (mut qpos, mut qvel) = (data.qpos().to_vec(), data.qvel().to_vec());
        set_coordinates(
            &self.model,
            &self.at,
            posture,
            abduction,
            &mut qpos,
            &mut qvel,
        );
        data.qpos_mut().copy_from_slice(&qpos);
        data.qvel_mut().copy_from_slice(&qvel);
        self.update_kinematics();
        self.forces = [LegForces::default(); LEGS];
        (self.body_forces, self.body_impulses) = Default::default();
        self.impulses = [[0.0; 3]; LEGS];
        self.in_contact = [false; LEGS];
        self.ledger = Ledger::opened(self.stored());
        self.inputs = Inputs::default();
        let servos = matches!(self.model.drives, Some(DriveModels::Servos(_)));
        let [.., servo_of_abduction] = self.model.servos;
        let drive_states = self.drive_states();
        for (inputs, [[hip, _], [pulley, _], [angle, _]]) in
            self.inputs.iter_mut().zip(drive_states)
        {
            if servos {
                inputs.drives[..2].copy_from_slice(&[hip, pulley]);
            }
            if servo_of_abduction.is_some() {
                inputs.abduction[0] = angle;
            }
        }
    }

    /// Updates the kinematics from the engine's state.
    pub(crate) fn update_kinematics(&mut self) {
        (self.trunk, self.legs) = self.kinematics();
    }

    /// Returns the kinematics of the engine's state.
    pub(crate) fn kinematics(&self) -> (TrunkFrame, [Option<LegFrame>; LEGS]) {
        let (qpos, qvel) = (self.engine.data().qpos(), self.engine.data().qvel());
        let trunk = TrunkFrame::new(&self.model, &self.at, qpos, qvel);
        let (mut frames, coordinates) = ([None; LEGS], self.model.coordinates);
        let legs = self.model.legs.iter().zip(&self.at.legs);
        for (frame, (leg, at)) in frames.iter_mut().zip(legs) {
            *frame = Some(LegFrame::new(leg, at, coordinates, qpos, qvel));
        }
        (trunk, frames)
    }

    /// Advances by a step.
    pub(crate) fn run(&mut self, seconds: f64) -> Result<(), FlowFault> {
        if self.model.step_only {
            self.step_alone(seconds);
            return Ok(());
        }
        self.check_area()?;
        self.qvel.copy_from_slice(self.engine.data().qvel());
        self.engine.set_timestep(seconds);
        self.push(seconds);
        let limits = self.drive(seconds)?;
        let completed = self.step(seconds);
        if limits {
            self.reset_limits();
        }
        completed?;
        self.close_step(seconds);
        let gain = GAIN_SHARE * self.ledger.balance().exchanged;
        let weight = GRAVITY * self.model.trunk_mass;
        // Soft constraints store energy, so that their account of impacts has no sign.
        let allowed = [gain + GAIN_LIFT * weight, f64::INFINITY];
        self.ledger.check_within(allowed)?;
        Ok(())
    }

    /// Sets the drives and computes the forces. Returns whether a clutch has a reduced limit.
    fn drive(&mut self, seconds: f64) -> Result<bool, FlowFault> {
        let drive_states = self.drive_states();
        if let Some(DriveModels::Motors(_)) = self.model.drives {
            drives::set_motors(
                &mut self.engine,
                &self.model,
                &self.at.legs,
                (&self.inputs, &drive_states),
                seconds,
                &mut self.motor_parameters,
            );
        }
        for (leg, at) in self.at.legs.iter().enumerate() {
            drives::set_flywheels(
                &mut self.engine,
                &self.model,
                at,
                &self.inputs[leg],
                &drive_states[leg],
                seconds,
            );
        }
        self.forward(seconds)?;
        self.saturate(&drive_states, seconds)
    }

    /// Lets clutches slip whose torque exceeds that of their servos.
    fn saturate(
        &mut self,
        drive_states: &[DriveStates; LEGS],
        seconds: f64,
    ) -> Result<bool, FlowFault> {
        let mut limits: Limits = drives::unsaturated_limits(&self.model);
        for round in 0..SATURATION_ROUNDS_MAX {
            let mut changed = false;
            for (leg, at) in self.at.legs.iter().enumerate() {
                let (states, limits) = (&drive_states[leg], &mut limits[leg]);
                changed |= drives::saturate(&self.engine, &self.model, at, states, limits);
            }
            if !changed {
                return Ok(round > 0);
            }
            self.fallbacks += 1;
            drives::set_limits(&mut self.engine, &self.at.legs, &limits);
            let found = self.forward(seconds);
            if found.is_err() {
                self.reset_limits();
            }
            found?;
        }
        Ok(true)
    }

    fn reset_limits(&mut self) {
        let limits = drives::unsaturated_limits(&self.model);
        drives::set_limits(&mut self.engine, &self.at.legs, &limits);
    }

    /// Integrates with the computed forces, and adds their work to the energy balance.
    fn step(&mut self, seconds: f64) -> Result<(), FlowFault> {
        self.forces = [LegForces::default(); LEGS];
        self.body_forces = BodyForces::default();
        if self.model.numerics.integrator == Integrator::Rk4 {
            return self.stages(seconds);
        }
        let before = self.rates();
        let points_before = self.point_velocities();
        let push_before = self.push_power();
        self.engine.integrate(seconds)?;
        self.update_kinematics();
        self.ledger.external += 0.5 * seconds * (push_before + self.push_power());
        let after = self.rates();
        let rates = mean(&before, &after);
        let mut points = self.point_velocities();
        for (point, before) in points
            .iter_mut()
            .flatten()
            .zip(points_before.iter().flatten())
        {
            *point = 0.5 * (*point + before);
        }
        let friction_rates = rates::friction_rates(&self.model, &before, &after);
        let now = self.engine.data().qvel();
        let mean_velocity = self
            .qvel
            .iter()
            .zip(now)
            .map(|(old, new)| 0.5 * (old + new));
        let constraints = constraints(&self.engine, &self.at, mean_velocity);
        let forces = forces_on_legs(&self.engine, &self.model, &self.at, &self.inputs, &rates);
        self.add_forces(
            1.0,
            seconds,
            &forces,
            [&rates, &friction_rates],
            &points,
            &constraints,
        );
        Ok(())
    }

    /// Integrates by the fourth-order method, with the forces of each stage.
    fn stages(&mut self, seconds: f64) -> Result<(), FlowFault> {
        let ledger = self.ledger;
        for stage in 0..STAGES {
            if stage > 0 {
                let found = self.engine.stage(stage, seconds).map_err(FlowFault::from);
                if let Err(fault) = found.and_then(|()| self.correct_sliding(seconds)) {
                    self.engine.restore_previous();
                    self.ledger = ledger;
                    self.update_kinematics();
                    return Err(fault);
                }
                self.update_kinematics();
            }
            let rates = self.rates();
            let velocity = self.engine.data().qvel().iter().copied();
            let constraints = constraints(&self.engine, &self.at, velocity);
            let forces = forces_on_legs(&self.engine, &self.model, &self.at, &self.inputs, &rates);
            let share = self.engine.weight(stage);
            self.ledger.external += share * seconds * self.push_power();
            let points = self.point_velocities();
            self.add_forces(
                share,
                seconds,
                &forces,
                [&rates, &rates],
                &points,
                &constraints,
            );
        }
        let completed = self.engine.finish_stages(seconds);
        if completed.is_err() {
            self.ledger = ledger;
        }
        self.update_kinematics();
        Ok(completed?)
    }

    /// Adds forces that act for a share of a step.
    fn add_forces(
        &mut self,
        share: f64,
        seconds: f64,
        forces: &[LegForces; LEGS],
        rates: [&[LegRates; LEGS]; 2],
        points: &PointVelocities,
        constraints: &Constraints,
    ) {
        for (mean, forces) in self.forces.iter_mut().zip(forces) {
            mean.add(share, forces);
        }
        let (body, of_body) = BodyForces::new(&self.engine, &self.at.body, points);
        self.body_forces.add(share, &body);
        let powers = Powers::new(&self.model, forces, rates, of_body, constraints);
        powers.add_work(share * seconds, &mut self.ledger);
    }

    fn point_velocities(&self) -> PointVelocities {
        body_points::velocities(&self.model, &self.at.body, &self.trunk, &self.legs)
    }

    fn rates(&self) -> [LegRates; LEGS] {
        rates::of_all(&self.model, &self.trunk, &self.legs)
    }

    /// Closes the energy balance of a step.
    fn close_step(&mut self, seconds: f64) {
        for leg in 0..self.model.legs.len() {
            let forces = &self.forces[leg];
            for axis in 0..3 {
                self.impulses[leg][axis] += (forces.normal[axis] + forces.along[axis]) * seconds;
            }
            let touches = forces.normal != [0.0; 3];
            self.events += u64::from(touches != self.in_contact[leg]);
            self.in_contact[leg] = touches;
        }
        self.body_impulses.add(seconds, &self.body_forces);
        let stored = self.stored();
        self.ledger.close_step(stored);
    }

    /// Returns angles and rates of the drives.
    fn drive_states(&self) -> [DriveStates; LEGS] {
        drive_states_of(&self.model, &self.legs)
    }

    /// Returns kinetic, spring and gravity energy \[J\].
    pub(crate) fn stored(&self) -> Stored {
        let inertias = self.model.drive_inertias();
        let [mut kinetic, mut gravity] = self.trunk.energies(&self.model);
        let mut spring = 0.0;
        for (leg, frame) in self.model.legs.iter().zip(self.legs.iter().flatten()) {
            let [leg_kinetic, leg_gravity] = frame.energies(leg, &self.trunk, inertias);
            kinetic += leg_kinetic;
            gravity += leg_gravity;
            spring += frame.spring_energy(leg);
        }
        [kinetic, spring, gravity]
    }

    /// Returns position and velocity of a foot, world axes.
    pub(crate) fn foot(&self, leg: usize) -> [Vector3<f64>; 2] {
        let (Some(frame), model) = (&self.legs[leg], &self.model.legs[leg]) else {
            return [Vector3::zeros(); 2];
        };
        let [place, speed] = frame.foot(model);
        [
            self.trunk.position + self.trunk.rotation * place,
            self.trunk.point_velocity(&place, &speed),
        ]
    }

    /// Returns the ground below a foot; without ground, a level one at infinite distance.
    pub(crate) fn below(&self, leg: usize) -> Surface {
        let [foot, _] = self.foot(leg);
        match &self.model.ground {
            Some(ground_model) => ground_model.ground.below(&foot),
            None => Surface {
                gap: f64::INFINITY,
                normal: Vector3::z(),
            },
        }
    }

    /// Refuses feet outside the height field, where there is no ground.
    fn check_area(&self) -> Result<(), FlowFault> {
        let Some(Area::Heights { from, to, .. }) = self.model.ground.as_ref().map(|g| &g.area)
        else {
            return Ok(());
        };
        for leg in 0..self.model.legs.len() {
            let [foot, _] = self.foot(leg);
            for (i, axis) in ['x', 'y'].into_iter().enumerate() {
                if foot[i] <= from[i] || foot[i] >= to[i] {
                    let at = if foot[i] <= from[i] { from[i] } else { to[i] };
                    return Err(FlowFault::OutsideField { leg, axis, at });
                }
            }
        }
        Ok(())
    }
}

fn drive_states_of(model: &Model, legs: &[Option<LegFrame>; LEGS]) -> [DriveStates; LEGS] {
    let mut drive_states = [DriveStates::default(); LEGS];
    let frames = model.legs.iter().zip(legs.iter().flatten());
    for (drive_states, (leg, frame)) in drive_states.iter_mut().zip(frames) {
        let hip = &frame.bars[0];
        let angle = hip.angle - leg.pantograph.hip_reference();
        *drive_states = [
            [angle, hip.rate],
            [frame.pulley, frame.pulley_rate],
            [frame.carrier.angle, frame.carrier.rate],
        ];
    }
    drive_states
}
