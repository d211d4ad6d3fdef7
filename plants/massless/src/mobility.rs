//! Inverse mass matrix. Only the feet's sideways inertia couples coordinates, so it is nearly
//! diagonal.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};
use twinrig_leg::Planar;
use twinrig_legged::{Base, LEGS};

use crate::damping::{Coupled, Damping};
use crate::model::Model;
use crate::rows::{LegKinematics, Row};
use crate::state::State;

/// Rows of the rotations in the inertia of the trunk.
const PITCH: usize = 2;
const ROLL: usize = 4;
const YAW: usize = 5;

/// Inverse mass matrix: velocity changes per impulse along a row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mobility {
    sagittal: Vector3<f64>,
    lateral: Matrix3<f64>,
    /// Of the whole trunk, where products of inertia couple its coordinates.
    coupled: Option<Matrix6<f64>>,
    pub(crate) foot: [f64; LEGS],
    /// Of hip and pulley; zero where the drive imposes its acceleration.
    pub(crate) drive: [[f64; 2]; LEGS],
    /// Friction of the joints, where it is a part of the inertia.
    pub(crate) damping: Option<Damping>,
}

/// Accelerations, or changes of velocity, of all coordinates.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motion {
    pub(crate) sagittal: Vector3<f64>,
    pub(crate) lateral: Vector3<f64>,
    pub(crate) foot: [Planar; LEGS],
    pub(crate) drive: [[f64; 2]; LEGS],
}

/// Accelerations due to a unit force, kept from the assembly of the matrix to the solution.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Response {
    sagittal: Vector3<f64>,
    lateral: Vector3<f64>,
    /// Of foot and hip of all legs, where the friction of the joints is a part of the inertia.
    legs: [Vector3<f64>; LEGS],
}

impl Mobility {
    pub(crate) fn new(model: &Model, legs: &[LegKinematics]) -> Self {
        let mut foot = [0.0; LEGS];
        for (inverse, leg) in foot.iter_mut().zip(&model.legs) {
            *inverse = 1.0 / leg.mass;
        }
        let heave = 1.0 / model.mass;
        let sagittal = match model.base {
            Base::Fixed => Vector3::zeros(),
            Base::Free | Base::Planar => Vector3::new(heave, heave, 1.0 / model.inertia.y),
        };
        let is_coupled = model.base == Base::Free && model.tensor.is_some();
        let lateral = if model.base == Base::Free && !is_coupled {
            inverse_of_symmetric(&lateral_inertia(model, legs))
        } else {
            Matrix3::zeros()
        };
        // Without a factorisation the state is not a number, which the step reports.
        let coupled = is_coupled.then(|| {
            let factors = Self::trunk_inertia(model, legs).cholesky();
            factors.map_or(Matrix6::repeat(f64::NAN), |factors| factors.inverse())
        });
        Self {
            sagittal,
            lateral,
            coupled,
            foot,
            drive: [[0.0; 2]; LEGS],
            damping: None,
        }
    }

    /// Includes the friction of the joints in the inertia, at the midpoint of a step.
    pub(crate) fn damp(&mut self, model: &Model, legs: &[LegKinematics], seconds: f64) {
        self.damping = Some(match &self.damping {
            None => Damping::new(model, legs, seconds),
            Some(damping) => damping.reassembled(model, legs, seconds),
        });
    }

    /// Factors the inertia with the joint friction in it, for the present mobilities of the drives;
    /// `None` if it is not positive definite.
    pub(crate) fn factor(&mut self, model: &Model) -> Option<()> {
        let Some(damping) = &mut self.damping else {
            return Some(());
        };
        damping.factor(model, &self.foot, &self.drive)
    }

    /// Applies the friction of the joints to accelerations computed without it.
    pub(crate) fn apply_damping(&self, motion: &mut Motion, legs: usize) {
        if let Some(damping) = &self.damping {
            damping.apply_damping(motion, legs);
        }
    }

