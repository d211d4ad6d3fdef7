//! Midpoint of a step: its state, and the accelerations there without constraints.

use libm::sincos;
use nalgebra::{Matrix3, Vector3};
use twinrig_contact::Surface;
use twinrig_legged::{ExternalLoad, LEGS};
use twinrig_robot::leg::{Gradient, LegError, Planar, Pose};

use crate::mobility::Mobility;
use crate::model::{GRAVITY, LegModel, Model};
use crate::motion::Motion;
use crate::pushed::Pushed;
use crate::rows::LegKinematics;
use crate::state::State;

/// Error: a leg has no pose.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{why}")]
pub(crate) struct NoPose {
    pub(crate) leg: usize,
    pub(crate) why: LegError,
}

/// Configuration at one instant: the arguments of spring forces and gaps.
#[derive(Debug, Clone)]
pub(crate) struct Placement {
    pub(crate) rotation: Matrix3<f64>,
    pub(crate) poses: Vec<Pose>,
    pub(crate) surfaces: [Surface; LEGS],
    /// Spring energy of each leg \[J\].
    pub(crate) springs: [f64; LEGS],
}

impl Placement {
    pub(crate) fn new() -> Self {
        let no_surface = Surface {
            gap: f64::INFINITY,
            normal: Vector3::z(),
        };
        Self {
            rotation: Matrix3::identity(),
            poses: Vec::with_capacity(LEGS),
            surfaces: [no_surface; LEGS],
            springs: [0.0; LEGS],
        }
    }

    pub(crate) fn place(&mut self, model: &Model, state: &State) -> Result<(), NoPose> {
        self.rotation = state.rotation();
        self.poses.clear();
        for (i, leg) in model.legs.iter().enumerate() {
            let foot = state.foot(i);
            let (sine, cosine) = sincos(state.hip(i));
            let no_pose = |why| NoPose { leg: i, why };
            let pose = leg.pantograph.pose(sine, cosine, foot).map_err(no_pose)?;
            self.springs[i] = match &leg.table {
                None => leg.pantograph.spring_energy(&pose),
                Some(table) => table.look_up(sine, cosine, foot).map_err(no_pose)?.0,
            };
            if let Some(ground) = &model.ground {
                self.surfaces[i] =
                    ground.below(&(state.position() + self.rotation * leg.foot_in_trunk(foot)));
            }
            self.poses.push(pose);
        }
        Ok(())
    }
}

impl LegModel {
    /// Foot from the centre of mass, trunk frame, for a foot in the hip frame \[m\].
    pub(crate) fn foot_in_trunk(&self, foot: Planar) -> Vector3<f64> {
        self.hip + Vector3::new(foot.x, 0.0, foot.y)
    }
}

/// Advances the positions of `from` by `seconds` at the velocities of `mean`. Foot velocities
/// relative to the trunk are taken at the foot positions of `mean`, so that a spring's work equals
/// its loss of energy.
pub(crate) fn advance_positions(model: &Model, from: &State, mean: &State, seconds: f64) -> State {
    let mut to = *mean;
    let (velocity, rate) = (mean.velocity(), mean.rate());
    to.set_attitude(from.attitude());
    to.turn(&rate, 0.5 * seconds);
    let rotation = to.rotation();
    to.turn(&rate, 0.5 * seconds);
    to.set_position(from.position() + rotation * velocity * seconds);
    for (i, leg) in model.legs.iter().enumerate() {
        let carried = velocity + rate.cross(&leg.foot_in_trunk(mean.foot(i)));
        let foot_velocity = mean.foot_velocity(i);
        to.set_foot(
            i,
            from.foot(i)
                + Planar::new(foot_velocity.x - carried.x, foot_velocity.y - carried.z) * seconds,
        );
        to.set_hip(i, from.hip(i) + mean.hip_rate(i) * seconds);
        to.set_pulley(i, from.pulley(i) + mean.pulley_rate(i) * seconds);
    }
    to
}

/// Kinematics and forces of the legs at the midpoint of a step.
#[derive(Debug, Clone)]
pub(crate) struct Midpoint {
    pub(crate) state: State,
    pub(crate) rotation: Matrix3<f64>,
    pub(crate) legs: Vec<LegKinematics>,
    /// Mean load of pushes over the step, if any.
    pub(crate) load: Option<ExternalLoad>,
}

impl Midpoint {
    pub(crate) fn new() -> Self {
        Self {
            state: State::zero(),
            rotation: Matrix3::identity(),
            legs: Vec::with_capacity(LEGS),
            load: None,
        }
    }

    /// Returns the forces of pushes, trunk axes.
    pub(crate) fn pushed(&self, model: &Model) -> Option<Pushed> {
        let load = self.load.as_ref()?;
        Some(Pushed::new(load, &self.rotation, &model.centre))
    }

