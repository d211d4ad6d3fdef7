//! Forces of pushes in one state.

use twinrig_legged::StepLoad;

use crate::frame::{Rotation, into_trunk};
use crate::ground::TrunkMotion;
use crate::lanes::{Lanes, Quad, Simd};

/// Forces of pushes in one state, trunk axes.
#[derive(Debug, Clone, Copy)]
pub struct Pushed<L> {
    /// Forces on the feet \[N\].
    pub feet: [L; 3],
    /// Force on the trunk \[N\], and torque about the origin of its coordinates \[N·m\].
    pub trunk: [f64; 6],
}

impl<L: Lanes> Pushed<L> {
    /// Computes the forces after some time of a step \[s\]; `centre` is the origin of the
    /// trunk's coordinates from its own centre of mass \[m\].
    #[inline(always)]
    pub fn new<S: Simd<Lanes = L>>(
        simd: S,
        (load, time): (&StepLoad, f64),
        rotation: &Rotation,
        centre: [f64; 3],
    ) -> Self {
        let load = load.at(time);
        let feet = load.feet.map(|force| into_trunk(rotation, force));
        let [x, y, z, roll, pitch, yaw] = load.wrench(rotation, |value| value);
        let [a, b, c] = centre;
        Self {
            feet: [0, 1, 2].map(|i| simd.load(Quad(feet.map(|force| force[i])))),
            trunk: [
                x,
                y,
                z,
                roll - (b * z - c * y),
                pitch - (c * x - a * z),
                yaw - (a * y - b * x),
            ],
        }
    }

    /// Returns the power on feet with this velocity, and in the first lane that on the trunk too
    /// \[W\].
    #[inline(always)]
    pub fn power<S: Simd<Lanes = L>>(&self, simd: S, feet: [L; 3], trunk: &TrunkMotion) -> L {
        let [x, y, z, roll, pitch, yaw] = self.trunk;
        let ([vx, vy, vz], [wx, wy, wz]) = (trunk.velocity, trunk.turning);
        let on_trunk = x * vx + y * vy + z * vz + (roll * wx + pitch * wy + yaw * wz);
        let [fx, fy, fz] = self.feet;
        let on_feet = fx * feet[0] + fy * feet[1] + fz * feet[2];
        on_feet + simd.load(Quad([on_trunk, 0.0, 0.0, 0.0]))
    }
}
