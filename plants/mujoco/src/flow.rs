//! The motion: a step at a time, with its books.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use twinrig_contact::Surface;
use twinrig_legged::{Base, Fitted, LEGS, Ledger, NegativeDissipation, Posture, Stored};
use twinrig_robot::{GRAVITY, Robot};
use twinrig_runtime::WorkCounts;

use crate::addresses::Addresses;
use crate::drives::{self, Inputs, Limits, Tuned, Turned};
use crate::engine::{Engine, EngineError, EngineFault, STAGES};
use crate::frame::{LegFrame, TrunkFrame, place, spatial};
use crate::leg_forces::{LegForces, feel, held};
use crate::mjcf::written;
use crate::model::{Area, Model};
use crate::options::{Integrator, MujocoError, Options};
use crate::rates::{self, Held, LegRates, Powers, mean};
use crate::sliding::CONTACTS;

/// A trunk that another plant has so much farther out of this one's way than this cannot be taken over \[m, 1\].
const OFF: f64 = 1e-6;

/// What friction may give in soft contacts, beyond which the step is too long: this share of what was exchanged, and what lifts
/// the trunk by so much \[m\].
const SOFT: f64 = 0.05;
const SUNK: f64 = 1e-3;

/// Times that clutches are let go further in a step, at most.
const TIRED_MAX: u32 = 4;

/// Why a step could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum FlowFault {
    #[error(transparent)]
    Engine(#[from] EngineFault),
    #[error(
        "the foot has left the height field, which ends at {at:.3} m along {axis}; give the scenario a larger field"
    )]
    Beyond { leg: usize, axis: char, at: f64 },
    #[error("{0}: take a shorter step")]
    Dissipation(#[from] NegativeDissipation),
}

/// Everything that moves.
pub(crate) struct Flow {
    pub(crate) model: Model,
    pub(crate) engine: Engine,
    pub(crate) at: Addresses,
    pub(crate) inputs: Inputs,
    pub(crate) trunk: TrunkFrame,
    pub(crate) legs: [Option<LegFrame>; LEGS],
    pub(crate) forces: [LegForces; LEGS],
    /// Impulses of the ground since the start, world axes \[N·s\].
    pub(crate) impulses: [[f64; 3]; LEGS],
    pub(crate) ledger: Ledger,
    standing: [bool; LEGS],
    events: u64,
    fallbacks: u64,
    tuned: Tuned,
    /// Velocities before a step.
    qvel: Vec<f64>,
    /// Velocities that accelerations lead to.
    pub(crate) qvel_then: Vec<f64>,
    /// Of contacts: their first rows among the constraints, and margins for them.
    pub(crate) rows: [Option<(usize, f64)>; CONTACTS],
}

/// Everything that the way ahead depends on.
#[derive(Serialize, Deserialize)]
pub(crate) struct SavedFlow {
    state: Vec<f64>,
    inputs: Inputs,
    forces: [LegForces; LEGS],
    impulses: [[f64; 3]; LEGS],
    ledger: Ledger,
    standing: [bool; LEGS],
    events: u64,
    fallbacks: u64,
}

impl Flow {
    pub(crate) fn new(robot: &Robot, options: &Options) -> Result<Self, MujocoError> {
        let model = Model::new(robot, options)?;
        let text = written(robot, &model);
        let engine = Engine::compile(&text)?;
        Ok(Self::of(model, engine)?)
    }

    pub(crate) fn of(model: Model, engine: Engine) -> Result<Self, EngineError> {
        let at = Addresses::new(&model, engine.model())?;
        let trunk = TrunkFrame::new(&model, &at, engine.data().qpos(), engine.data().qvel());
        let mut flow = Self {
            inputs: [[0.0; 4]; LEGS],
            trunk,
            legs: [None; LEGS],
            forces: [LegForces::default(); LEGS],
            impulses: [[0.0; 3]; LEGS],
            ledger: Ledger::default(),
            standing: [false; LEGS],
            events: 0,
            fallbacks: 0,
            tuned: Tuned::new(&engine, &at.legs),
            qvel: vec![0.0; engine.data().qvel().len()],
            qvel_then: vec![0.0; engine.data().qvel().len()],
            rows: [None; CONTACTS],
            model,
            engine,
            at,
        };
        let start = flow.model.start.clone();
        flow.put(&start);
        Ok(flow)
    }