    /// Computes the midpoint between `before` and an iterate of the end.
    pub(crate) fn place(
        &mut self,
        model: &Model,
        before: &State,
        after: &State,
        seconds: f64,
    ) -> Result<(), NoPose> {
        let mut mean = *before;
        // Foot positions at the midpoint of the iterate; the first iterate is the start itself.
        for i in 0..model.legs.len() {
            mean.set_foot(i, (before.foot(i) + after.foot(i)) * 0.5);
        }
        mean.set_mean_velocities(before, after, model.legs.len());
        self.state = advance_positions(model, before, &mean, 0.5 * seconds);
        self.rotation = self.state.rotation();
        self.legs.clear();
        for (i, leg) in model.legs.iter().enumerate() {
            let kinematics =
                LegKinematics::new(leg, &self.state, i).map_err(|why| NoPose { leg: i, why })?;
            self.legs.push(kinematics);
        }
        Ok(())
    }

    /// Corrects the springs' gradients so that their work over the step is exactly the energy they
    /// release (Gonzalez' discrete gradient) plus the energy defect of earlier steps.
    /// `stiffness_max` limits the stiffness of the force that compensates the defect \[N/m\].
    pub(crate) fn conserve(
        &mut self,
        model: &Model,
        before: &State,
        after: &State,
        released: &[f64; LEGS],
        energy_defect: &[f64; LEGS],
        stiffness_max: f64,
    ) {
        /// Motion below which the work of springs is negligible \[m\].
        const NEGLIGIBLE_MOTION: f64 = 1e-12;
        for (i, leg) in self.legs.iter_mut().enumerate() {
            let foot = after.foot(i) - before.foot(i);
            let hip = after.hip(i) - before.hip(i);
            // A radian of the hip counts as one leg length at the foot.
            let lever = model.legs[i].pantograph.length_max();
            let square = foot.norm_squared() + hip * hip * lever * lever;
            if square > NEGLIGIBLE_MOTION * NEGLIGIBLE_MOTION {
                let defect_max = stiffness_max * square;
                let work = released[i] + energy_defect[i].clamp(-defect_max, defect_max);
                let residual = -work - leg.spring.foot.dot(&foot) - leg.spring.hip * hip;
                let share = residual / square;
                leg.spring = leg.spring
                    + Gradient {
                        hip: share * lever * lever * hip,
                        foot: foot * share,
                    };
            }
        }
    }

    /// Sets the friction of the joints to that at the start of the step, where it is a part of the
    /// inertia.
    pub(crate) fn begin_friction(&mut self, before: &State, mobility: &Mobility) {
        let Some(damping) = &mobility.damping else {
            return;
        };
        for (i, leg) in self.legs.iter_mut().enumerate() {
            leg.friction = damping.friction_at(before, i);
        }
    }

    /// Adds the change of the friction due to the motion, which gives its mean over the step.
    pub(crate) fn end_friction(&mut self, motion: &Motion, mobility: &Mobility) {
        let Some(damping) = &mobility.damping else {
            return;
        };
        for (i, leg) in self.legs.iter_mut().enumerate() {
            leg.friction = leg.friction + damping.friction_by(motion, i);
        }
    }

    /// Accelerations of trunk and feet without constraints; those of the drives are set by
    /// `DriveStep`.
    pub(crate) fn free_motion(&self, model: &Model, mobility: &Mobility) -> Motion {
        let gravity = self.rotation.tr_mul(&Vector3::new(0.0, 0.0, -GRAVITY));
        let (velocity, rate) = (self.state.velocity(), self.state.rate());
        let mut force = (gravity - rate.cross(&velocity)) * model.mass;
        let mut torque = -rate.cross(&model.spin(&rate));
        let mut motion = Motion::zero();
        let pushed = self.pushed(model);
        if let Some(pushed) = &pushed {
            force += pushed.force;
            torque += pushed.torque;
        }
        for (i, leg) in self.legs.iter().enumerate() {
            let mass = model.legs[i].mass;
            let pull = leg.leg_force();
            let turning = rate.cross(&leg.absolute);
            let mut sideways = mass * (gravity.y - turning.y - leg.lateral_bias);
            if let Some(pushed) = &pushed {
                sideways += pushed.feet[i].y;
            }
            let on_trunk = Vector3::new(-pull.x, sideways, -pull.y);
            force += on_trunk;
            torque += leg.foot.cross(&on_trunk);
            motion.foot[i] =
                pull / mass + Planar::new(gravity.x - turning.x, gravity.z - turning.z);
            if let Some(pushed) = &pushed {
                let push = &pushed.feet[i];
                motion.foot[i] += Planar::new(push.x, push.z) / mass;
            }
        }
        (motion.sagittal, motion.lateral) = mobility.trunk(
            &Vector3::new(force.x, force.z, torque.y),
            &Vector3::new(force.y, torque.x, torque.z),
        );
        motion
    }
}
