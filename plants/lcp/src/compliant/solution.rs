//! Solution of the equations for the accelerations of trunk, links and joints.

use twinrig_compliant::frame::cross;
use twinrig_compliant::lanes::{Lanes, Simd};
use twinrig_compliant::{JointMotion, Limited, TrunkMotion};

use super::abduction::LegJoint;
use super::elimination::{PLANE, PlaneShare};
use super::evaluation::Evaluation;
use super::forces::Equations;
use super::trunk::TrunkSystem;

/// Accelerations of trunk and links, and torque of the hip drives on their links.
pub(super) struct Solution<L, const N: usize> {
    pub(super) trunk: [f64; 6],
    pub(super) links: [L; N],
    pub(super) hip_torque: L,
    /// Joints of abduction, if legs have them.
    pub(super) joint: Option<JointMotion<L>>,
}

/// Accelerations of the trunk, of the planes of the legs, and of their joints.
struct BaseMotion<L> {
    trunk: [f64; 6],
    plane: [L; PLANE],
    joint: Option<JointMotion<L>>,
}

impl<S: Simd<Lanes = L>, L: Lanes, const N: usize, const P: usize, const A: usize, const B: usize>
    Evaluation<'_, S, N, P, A, B>
{
    /// Solves with the acceleration of the hips imposed.
    #[inline(always)]
    pub(super) fn solve_imposed<const FREE: bool>(
        &self,
        equations: &Equations<L, N>,
        acceleration: L,
        trunk: &TrunkMotion,
    ) -> Solution<L, N> {
        let (mut links, mut share) = (equations.links, equations.share);
        links.impose::<FREE>(acceleration, &mut share);
        let eliminated = links.eliminate::<1, FREE>(&mut share);
        let mut imposed = equations.links.torques;
        imposed[0] = acceleration;
        let base = self.trunk::<FREE>(equations, &share, trunk);
        let links = eliminated.accelerations::<1, FREE>(&base.plane, imposed);
        Solution {
            trunk: base.trunk,
            joint: base.joint,
            links,
            hip_torque: equations.links.first_torque::<FREE>(&links, &base.plane),
        }
    }

    /// Solves with hips that rotate under a torque, which also accelerates an inertia.
    #[inline(always)]
    pub(super) fn solve_free<const FREE: bool>(
        &self,
        equations: &Equations<L, N>,
        torque: L,
        inertia: f64,
        trunk: &TrunkMotion,
    ) -> Solution<L, N> {
        let (mut links, mut share) = (equations.links, equations.share);
        links.inertia[0][0] = links.inertia[0][0] + inertia;
        links.torques[0] += torque;
        let eliminated = links.eliminate::<0, FREE>(&mut share);
        let base = self.trunk::<FREE>(equations, &share, trunk);
        let links = eliminated.accelerations::<0, FREE>(&base.plane, links.torques);
        Solution {
            trunk: base.trunk,
            joint: base.joint,
            links,
            hip_torque: torque - links[0] * inertia,
        }
    }

    /// Solves with some hips free under the limit of their torque, the others with imposed
    /// acceleration: their first row becomes θ̈ = α.
    #[inline(always)]
    pub(super) fn solve_limited<const FREE: bool>(
        &self,
        equations: &Equations<L, N>,
        acceleration: L,
        limited: &Limited<L>,
        inertia: f64,
        trunk: &TrunkMotion,
    ) -> Solution<L, N> {
        let (mut links, mut share) = (equations.links, equations.share);
        let (limit, zero) = (limited.torque, acceleration.zero());
        let limited = limited.side.abs().gt(zero);
        let imposed = zero.or(limited, acceleration);
        links.impose::<FREE>(imposed, &mut share);
        links.inertia[0][0] = (links.inertia[0][0] + inertia).or(limited, zero.like(1.0));
        for j in 1..N {
            links.inertia[j][0] = links.inertia[j][0].or(limited, zero);
        }
        for column in &mut links.columns[0] {
            *column = column.or(limited, zero);
        }
        links.torques[0] = (links.torques[0] + limit).or(limited, imposed);
        let eliminated = links.eliminate::<0, FREE>(&mut share);
        let base = self.trunk::<FREE>(equations, &share, trunk);
        let links = eliminated.accelerations::<0, FREE>(&base.plane, links.torques);
        Solution {
            trunk: base.trunk,
            joint: base.joint,
            links,
            hip_torque: equations.links.first_torque::<FREE>(&links, &base.plane),
        }
    }

    /// Returns the accelerations of the trunk, of the plane of each leg, and of its joint.
    #[inline(always)]
    fn trunk<const FREE: bool>(
        &self,
        equations: &Equations<L, N>,
        share: &PlaneShare<L>,
        trunk: &TrunkMotion,
    ) -> BaseMotion<L> {
        let zero = equations.off_plane.lateral.zero();
        if !FREE {
            return BaseMotion {
                trunk: [0.0; 6],
                plane: [zero; PLANE],
                joint: None,
            };
        }
        if let Some(joint) = &equations.joint {
            return self.abducted(equations, share, joint, trunk);
        }
        let off_plane = &equations.off_plane;
        let hy = self.legs.hip[1];
        let [xx, zx, zz, px, pz, pp] = share.matrix;
        let [fx, fz, pitch] = share.force;
        let [sx, sz] = off_plane.moment;
        let [mxx, mzz, mxz] = off_plane.spread;
        // Forces forward and up act beside the centre of mass.
        let (hxx, hzx, hzz) = (hy * xx, hy * zx, hy * zz);
        let a = L::sums([xx, zx, zz, px]).quad().0;
        let b = L::sums([pz, pp, hxx, hzx]).quad().0;
        let c = L::sums([hzz, hy * px, hy * pz, hy * hxx + mxx]).quad().0;
        let d = L::sums([hy * hzz + mzz, hy * hzx + mxz, fx, fz]).quad().0;
        let roll = off_plane.roll + hy * fz;
        let yaw = off_plane.yaw - hy * fx;
        let e = L::sums([pitch, roll, yaw, off_plane.lateral]).quad().0;
        let f = L::sums([sx, sz, self.legs.mass_hip[1], zero]).quad().0;
        let model = self.model;
        let [inertia_x, inertia_y, inertia_z] = model.inertia;
        let (field, moment) = (trunk.field, [f[0], f[2], f[1]]);
        let weight = cross(moment, field);
        let [wx, wy, wz] = trunk.turning;
        let spin = [inertia_x * wx, inertia_y * wy, inertia_z * wz];
        let gyro = cross(trunk.turning, spin);
        let mut system = TrunkSystem {
            plane: [a[0] + model.trunk_mass, a[1], a[2] + model.trunk_mass],
            ahead: [b[3], a[3], -b[2]],
            up: [c[0], b[0], -b[3]],
            lateral: [-f[1], f[0]],
            rotation: [
                d[0] + inertia_x,
                c[2],
                b[1] + inertia_y,
                -d[1],
                -c[1],
                c[3] + inertia_z,
            ],
            mass: model.mass,
            force: [
                d[2] + model.mass * field[0],
                e[3] + model.mass * field[1],
                d[3] + model.mass * field[2],
                e[1] + weight[0] - gyro[0],
                e[0] + weight[1] - gyro[1],
                e[2] + weight[2] - gyro[2],
            ],
        };
        if let Some(payload) = &model.payload {
            system.carry(payload, field, trunk.turning);
        }
        if let Some(push) = equations.on_trunk {
            for (force, push) in system.force.iter_mut().zip(push) {
                *force += push;
            }
        }
        let accelerations = system.solve(model.base);
        let [x, _, z, roll, pitch, yaw] = accelerations;
        let plane = [
            zero.like(x) - hy * yaw,
            zero.like(z) + hy * roll,
            zero.like(pitch),
        ];
        BaseMotion {
            trunk: accelerations,
            plane,
            joint: None,
        }
    }

    /// Returns the same with legs that abduct.
    #[inline(always)]
    fn abducted(
        &self,
        equations: &Equations<L, N>,
        share: &PlaneShare<L>,
        joint: &LegJoint<L>,
        trunk: &TrunkMotion,
    ) -> BaseMotion<L> {
        let (model, beside, LegJoint { frame, drive }) = (self.model, self.legs.hip[1], joint);
        let mut body = equations
            .off_plane
            .body((self.legs.mass, beside), share, frame);
        let row = body.eliminate(drive);
        let mut system = body.into_trunk(frame);
        let [xx, yy, zz] = model.inertia;
        let (mut inertia, mut moment) = ([xx, 0.0, yy, 0.0, 0.0, zz], [0.0; 3]);
        if let Some(payload) = &model.payload {
            let [[xx, ..], [yx, yy, _], [zx, zy, zz]] = payload.inertia();
            let entries = inertia.iter_mut().zip([xx, yx, yy, zx, zy, zz]);
            entries.for_each(|(entry, part)| *entry += part);
            moment = payload.moment;
        }
        let body = (model.trunk_mass, moment, inertia);
        system.add_trunk(body, trunk.field, trunk.turning);
        if let Some(push) = equations.on_trunk {
            system.push(push);
        }
        let accelerations = system.solve(model.base);
        let [linear, angular] = frame.acceleration(accelerations);
        let motion = row.motion(drive, [linear, angular]);
        let [about_y, about_z] = frame.swing;
        let plane = [
            linear[0] - beside * (angular[2] + about_z),
            linear[2] + beside * (angular[0] + motion.acceleration),
            angular[1] + about_y,
        ];
        BaseMotion {
            trunk: accelerations,
            plane,
            joint: Some(motion),
        }
    }
}