    /// Inertia of the trunk with the sideways inertia of the feet: x, z, pitch, y, roll, yaw.
    /// Coordinates that the base holds have an inertia of 1.
    pub(crate) fn trunk_inertia(model: &Model, legs: &[LegKinematics]) -> Matrix6<f64> {
        let mut inertia = Matrix6::identity();
        if model.base != Base::Fixed {
            let diagonal = [model.mass, model.mass, model.inertia.y];
            diagonal
                .into_iter()
                .enumerate()
                .for_each(|(i, entry)| inertia[(i, i)] = entry);
        }
        if model.base == Base::Free {
            let lateral = lateral_inertia(model, legs);
            inertia.fixed_view_mut::<3, 3>(3, 3).copy_from(&lateral);
            if let Some(tensor) = &model.tensor {
                for (row, column, product) in [
                    (PITCH, ROLL, tensor[(0, 1)]),
                    (PITCH, YAW, tensor[(1, 2)]),
                    (ROLL, YAW, tensor[(0, 2)]),
                ] {
                    inertia[(row, column)] += product;
                    inertia[(column, row)] += product;
                }
            }
        }
        inertia
    }

    /// Accelerations of the trunk due to forces on it.
    pub(crate) fn trunk(
        &self,
        sagittal: &Vector3<f64>,
        lateral: &Vector3<f64>,
    ) -> (Vector3<f64>, Vector3<f64>) {
        if let Some(coupled) = &self.coupled {
            let along = coupled.fixed_columns::<3>(0) * sagittal;
            let motion = along + coupled.fixed_columns::<3>(3) * lateral;
            return (
                motion.fixed_rows::<3>(0).into(),
                motion.fixed_rows::<3>(3).into(),
            );
        }
        (
            self.sagittal.component_mul(sagittal),
            self.lateral * lateral,
        )
    }

    /// Accelerations due to a unit force along a row.
    pub(crate) fn response(&self, row: &Row) -> Response {
        let Some(damping) = &self.damping else {
            let (sagittal, lateral) = self.trunk(&row.sagittal, &row.lateral);
            let legs = [Vector3::zeros(); LEGS];
            return Response {
                sagittal,
                lateral,
                legs,
            };
        };
        let Coupled { trunk, legs } = damping.response(row);
        Response {
            sagittal: trunk.fixed_rows::<3>(0).into(),
            lateral: trunk.fixed_rows::<3>(3).into(),
            legs,
        }
    }

    /// Entry of the Delassus matrix: acceleration along `row` due to a unit force along `force`,
    /// whose response is `response`.
    pub(crate) fn delassus_entry(&self, row: &Row, force: &Row, response: &Response) -> f64 {
        let trunk = row.sagittal.dot(&response.sagittal) + row.lateral.dot(&response.lateral);
        if self.damping.is_some() {
            let leg = &response.legs[row.leg];
            let on_leg = row.foot.x * leg.x + row.foot.y * leg.y + row.hip * leg.z;
            let pulley = if row.leg == force.leg {
                self.drive[row.leg][1] * row.pulley * force.pulley
            } else {
                0.0
            };
            return trunk + on_leg + pulley;
        }
        if row.leg != force.leg {
            return trunk;
        }
        let [hip, pulley] = self.drive[row.leg];
        trunk
            + self.foot[row.leg] * row.foot.dot(&force.foot)
            + hip * row.hip * force.hip
            + pulley * row.pulley * force.pulley
    }
}

impl Motion {
    pub(crate) const fn zero() -> Self {
        let still = Vector3::new(0.0, 0.0, 0.0);
        Self {
            sagittal: still,
            lateral: still,
            foot: [Planar::new(0.0, 0.0); LEGS],
            drive: [[0.0; 2]; LEGS],
        }
    }

    /// Accelerations of the trunk: x, z, pitch, y, roll, yaw.
    pub(crate) fn trunk(&self) -> Vector6<f64> {
        let (s, l) = (&self.sagittal, &self.lateral);
        Vector6::new(s.x, s.y, s.z, l.x, l.y, l.z)
    }

