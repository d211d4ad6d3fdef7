//! Viscous friction of the joints as a part of the inertia.
//!
//! Friction acts at the mean velocities of a step, v + ½h a, so its force is f = −D v − ½h D a. The
//! second term is moved to the side of the inertia, M + K with K = ½h D, which makes steps stable
//! at any friction. The K of a leg acts on the velocities of its foot relative to the trunk and of
//! its hip, **x** = (**u** − C **y**, θ̇); C **y** is the part of the trunk's velocity **y** that
//! carries the foot. Eliminating the legs leaves six equations of the trunk:
//!
//! ```text
//! L = (M + K)⁻¹    G = Kₓ C    T = M_t + Σ (Cᵀ Kₓₓ C − Gᵀ L G)
//! ẏ = T⁻¹ (F_t + Σ Gᵀ L F)    (u̇, θ̈) = L (F + G ẏ)
//! ```

use nalgebra::{Matrix2x6, Matrix3, Matrix3x6, Matrix6, Vector3, Vector6};
use twinrig_legged::{Base, LEGS};
use twinrig_robot::leg::{Gradient, Planar};

use crate::inertia::{inverse_of_symmetric, trunk_inertia};
use crate::model::{LegModel, Model};
use crate::motion::{Coupled, Motion};
use crate::rows::{LegKinematics, Row};
use crate::state::State;

/// Friction of one leg's joints over half a step.
#[derive(Debug, Clone, Copy)]
struct LegDamping {
    /// K, over x and z of the foot and the hip.
    matrix: Matrix3<f64>,
    /// C.
    carried: Matrix2x6<f64>,
    /// L; the hip has no mobility where a drive imposes its acceleration.
    mobility: Matrix3<f64>,
    /// G.
    coupling: Matrix3x6<f64>,
}

/// Friction of all joints, as a part of the inertia at the midpoint of a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Damping {
    legs: [LegDamping; LEGS],
    /// `M_t`, of the first iterate.
    inertia: Matrix6<f64>,
    /// T⁻¹; zero where the base holds the trunk.
    trunk: Matrix6<f64>,
    /// Factor from K and velocities to a force: 2/h \[1/s\].
    force_scale: f64,
}

impl LegDamping {
    fn new(model: &LegModel, leg: &LegKinematics, base: Base, seconds: f64) -> Self {
        let mut matrix = Matrix3::zeros();
        for (friction, rate) in leg.joint_gradients(model) {
            let by = Vector3::new(rate.foot.x, rate.foot.y, rate.hip);
            matrix += by * by.transpose() * (0.5 * seconds * friction);
        }
        let r = &leg.foot;
        let mut carried = Matrix2x6::new(
            1.0, 0.0, r.z, 0.0, 0.0, -r.y, //
            0.0, 1.0, -r.x, 0.0, r.y, 0.0,
        );
        for held in held(base) {
            carried.column_mut(held).fill(0.0);
        }
        Self {
            matrix,
            carried,
            mobility: Matrix3::zeros(),
            coupling: matrix.fixed_columns::<2>(0) * carried,
        }
    }

    /// Computes L for the given mobilities of foot and hip.
    fn factor(&mut self, foot: f64, hip: f64) {
        let k = &self.matrix;
        self.mobility = if hip > 0.0 {
            let inertia = Vector3::new(1.0 / foot, 1.0 / foot, 1.0 / hip);
            inverse_of_symmetric(&(k + Matrix3::from_diagonal(&inertia)))
        } else {
            let (a, b, d) = (k[(0, 0)] + 1.0 / foot, k[(0, 1)], k[(1, 1)] + 1.0 / foot);
            let scale = 1.0 / (a * d - b * b);
            let (a, b, d) = (scale * a, scale * b, scale * d);
            Matrix3::new(d, -b, 0.0, -b, a, 0.0, 0.0, 0.0, 0.0)
        };
    }

    /// Velocities or accelerations of the foot relative to the trunk, and of the hip.
    fn relative(&self, trunk: &Vector6<f64>, foot: Planar, hip: f64) -> Vector3<f64> {
        let relative = foot - self.carried * trunk;
        Vector3::new(relative.x, relative.y, hip)
    }
}

impl Damping {
    /// Assembles the friction at the midpoint of a step of `seconds`.
    pub(crate) fn new(model: &Model, legs: &[LegKinematics], seconds: f64) -> Self {
        let none = LegDamping {
            matrix: Matrix3::zeros(),
            carried: Matrix2x6::zeros(),
            mobility: Matrix3::zeros(),
            coupling: Matrix3x6::zeros(),
        };
        let mut damping = Self {
            legs: [none; LEGS],
            inertia: trunk_inertia(model, legs),
            trunk: Matrix6::zeros(),
            force_scale: 2.0 / seconds,
        };
        let each = damping.legs.iter_mut().zip(&model.legs).zip(legs);
        for ((damping, model_of_leg), leg) in each {
            *damping = LegDamping::new(model_of_leg, leg, model.base, seconds);
        }
        damping
    }