    /// Goes on from another's posture.
    pub(crate) fn resume_from(&mut self, posture: &Posture) -> Result<(), String> {
        let [w, x, y, z] = posture.attitude;
        let legs = posture.legs.iter().flat_map(|(_, leg)| {
            let turns = leg.angles.into_iter().chain(leg.rates);
            turns.chain([leg.pulley, leg.pulley_rate])
        });
        let trunk = [posture.position, posture.velocity, posture.angular_velocity];
        let trunk = trunk.iter().flat_map(|v| v.iter().copied());
        if !legs.chain(trunk).all(f64::is_finite) {
            return Err("a number of the other plant's state is none".to_owned());
        }
        let norm = w * w + x * x + y * y + z * z;
        if norm.is_nan() || (norm - 1.0).abs() >= 1e-6 {
            return Err("the attitude of the other plant's trunk is no unit quaternion".to_owned());
        }
        let off = match self.model.base {
            Base::Free => 0.0,
            Base::Planar => x.abs().max(z.abs()).max((posture.position.y).abs()),
            Base::Fixed => {
                let moved = (posture.position - self.model.start.position).abs().max();
                moved.max(x.abs()).max(y.abs()).max(z.abs())
            }
        };
        if off > OFF {
            let why =
                "the other plant's trunk is where this one's cannot go: give both the same base";
            return Err(why.to_owned());
        }
        self.put(posture);
        Ok(())
    }

    /// Goes on from a posture, with books opened anew.
    pub(crate) fn put(&mut self, posture: &Posture) {
        let data = self.engine.data_mut();
        data.reset();
        let (mut qpos, mut qvel) = (data.qpos().to_vec(), data.qvel().to_vec());
        place(&self.model, &self.at, posture, &mut qpos, &mut qvel);
        data.qpos_mut().copy_from_slice(&qpos);
        data.qvel_mut().copy_from_slice(&qvel);
        self.look();
        self.forces = [LegForces::default(); LEGS];
        self.impulses = [[0.0; 3]; LEGS];
        self.standing = [false; LEGS];
        self.ledger = Ledger::opened(self.stored());
        self.inputs = [[0.0; 4]; LEGS];
        if let Some(Fitted::Servos(_)) = self.model.drives {
            let turned = self.turned();
            for (inputs, [[hip, _], [pulley, _]]) in self.inputs.iter_mut().zip(turned) {
                inputs[..2].copy_from_slice(&[hip, pulley]);
            }
        }
    }

    pub(crate) fn posture(&self) -> Posture {
        let legs = self.model.legs.iter().zip(self.legs.iter().flatten());
        Posture {
            position: self.trunk.position,
            attitude: self.trunk.attitude,
            velocity: self.trunk.velocity,
            angular_velocity: self.trunk.angular_velocity,
            legs: legs
                .map(|(leg, frame)| (leg.name.clone(), frame.posture()))
                .collect(),
        }
    }

    /// Reads where everything is.
    fn look(&mut self) {
        let (qpos, qvel) = (self.engine.data().qpos(), self.engine.data().qvel());
        self.trunk = TrunkFrame::new(&self.model, &self.at, qpos, qvel);
        let legs = self.model.legs.iter().zip(&self.at.legs);
        for (frame, (leg, at)) in self.legs.iter_mut().zip(legs) {
            *frame = Some(LegFrame::new(leg, at, self.model.coordinates, qpos, qvel));
        }
    }

    /// Moves on.
    pub(crate) fn run(&mut self, seconds: f64) -> Result<(), FlowFault> {
        self.check_area()?;
        self.qvel.copy_from_slice(self.engine.data().qvel());
        self.engine.set_timestep(seconds);
        let limits = self.drive(seconds)?;
        let done = self.step(seconds);
        if limits {
            self.unlimit();
        }
        done?;
        self.close(seconds);
        let soft = SOFT * self.ledger.balance().exchanged;
        let weight = GRAVITY * self.model.trunk_mass;
        self.ledger.check_within(soft + SUNK * weight)?;
        Ok(())
    }

