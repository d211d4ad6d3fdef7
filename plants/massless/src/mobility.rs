//! Inverse mass matrix. Only the feet's sideways inertia couples coordinates, so it is nearly
//! diagonal.

use nalgebra::{Matrix3, Matrix6, Vector3};
use twinrig_legged::{Base, LEGS};

use crate::damping::Damping;
use crate::inertia::{inverse_of_symmetric, lateral_inertia, trunk_inertia};
use crate::model::Model;
use crate::motion::{Coupled, Motion};
use crate::rows::{LegKinematics, Row};

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
            let factors = trunk_inertia(model, legs).cholesky();
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
}
