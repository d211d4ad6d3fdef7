//! Equations of the trunk, which carries the feet sideways.

use twinrig_legged::Base;

/// Sums over the legs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TrunkSums {
    /// Mass of the feet \[kg\], and m x and m z \[kg·m\], from the centre of mass of the trunk.
    pub(crate) mass: f64,
    pub(crate) moment: [f64; 2],
    /// m x², m x z and m z² \[kg·m²\].
    pub(crate) spread: [f64; 3],
    /// Force and torque on the trunk; lateral ones with an unaccelerated trunk.
    pub(crate) force: [f64; 6],
}

impl TrunkSums {
    /// Solves for the acceleration of the trunk, linear then angular, from its mass and principal
    /// moments of inertia.
    ///
    /// Forward, up and pitch are independent. The sideways inertia of the feet, m s sᵀ with s = (1,
    /// −z, x), couples y, roll and yaw, of which y is eliminated.
    #[inline(always)]
    pub(crate) fn solve(&self, base: Base, mass: f64, inertia: [f64; 3]) -> [f64; 6] {
        let [fx, fy, fz, roll, pitch, yaw] = self.force;
        let per_mass = 1.0 / mass;
        let (x, z, turn) = (fx * per_mass, fz * per_mass, pitch / inertia[1]);
        if base == Base::Planar {
            return [x, 0.0, z, 0.0, turn, 0.0];
        }
        let ([mx, mz], [mxx, mxz, mzz]) = (self.moment, self.spread);
        let per = 1.0 / (mass + self.mass);
        let (to_roll, to_yaw) = (-mz * per, mx * per);
        let rr = inertia[0] + mzz + to_roll * mz;
        let ry = -mxz - to_roll * mx;
        let yy = inertia[2] + mxx - to_yaw * mx;
        let roll = roll - to_roll * fy;
        let yaw = yaw - to_yaw * fy;
        let per_determinant = 1.0 / (rr * yy - ry * ry);
        let along_roll = (yy * roll - ry * yaw) * per_determinant;
        let along_yaw = (rr * yaw - ry * roll) * per_determinant;
        let y = fy * per - to_roll * along_roll - to_yaw * along_yaw;
        [x, y, z, along_roll, turn, along_yaw]
    }
}
