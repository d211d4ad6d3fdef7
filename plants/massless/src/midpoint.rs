//! The middle of a step: where the state is then, and what it would do without constraints.

use libm::sincos;
use nalgebra::{Matrix3, Vector3};
use twinrig_contact::Surface;
use twinrig_leg::{Gradient, LegError, Planar, Pose};
use twinrig_legged::LEGS;

use crate::mobility::{Mobility, Motion};
use crate::model::{GRAVITY, LegModel, Model};
use crate::rows::LegKinematics;
use crate::state::State;

/// A leg that has no pose.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{why}")]
pub(crate) struct NoPose {
    pub(crate) leg: usize,
    pub(crate) why: LegError,
}

/// Positions at one instant: what springs and gaps depend on.
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
        let nowhere = Surface {
            gap: f64::INFINITY,
            normal: Vector3::z(),
        };
        Self {
            rotation: Matrix3::identity(),
            poses: Vec::with_capacity(LEGS),
            surfaces: [nowhere; LEGS],
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
    /// Foot from the centre of mass, trunk frame, from the foot in the hip frame.
    pub(crate) fn foot_in_trunk(&self, foot: Planar) -> Vector3<f64> {
        self.hip + Vector3::new(foot.x, 0.0, foot.y)
    }
}

/// Moves the positions of `from` on by `seconds` at the velocities of `mean`. Feet move relative to the trunk as seen
/// from where `mean` has them, so that a spring's work is what its energy loses.
pub(crate) fn carried(model: &Model, from: &State, mean: &State, seconds: f64) -> State {
    let mut to = *mean;
    let (velocity, rate) = (mean.velocity(), mean.rate());
    to.set_attitude(from.attitude());
    to.turn(&rate, 0.5 * seconds);
    let rotation = to.rotation();
    to.turn(&rate, 0.5 * seconds);
    to.set_position(from.position() + rotation * velocity * seconds);
    for (i, leg) in model.legs.iter().enumerate() {
        let carried = velocity + rate.cross(&leg.foot_in_trunk(mean.foot(i)));
        let own = mean.foot_velocity(i);
        to.set_foot(
            i,
            from.foot(i) + Planar::new(own.x - carried.x, own.y - carried.z) * seconds,
        );
        to.set_hip(i, from.hip(i) + mean.hip_rate(i) * seconds);
        to.set_pulley(i, from.pulley(i) + mean.pulley_rate(i) * seconds);
    }
    to
}

/// Legs and forces at the middle of a step.
#[derive(Debug, Clone)]
pub(crate) struct Midpoint {
    pub(crate) state: State,
    pub(crate) rotation: Matrix3<f64>,
    pub(crate) legs: Vec<LegKinematics>,
}

impl Midpoint {
    pub(crate) fn new() -> Self {
        Self {
            state: State::zero(),
            rotation: Matrix3::identity(),
            legs: Vec::with_capacity(LEGS),
        }
    }

    /// Finds the middle between `before` and an estimate of the end.
    pub(crate) fn place(
        &mut self,
        model: &Model,
        before: &State,
        after: &State,
        seconds: f64,
    ) -> Result<(), NoPose> {
        let mut mean = *before;
        // The feet of the estimate's middle; the first estimate is the start itself.
        for i in 0..model.legs.len() {
            mean.set_foot(i, (before.foot(i) + after.foot(i)) * 0.5);
        }
        mean.take_mean_velocities(before, after, model.legs.len());
        self.state = carried(model, before, &mean, 0.5 * seconds);
        self.rotation = self.state.rotation();
        self.legs.clear();
        for (i, leg) in model.legs.iter().enumerate() {
            let kinematics =
                LegKinematics::new(leg, &self.state, i).map_err(|why| NoPose { leg: i, why })?;
            self.legs.push(kinematics);
        }
        Ok(())
    }

    /// Bends the springs' gradients so that their work over the step is exactly what their energy loses (Gonzalez'
    /// discrete gradient), and what is owed from the steps before. `stiffest`: how stiff the force that makes up for what is
    /// owed may be \[N/m\].
    pub(crate) fn conserve(
        &mut self,
        model: &Model,
        before: &State,
        after: &State,
        lost: &[f64; LEGS],
        owed: &[f64; LEGS],
        stiffest: f64,
    ) {
        /// Moves shorter than this \[m\] leave no work to speak of.
        const STILL: f64 = 1e-12;
        for (i, leg) in self.legs.iter_mut().enumerate() {
            let foot = after.foot(i) - before.foot(i);
            let hip = after.hip(i) - before.hip(i);
            // The hip's radians count as metres at the foot.
            let lever = model.legs[i].pantograph.length_max();
            let square = foot.norm_squared() + hip * hip * lever * lever;
            if square > STILL * STILL {
                let most = stiffest * square;
                let due = lost[i] + owed[i].clamp(-most, most);
                let missing = -due - leg.spring.foot.dot(&foot) - leg.spring.hip * hip;
                let share = missing / square;
                leg.spring = leg.spring
                    + Gradient {
                        hip: share * lever * lever * hip,
                        foot: foot * share,
                    };
            }
        }
    }

    /// Where the friction of the joints is a part of the inertia: takes its force at the start of the step.
    pub(crate) fn begin_friction(&mut self, before: &State, mobility: &Mobility) {
        let Some(damping) = &mobility.damping else {
            return;
        };
        for (i, leg) in self.legs.iter_mut().enumerate() {
            leg.friction = damping.friction_at(before, i);
        }
    }

    /// And adds what the motion does to it, which is the mean force then.
    pub(crate) fn end_friction(&mut self, motion: &Motion, mobility: &Mobility) {
        let Some(damping) = &mobility.damping else {
            return;
        };
        for (i, leg) in self.legs.iter_mut().enumerate() {
            leg.friction = leg.friction + damping.friction_by(motion, i);
        }
    }

    /// Accelerations of trunk and feet without constraints; the drives' are left to others.
    pub(crate) fn free_motion(&self, model: &Model, mobility: &Mobility) -> Motion {
        let gravity = self.rotation.tr_mul(&Vector3::new(0.0, 0.0, -GRAVITY));
        let (velocity, rate) = (self.state.velocity(), self.state.rate());
        let mut force = (gravity - rate.cross(&velocity)) * model.mass;
        let mut torque = -rate.cross(&rate.component_mul(&model.inertia));
        let mut motion = Motion::zero();
        for (i, leg) in self.legs.iter().enumerate() {
            let mass = model.legs[i].mass;
            let pull = leg.leg_force();
            let turning = rate.cross(&leg.absolute);
            let sideways = mass * (gravity.y - turning.y - leg.lateral_bias);
            let on_trunk = Vector3::new(-pull.x, sideways, -pull.y);
            force += on_trunk;
            torque += leg.foot.cross(&on_trunk);
            motion.foot[i] =
                pull / mass + Planar::new(gravity.x - turning.x, gravity.z - turning.z);
        }
        (motion.sagittal, motion.lateral) = mobility.trunk(
            &Vector3::new(force.x, force.z, torque.y),
            &Vector3::new(force.y, torque.x, torque.z),
        );
        motion
    }
}
