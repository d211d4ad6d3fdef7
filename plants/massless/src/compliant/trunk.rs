//! Equations of the trunk, which carries the feet sideways.

use nalgebra::{Matrix3, Vector3};
use twinrig_legged::Base;

use crate::inertia::inverse_of_symmetric;
use crate::model::Model;

/// Constants of the trunk.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TrunkConstants {
    /// Mass \[kg\], and moments of inertia \[kg·m²\].
    pub(crate) mass: f64,
    pub(crate) inertia: [f64; 3],
    /// Reciprocals of the mass, of the mass with the feet, and of the moment of pitch.
    per_mass: f64,
    per_total: f64,
    per_pitch: f64,
    /// Products of inertia x y, x z and y z of the tensor, where payloads couple the rotations.
    pub(crate) products: Option<[f64; 3]>,
}

impl TrunkConstants {
    pub(crate) fn new(model: &Model, feet: f64) -> Self {
        let (mass, inertia): (f64, [f64; 3]) = (model.mass, model.inertia.into());
        let entries = [(0, 1), (0, 2), (1, 2)];
        let products = model.tensor.map(|tensor| entries.map(|at| tensor[at]));
        Self {
            products,
            mass,
            inertia,
            per_mass: 1.0 / mass,
            per_total: 1.0 / (mass + feet),
            per_pitch: 1.0 / inertia[1],
        }
    }

    /// Returns the tensor of inertia, row by row up to the diagonal.
    #[inline(always)]
    pub(crate) fn tensor(&self) -> [f64; 6] {
        let ([xx, yy, zz], [xy, xz, yz]) = (self.inertia, self.products.unwrap_or_default());
        [xx, xy, yy, xz, yz, zz]
    }

    /// Returns the angular momentum at this angular velocity.
    #[inline(always)]
    pub(crate) fn spin(&self, [wx, wy, wz]: [f64; 3]) -> [f64; 3] {
        let inertia = &self.inertia;
        let spin = [inertia[0] * wx, inertia[1] * wy, inertia[2] * wz];
        match self.products {
            None => spin,
            Some([xy, xz, yz]) => [
                spin[0] + xy * wy + xz * wz,
                spin[1] + xy * wx + yz * wz,
                spin[2] + xz * wx + yz * wy,
            ],
        }
    }
}

/// Sums over the legs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TrunkSums {
    /// m x and m z \[kg·m\], from the centre of mass of the trunk.
    pub(crate) moment: [f64; 2],
    /// m x², m x z and m z² \[kg·m²\].
    pub(crate) spread: [f64; 3],
    /// Force and torque on the trunk; lateral ones with an unaccelerated trunk.
    pub(crate) force: [f64; 6],
}

impl TrunkSums {
    /// Solves for the acceleration of the trunk, linear then angular.
    ///
    /// Forward, up and pitch are independent. The sideways inertia of the feet, m s sᵀ with s = (1,
    /// −z, x), couples y, roll and yaw, of which y is eliminated.
    #[inline(always)]
    pub(crate) fn solve(&self, base: Base, trunk: &TrunkConstants) -> [f64; 6] {
        if base == Base::Fixed {
            return [0.0; 6];
        }
        let [fx, fy, fz, roll, pitch, yaw] = self.force;
        let (x, z) = (fx * trunk.per_mass, fz * trunk.per_mass);
        let turn = pitch * trunk.per_pitch;
        if base == Base::Planar {
            return [x, 0.0, z, 0.0, turn, 0.0];
        }
        let ([mx, mz], [mxx, mxz, mzz]) = (self.moment, self.spread);
        let (per, inertia) = (trunk.per_total, &trunk.inertia);
        let (to_roll, to_yaw) = (-mz * per, mx * per);
        let rr = inertia[0] + mzz + to_roll * mz;
        let ry = -mxz - to_roll * mx;
        let yy = inertia[2] + mxx - to_yaw * mx;
        let roll = roll - to_roll * fy;
        let yaw = yaw - to_yaw * fy;
        let (along_roll, turn, along_yaw) = match trunk.products {
            None => {
                let per_determinant = 1.0 / (rr * yy - ry * ry);
                let along_roll = (yy * roll - ry * yaw) * per_determinant;
                let along_yaw = (rr * yaw - ry * roll) * per_determinant;
                (along_roll, turn, along_yaw)
            }
            Some([xy, xz, yz]) => {
                let [ry, pp] = [ry + xz, inertia[1]];
                let matrix = Matrix3::new(rr, xy, ry, xy, pp, yz, ry, yz, yy);
                let turns = inverse_of_symmetric(&matrix) * Vector3::new(roll, pitch, yaw);
                (turns.x, turns.y, turns.z)
            }
        };
        let y = fy * per - to_roll * along_roll - to_yaw * along_yaw;
        [x, y, z, along_roll, turn, along_yaw]
    }
}