    /// Reassembles the friction at another midpoint of the same step; the inertia stays that of the
    /// first.
    pub(crate) fn reassembled(&self, model: &Model, legs: &[LegKinematics], seconds: f64) -> Self {
        Self {
            inertia: self.inertia,
            ..Self::new(model, legs, seconds)
        }
    }

    /// Factors T for the mobilities of feet and drives; `None` if it is not positive definite.
    pub(crate) fn factor(
        &mut self,
        model: &Model,
        feet: &[f64; LEGS],
        drives: &[[f64; 2]; LEGS],
    ) -> Option<()> {
        let mut trunk = self.inertia;
        for (i, leg) in self.legs.iter_mut().enumerate().take(model.legs.len()) {
            leg.factor(feet[i], drives[i][0]);
            let on_foot = leg.matrix.fixed_view::<2, 2>(0, 0);
            trunk += leg.carried.transpose() * on_foot * leg.carried
                - leg.coupling.transpose() * leg.mobility * leg.coupling;
        }
        let mut inverse = trunk.cholesky()?.inverse();
        for held in held(model.base) {
            inverse[(held, held)] = 0.0;
        }
        self.trunk = inverse;
        Some(())
    }

    /// Friction of a leg's joints at the velocities of a state.
    pub(crate) fn friction_at(&self, state: &State, leg: usize) -> Gradient {
        let (v, w) = (state.velocity(), state.rate());
        let trunk = Vector6::new(v.x, v.z, w.y, v.y, w.x, w.z);
        let of = &self.legs[leg];
        let x = of.relative(&trunk, state.foot_velocity(leg), state.hip_rate(leg));
        gradient(&(of.matrix * x * -self.force_scale))
    }

    /// Change of that friction due to accelerations, mean over the step.
    pub(crate) fn friction_by(&self, motion: &Motion, leg: usize) -> Gradient {
        gradient(&-self.resistance(&motion.trunk(), motion, leg))
    }

    /// K **ẋ** of a leg.
    fn resistance(&self, trunk: &Vector6<f64>, motion: &Motion, leg: usize) -> Vector3<f64> {
        let of = &self.legs[leg];
        of.matrix * of.relative(trunk, motion.foot[leg], motion.drive[leg][0])
    }

    /// Converts accelerations a₀ without K to accelerations a with it: (M + K) a = M a₀.
    pub(crate) fn apply_damping(&self, motion: &mut Motion, legs: usize) {
        let before = motion.trunk();
        let mut on_legs = [Vector3::zeros(); LEGS];
        let mut on_trunk = Vector6::zeros();
        for (i, on_leg) in on_legs.iter_mut().enumerate().take(legs) {
            *on_leg = -self.resistance(&before, motion, i);
            on_trunk -= self.legs[i].carried.transpose() * on_leg.fixed_rows::<2>(0);
        }
        motion.add(&self.coupled(&on_trunk, &on_legs));
    }

    /// Accelerations due to a unit force along a row.
    pub(crate) fn response(&self, row: &Row) -> Coupled {
        let (s, l) = (&row.sagittal, &row.lateral);
        let mut on_legs = [Vector3::zeros(); LEGS];
        on_legs[row.leg] = Vector3::new(row.foot.x, row.foot.y, row.hip);
        self.coupled(&Vector6::new(s.x, s.y, s.z, l.x, l.y, l.z), &on_legs)
    }

    fn coupled(&self, on_trunk: &Vector6<f64>, on_legs: &[Vector3<f64>; LEGS]) -> Coupled {
        let mut force = *on_trunk;
        for (leg, on_leg) in self.legs.iter().zip(on_legs) {
            force += leg.coupling.transpose() * (leg.mobility * on_leg);
        }
        let trunk = self.trunk * force;
        let of_leg =
            |i: usize| self.legs[i].mobility * (on_legs[i] + self.legs[i].coupling * trunk);
        Coupled {
            trunk,
            legs: std::array::from_fn(of_leg),
        }
    }
}

/// Indices of the trunk's velocities that the base holds.
fn held(base: Base) -> core::ops::Range<usize> {
    match base {
        Base::Free => 6..6,
        Base::Planar => 3..6,
        Base::Fixed => 0..6,
    }
}

fn gradient(force: &Vector3<f64>) -> Gradient {
    Gradient {
        hip: force.z,
        foot: Planar::new(force.x, force.y),
    }
}

#[cfg(test)]
mod tests;