    /// Adds the accelerations of trunk and legs due to coupled forces.
    pub(crate) fn add(&mut self, coupled: &Coupled) {
        self.sagittal += coupled.trunk.fixed_rows::<3>(0);
        self.lateral += coupled.trunk.fixed_rows::<3>(3);
        self.add_to_legs(&coupled.legs, 1.0);
    }

    fn add_to_legs(&mut self, legs: &[Vector3<f64>; LEGS], magnitude: f64) {
        for ((foot, drive), leg) in self.foot.iter_mut().zip(&mut self.drive).zip(legs) {
            *foot += Planar::new(leg.x, leg.y) * magnitude;
            drive[0] += leg.z * magnitude;
        }
    }

    /// Component along a row.
    pub(crate) fn along(&self, row: &Row) -> f64 {
        let [hip, pulley] = self.drive[row.leg];
        self.sagittal.dot(&row.sagittal)
            + self.lateral.dot(&row.lateral)
            + self.foot[row.leg].dot(&row.foot)
            + hip * row.hip
            + pulley * row.pulley
    }

    /// Adds the accelerations due to a force along a row.
    pub(crate) fn add_force(
        &mut self,
        force: &Row,
        response: &Response,
        mobility: &Mobility,
        magnitude: f64,
    ) {
        self.sagittal += response.sagittal * magnitude;
        self.lateral += response.lateral * magnitude;
        if mobility.damping.is_some() {
            self.add_to_legs(&response.legs, magnitude);
            let pulley = mobility.drive[force.leg][1] * force.pulley;
            self.drive[force.leg][1] += pulley * magnitude;
            return;
        }
        self.foot[force.leg] += force.foot * (mobility.foot[force.leg] * magnitude);
        let drive = &mut self.drive[force.leg];
        drive[0] += mobility.drive[force.leg][0] * force.hip * magnitude;
        drive[1] += mobility.drive[force.leg][1] * force.pulley * magnitude;
    }

    /// Adds the velocity changes of `seconds` of this motion to a state.
    pub(crate) fn apply(&self, state: &mut State, seconds: f64, legs: usize) {
        let [x, z, pitch] = self.sagittal.into();
        let [y, roll, yaw] = self.lateral.into();
        state.set_velocity(state.velocity() + Vector3::new(x, y, z) * seconds);
        state.set_rate(state.rate() + Vector3::new(roll, pitch, yaw) * seconds);
        for leg in 0..legs {
            state.set_foot_velocity(leg, state.foot_velocity(leg) + self.foot[leg] * seconds);
            state.set_hip_rate(leg, state.hip_rate(leg) + self.drive[leg][0] * seconds);
            state.set_pulley_rate(leg, state.pulley_rate(leg) + self.drive[leg][1] * seconds);
        }
    }
}

/// Inertia of the trunk sideways, in roll and in yaw, with the feet, which move sideways with it.
fn lateral_inertia(model: &Model, legs: &[LegKinematics]) -> Matrix3<f64> {
    let mut inertia =
        Matrix3::from_diagonal(&Vector3::new(model.mass, model.inertia.x, model.inertia.z));
    for (leg, kinematics) in model.legs.iter().zip(legs) {
        let sideways = kinematics.sideways();
        inertia += sideways * sideways.transpose() * leg.mass;
    }
    inertia
}

/// Inverse by cofactors; the matrix is an inertia, hence its determinant is positive.
pub(crate) fn inverse_of_symmetric(m: &Matrix3<f64>) -> Matrix3<f64> {
    let (a, b, c) = (m[(0, 0)], m[(0, 1)], m[(0, 2)]);
    let (d, e, f) = (m[(1, 1)], m[(1, 2)], m[(2, 2)]);
    let (aa, bb, cc) = (d * f - e * e, c * e - b * f, b * e - c * d);
    let (dd, ee, ff) = (a * f - c * c, b * c - a * e, a * d - b * b);
    let scale = 1.0 / (a * aa + b * bb + c * cc);
    Matrix3::new(aa, bb, cc, bb, dd, ee, cc, ee, ff) * scale
}
