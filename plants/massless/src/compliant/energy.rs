//! Energy of the compliant model, and depths of its elements.

use twinrig_compliant::events::{ABDUCTION, CORNERS, ElementMotion, GROUND};
use twinrig_compliant::lanes::{Kernel, LANES, Lanes, Quad, Simd};
use twinrig_compliant::{Below, Depths, Joints, TrunkMotion, Turns};
use twinrig_legged::{Base, Stored};
use twinrig_robot::GRAVITY;

use super::body::Corners;
use super::model::CompliantModel;
use super::slope::{ANKLE, LegMotion, in_line};
use super::state::State;

/// Kinetic, spring and gravity energy in a state \[J\]; the springs include the elements.
pub(crate) struct StoredEnergy<'a, const A: usize, const B: usize> {
    pub(crate) model: &'a CompliantModel<A>,
    pub(crate) state: &'a State<Quad, A, B>,
}

impl<const A: usize, const B: usize> Kernel for StoredEnergy<'_, A, B> {
    type Output = Stored;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Stored {
        let (model, state) = (self.model, self.state.load(simd));
        let legs = model.legs.load(simd);
        let trunk = TrunkMotion::new(state.trunk());
        let turns = Turns::new(&state.angles);
        let frame = legs.frame(&state, &trunk);
        let motion = LegMotion::new(&legs, &turns, &state, &trunk, frame.as_ref());
        let joints = Joints {
            angles: &state.angles,
            rates: &motion.rates,
            pulley: state.pulley,
            pulley_rate: state.pulley_rate,
        };
        let mut springs = legs.pantographs.energy(&turns, &joints, true)
            + legs.pantographs.stops.energy(in_line(&legs, &turns));
        if let Some(ground) = &model.rigid.ground {
            let below = Below::new(simd, ground, &trunk, &motion.point);
            springs += legs.sole.energy(-below.gap, state.bristle);
        }
        if let Some(corners) = Corners::new(simd, model, &state) {
            springs += corners.energy(simd, &trunk);
        }
        let [ux, uy, uz] = motion.point.velocity;
        let [hip, knee] = model.drives.inertias();
        let mut twice = legs.mass * (ux * ux + uy * uy + uz * uz)
            + state.hip_rate * state.hip_rate * hip
            + state.pulley_rate * state.pulley_rate * knee;
        if let (Some(joints), Some(joint)) = (legs.joints.first(), state.abduction.first()) {
            springs += joints.energy(joint.angle);
            twice += joint.rate * joint.rate * joints.inertia();
        }
        let ([x, y, z], up) = (motion.point.place, trunk.rotation[2]);
        let height = legs.mass * (x * up[0] + y * up[1] + z * up[2] + trunk.position[2]);
        let [mut twice, springs, mut height, _] =
            S::Lanes::sums([twice, springs, height, x.zero()]).quad().0;
        // The energy of a fixed trunk is constant, and counts as zero.
        if model.rigid.base != Base::Fixed {
            let ([vx, vy, vz], [wx, wy, wz]) = (trunk.velocity, trunk.turning);
            let inertia = &model.rigid.inertia;
            twice += model.rigid.mass * (vx * vx + vy * vy + vz * vz)
                + (inertia[0] * wx * wx + inertia[1] * wy * wy + inertia[2] * wz * wz);
            if let Some([xy, xz, yz]) = model.trunk.products {
                twice += 2.0 * (xy * wx * wy + xz * wx * wz + yz * wy * wz);
            }
            height += model.rigid.mass * trunk.position[2];
        }
        [0.5 * twice, springs, GRAVITY * height]
    }
}

/// Computation of depths and rates of all elements.
pub(crate) struct Elements<'a, const A: usize, const B: usize> {
    pub(crate) model: &'a CompliantModel<A>,
    pub(crate) state: &'a State<Quad, A, B>,
}

impl<const A: usize, const B: usize> Kernel for Elements<'_, A, B> {
    type Output = ElementMotion;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let (model, state) = (self.model, self.state.load(simd));
        let legs = model.legs.load(simd);
        let trunk = TrunkMotion::new(state.trunk());
        let turns = Turns::new(&state.angles);
        let frame = legs.frame(&state, &trunk);
        let leg_motion = LegMotion::new(&legs, &turns, &state, &trunk, frame.as_ref());
        let joints = Joints {
            angles: &state.angles,
            rates: &leg_motion.rates,
            pulley: state.pulley,
            pulley_rate: state.pulley_rate,
        };
        let inside = Depths::new(&legs.pantographs, &turns, &joints);
        let (mut motion, count) = (ElementMotion::none(), model.rigid.legs.len());
        for (i, (&depth, &rate)) in inside.depths.iter().zip(&inside.rates).enumerate() {
            motion.set(i, count, depth, rate);
        }
        if let Some(ground) = &model.rigid.ground {
            let point = &leg_motion.point;
            let below = Below::new(simd, ground, &trunk, point);
            let rate = -below.gap_rate(point.velocity);
            motion.set(GROUND, count, -below.gap, rate);
        }
        if let (Some(joints), Some(joint)) = (legs.joints.first(), state.abduction.first()) {
            let stop = joints.resistance(joint.angle, joint.rate);
            motion.set(ABDUCTION, count, stop.depth, stop.depth_rate);
        }
        if let Some(corners) = Corners::new(simd, model, &state) {
            for level in 0..2 {
                let [depth, rate] = corners.motion(simd, &trunk, level);
                motion.set(CORNERS + level, LANES, depth, rate);
            }
        }
        let ankle = in_line(&legs, &turns);
        motion.set(ANKLE, count, ankle, leg_motion.folding(&legs, &turns));
        motion
    }
}

/// Computation of the motion of feet and links.
pub(crate) struct LegMotions<'a, const A: usize, const B: usize> {
    pub(crate) model: &'a CompliantModel<A>,
    pub(crate) state: &'a State<Quad, A, B>,
}

/// Position relative to the trunk \[m\] and velocity \[m/s\] of feet, trunk axes, and rates of
/// links \[rad/s\]; velocity of feet relative to their carriers, leg axes \[m/s\].
pub(crate) struct Motion {
    pub(crate) place: [Quad; 3],
    pub(crate) velocity: [Quad; 3],
    pub(crate) rates: [Quad; 3],
    pub(crate) relative: [Quad; 2],
}

impl<const A: usize, const B: usize> Kernel for LegMotions<'_, A, B> {
    type Output = Motion;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Motion {
        let state = self.state.load(simd);
        let legs = self.model.legs.load(simd);
        let trunk = TrunkMotion::new(state.trunk());
        let turns = Turns::new(&state.angles);
        let frame = legs.frame(&state, &trunk);
        let motion = LegMotion::new(&legs, &turns, &state, &trunk, frame.as_ref());
        let quads = |[x, y, z]: [S::Lanes; 3]| [x.quad(), y.quad(), z.quad()];
        Motion {
            place: quads(motion.point.place),
            velocity: quads(motion.point.velocity),
            rates: quads(motion.rates),
            relative: motion.relative.map(Lanes::quad),
        }
    }
}
