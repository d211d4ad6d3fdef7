//! Inertia of the trunk with the sideways inertia of the feet.

use nalgebra::{Matrix3, Matrix6, Vector3};
use twinrig_legged::Base;

use crate::model::Model;
use crate::rows::LegKinematics;

/// Rows of the rotations in the inertia of the trunk.
const PITCH: usize = 2;
const ROLL: usize = 4;
const YAW: usize = 5;

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

/// Inertia of the trunk sideways, in roll and in yaw, with the feet, which move sideways with it.
pub(crate) fn lateral_inertia(model: &Model, legs: &[LegKinematics]) -> Matrix3<f64> {
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