    /// Sets drives, and finds the forces under them; says whether a clutch has another limit now.
    fn drive(&mut self, seconds: f64) -> Result<bool, FlowFault> {
        let turned = self.turned();
        match self.model.drives {
            None => self.forward(seconds)?,
            Some(Fitted::Motors(motors)) => {
                drives::power(
                    &mut self.engine,
                    &self.model,
                    &self.at.legs,
                    (&motors, &self.inputs, &turned),
                    seconds,
                    &mut self.tuned,
                );
                self.forward(seconds)?;
            }
            Some(Fitted::Servos(servos)) => {
                for (leg, at) in self.at.legs.iter().enumerate() {
                    if let Some(flywheels) = &at.flywheels {
                        let commands = &self.inputs[leg];
                        let turned = &turned[leg];
                        drives::spin(
                            &mut self.engine,
                            flywheels,
                            &servos,
                            commands,
                            turned,
                            seconds,
                        );
                    }
                }
                self.forward(seconds)?;
                return self.saturate(&servos, &turned, seconds);
            }
        }
        Ok(false)
    }

    /// Lets clutches slip that transmit more than their servos have.
    fn saturate(
        &mut self,
        servos: &twinrig_legged::Servos,
        turned: &[Turned; LEGS],
        seconds: f64,
    ) -> Result<bool, FlowFault> {
        let mut limits: Limits = drives::unsaturated(servos);
        for round in 0..TIRED_MAX {
            let mut news = false;
            for (leg, at) in self.at.legs.iter().enumerate() {
                let Some(flywheels) = &at.flywheels else {
                    continue;
                };
                let torques = drives::transmitted(&self.engine, flywheels);
                news |= drives::saturate(servos, &torques, &turned[leg], &mut limits[leg]);
            }
            if !news {
                return Ok(round > 0);
            }
            self.fallbacks += 1;
            drives::limit(&mut self.engine, &self.at.legs, &limits);
            let found = self.forward(seconds);
            if found.is_err() {
                self.unlimit();
            }
            found?;
        }
        Ok(true)
    }

    fn unlimit(&mut self) {
        if let Some(Fitted::Servos(servos)) = &self.model.drives {
            drives::limit(
                &mut self.engine,
                &self.at.legs,
                &drives::unsaturated(servos),
            );
        }
    }

    /// Moves on with the forces that were found, and enters their work.
    fn step(&mut self, seconds: f64) -> Result<(), FlowFault> {
        self.forces = [LegForces::default(); LEGS];
        if self.model.numerics.integrator == Integrator::Rk4 {
            return self.stages(seconds);
        }
        let before = self.rates();
        self.engine.integrate(seconds)?;
        self.look();
        let after = self.rates();
        let rates = mean(&before, &after);
        let rubbing = rates::rubbing(&self.model, &before, &after);
        let now = self.engine.data().qvel();
        let between = self
            .qvel
            .iter()
            .zip(now)
            .map(|(old, new)| 0.5 * (old + new));
        let held = held(&self.engine, &self.at, between);
        let forces = feel(&self.engine, &self.model, &self.at, &self.inputs, &rates);
        self.enter(1.0, seconds, &forces, [&rates, &rubbing], &held);
        Ok(())
    }

    /// The same by the method of fourth order, whose stages each have forces of their own.
    fn stages(&mut self, seconds: f64) -> Result<(), FlowFault> {
        let ledger = self.ledger;
        for stage in 0..STAGES {
            if stage > 0 {
                let found = self.engine.stage(stage, seconds).map_err(FlowFault::from);
                if let Err(fault) = found.and_then(|()| self.slide(seconds)) {
                    self.engine.step_back();
                    self.ledger = ledger;
                    self.look();
                    return Err(fault);
                }
                self.look();
            }
            let rates = self.rates();
            let own = self.engine.data().qvel().iter().copied();
            let held = held(&self.engine, &self.at, own);
            let forces = feel(&self.engine, &self.model, &self.at, &self.inputs, &rates);
            let share = self.engine.weight(stage);
            self.enter(share, seconds, &forces, [&rates, &rates], &held);
        }
        let done = self.engine.finish_stages(seconds);
        if done.is_err() {
            self.ledger = ledger;
        }
        self.look();
        Ok(done?)
    }

    /// Enters forces that act for a share of a step.
    fn enter(
        &mut self,
        share: f64,
        seconds: f64,
        forces: &[LegForces; LEGS],
        rates: [&[LegRates; LEGS]; 2],
        held: &Held,
    ) {
        for (mean, forces) in self.forces.iter_mut().zip(forces) {
            mean.add(share, forces);
        }
        let powers = Powers::new(&self.model, forces, rates, held);
        powers.enter(share * seconds, &mut self.ledger);
    }

    fn rates(&self) -> [LegRates; LEGS] {
        rates::of_all(&self.model, &self.trunk, &self.legs)
    }

    /// Closes the books of a step.
    fn close(&mut self, seconds: f64) {
        for leg in 0..self.model.legs.len() {
            let forces = &self.forces[leg];
            for axis in 0..3 {
                self.impulses[leg][axis] += (forces.normal[axis] + forces.along[axis]) * seconds;
            }
            let stands = forces.normal != [0.0; 3];
            self.events += u64::from(stands != self.standing[leg]);
            self.standing[leg] = stands;
        }
        let stored = self.stored();
        self.ledger.close_step(stored);
    }

    /// Angle and rate of all that drives turn.
    fn turned(&self) -> [Turned; LEGS] {
        turned_of(&self.model, &self.legs)
    }

    /// Kinetic, spring and gravity energy \[J\].
    fn stored(&self) -> Stored {
        let inertias = self
            .model
            .drives
            .as_ref()
            .map_or([0.0; 2], Fitted::inertias);
        let [mut kinetic, mut gravity] = self.trunk.moving(&self.model);
        let mut spring = 0.0;
        for (leg, frame) in self.model.legs.iter().zip(self.legs.iter().flatten()) {
            let [moving, height] = frame.moving(leg, &self.trunk, inertias);
            kinetic += moving;
            gravity += height;
            spring += frame.spring_energy(leg);
        }
        [kinetic, spring, gravity]
    }

    /// The foot of a leg and its velocity, world axes.
    pub(crate) fn foot(&self, leg: usize) -> [Vector3<f64>; 2] {
        let (Some(frame), own) = (&self.legs[leg], &self.model.legs[leg]) else {
            return [Vector3::zeros(); 2];
        };
        let [foot, speed] = frame.foot(own);
        let place = spatial(foot, own.hip[1]);
        [
            self.trunk.position + self.trunk.rotation * place,
            self.trunk.carried(&place, &spatial(speed, 0.0)),
        ]
    }

    /// The ground below a foot; where there is none, level and out of reach.
    pub(crate) fn below(&self, leg: usize) -> Surface {
        let [foot, _] = self.foot(leg);
        match &self.model.ground {
            Some(relief) => relief.ground.below(&foot),
            None => Surface {
                gap: f64::INFINITY,
                normal: Vector3::z(),
            },
        }
    }

    /// Beyond a field of heights there is nothing to stand on.
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
                    return Err(FlowFault::Beyond { leg, axis, at });
                }
            }
        }
        Ok(())
    }

    /// The worst of what is open that should be closed \[m\].
    pub(crate) fn constraint_violation(&self) -> f64 {
        let mut worst = 0.0_f64;
        for (i, leg) in self.model.legs.iter().enumerate() {
            if let Some(frame) = &self.legs[i] {
                worst = worst.max(frame.constraint_violation(leg, self.model.drives.is_some()));
            }
            worst = worst.max(-self.below(i).gap);
        }
        worst
    }

    pub(crate) fn counts(&self) -> WorkCounts {
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

    pub(crate) fn save(&self) -> SavedFlow {
        SavedFlow {
            state: self.engine.save(),
            inputs: self.inputs,
            forces: self.forces,
            impulses: self.impulses,
            ledger: self.ledger,
            standing: self.standing,
            events: self.events,
            fallbacks: self.fallbacks,
        }
    }

    pub(crate) fn restore(&mut self, saved: &SavedFlow) -> Result<(), EngineError> {
        self.engine.restore(&saved.state)?;
        self.inputs = saved.inputs;
        self.forces = saved.forces;
        self.impulses = saved.impulses;
        self.ledger = saved.ledger;
        self.standing = saved.standing;
        self.events = saved.events;
        self.fallbacks = saved.fallbacks;
        self.look();
        Ok(())
    }
}

fn turned_of(model: &Model, legs: &[Option<LegFrame>; LEGS]) -> [Turned; LEGS] {
    let mut turned = [[[0.0; 2]; 2]; LEGS];
    let frames = model.legs.iter().zip(legs.iter().flatten());
    for (turned, (leg, frame)) in turned.iter_mut().zip(frames) {
        let hip = &frame.bars[0];
        let angle = hip.angle - leg.pantograph.hip_reference();
        *turned = [[angle, hip.rate], [frame.pulley, frame.pulley_rate]];
    }
    turned
}
