//! Energy of the compliant model.

use twinrig_compliant::events::{ABDUCTION, ElementMotion, GROUND, INSIDE};
use twinrig_compliant::frame::cross;
use twinrig_compliant::lanes::{Kernel, Lanes, Quad, Simd};
use twinrig_compliant::{Below, Depths, DriveLaws, TrunkMotion, Turns, broadcast};
use twinrig_legged::{Base, Stored};
use twinrig_robot::{GRAVITY, Payload};

use super::body::Body;
use super::carrier::{Carried, Carrier};
use super::contact::{Carriers, end_of};
use super::elimination::PLANE;
use super::model::{CompliantModel, Legs};
use super::state::State;
use super::trunk::times;

/// Returns the kinetic energy of payloads beyond ½ m v² \[J\], and their Σ m z above the trunk's
/// centre of mass \[kg·m\].
fn payload_terms(payload: &Payload, trunk: &TrunkMotion) -> [f64; 2] {
    let dot = |[a, b, c]: [f64; 3], [d, e, f]: [f64; 3]| a * d + b * e + c * f;
    let spin = times(&payload.inertia(), trunk.turning);
    let swing = cross(trunk.turning, payload.moment);
    let kinetic = 0.5 * dot(trunk.turning, spin) + dot(trunk.velocity, swing);
    [kinetic, dot(payload.moment, trunk.rotation[2])]
}

/// Kinetic, spring and gravity energy in a state \[J\]; the springs include the elements.
pub(crate) struct StoredEnergy<'a, const N: usize, const P: usize, const A: usize, const B: usize> {
    pub(crate) model: &'a CompliantModel<N, A>,
    pub(crate) state: &'a State<Quad, N, P, A, B>,
}

impl<const N: usize, const P: usize, const A: usize, const B: usize> Kernel
    for StoredEnergy<'_, N, P, A, B>
{
    type Output = Stored;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Stored {
        let (model, state) = (self.model, self.state.load(simd));
        let legs = model.legs.load(simd);
        let trunk = TrunkMotion::new(state.trunk());
        let turns = Turns::new(&state.angles);
        let entries = turns.inertia_and_swing(&legs.inertias);
        let zero = state.pulley.zero();
        let mut kinetic = zero;
        for i in 0..N {
            kinetic += entries[i][i] * (state.rates[i] * state.rates[i]) * 0.5;
            for j in 0..i {
                kinetic += entries[i][j] * (state.rates[i] * state.rates[j]);
            }
        }
        let [hip, knee] = model.drives.inertias();
        kinetic += state.rates[0] * state.rates[0] * (0.5 * hip)
            + state.pulley_rate * state.pulley_rate * (0.5 * knee);
        let at_rest = Carrier {
            turning: [zero; 3],
            field: [zero; 3],
        };
        let carried = Carried::new(&legs, &turns, &state.rates, &entries, &at_rest);
        let frame = legs.frame(&state, &trunk);
        let springs = self.springs(simd, &legs, &turns, &state, &trunk);
        let up = trunk.rotation[2];
        let [sx, sz] = carried.off_plane.moment;
        if A == 0 && model.base == Base::Fixed {
            let height = (sx - legs.mass_hip[0]) * up[0] + (sz - legs.mass_hip[2]) * up[2];
            let [kinetic, springs, height, _] =
                S::Lanes::sums([kinetic, springs, height, zero]).quad().0;
            return [kinetic, springs, GRAVITY * height];
        }
        // Velocities of trunk or frame, and of the plane of each leg.
        let (velocity, turning, moment) = match &frame {
            None => (
                broadcast(zero, trunk.velocity),
                broadcast(zero, trunk.turning),
                [sx, legs.mass_hip[1], sz],
            ),
            Some(frame) => {
                let [x, y, z] = frame.into_trunk([sx, legs.mass_hip[1], sz]);
                let [left, up] = frame.axis;
                let moment = [x, y + legs.mass * left, z + legs.mass * up];
                (frame.velocity, frame.turning, moment)
            }
        };
        let ([vx, vy, vz], [wx, wy, wz]) = (velocity, turning);
        let plane = [vx - legs.hip[1] * wz, vz + legs.hip[1] * wx, wy];
        let mut entry = 0;
        for a in 0..PLANE {
            for b in 0..=a {
                let share = if a == b { 0.5 } else { 1.0 };
                kinetic += carried.share.matrix[entry] * plane[a] * plane[b] * share;
                entry += 1;
            }
            for j in 0..N {
                kinetic += carried.columns[j][a] * state.rates[j] * plane[a];
            }
        }
        let [xx, zz, xz] = carried.off_plane.spread;
        kinetic += xx * (wz * 0.5 * wz) + zz * (wx * 0.5 * wx) - xz * (wx * wz);
        kinetic += legs.mass * (vy * 0.5 * vy) + sx * (vy * wz) - sz * (vy * wx);
        if let (Some(joints), Some(joint)) = (legs.joints.first(), state.abduction.first()) {
            kinetic += joint.rate * joint.rate * (0.5 * joints.inertia());
        }
        let height = moment[0] * up[0] + moment[1] * up[1] + moment[2] * up[2];
        let [kinetic, springs, height, _] =
            S::Lanes::sums([kinetic, springs, height, zero]).quad().0;
        let spin: f64 = (0..3)
            .map(|i| model.inertia[i] * trunk.turning[i] * trunk.turning[i])
            .sum();
        let [vx, vy, vz] = trunk.velocity;
        let square = vx * vx + vy * vy + vz * vz;
        let mut energy = [
            kinetic + 0.5 * (model.trunk_mass * square + spin),
            springs,
            GRAVITY * (model.mass * trunk.position[2] + height),
        ];
        if let Some(payload) = &model.payload {
            let [turning, height] = payload_terms(payload, &trunk);
            energy[0] += turning;
            energy[2] += GRAVITY * height;
        }
        energy
    }
}

impl<const N: usize, const P: usize, const A: usize, const B: usize> StoredEnergy<'_, N, P, A, B> {
    /// Returns the energy of springs and elements, by leg.
    #[inline(always)]
    fn springs<S: Simd>(
        &self,
        simd: S,
        legs: &Legs<S::Lanes, N, A>,
        turns: &Turns<S::Lanes, N>,
        state: &State<S::Lanes, N, P, A, B>,
        trunk: &TrunkMotion,
    ) -> S::Lanes {
        let has_cable = self.model.drives != DriveLaws::None;
        let mut energy = legs.pantographs.energy(turns, &state.joints(), has_cable);
        if let (Some(joints), Some(joint)) = (legs.joints.first(), state.abduction.first()) {
            energy += joints.energy(joint.angle);
        }
        let frame = legs.frame(state, trunk);
        let carriers = Carriers::new(frame.as_ref(), trunk);
        if let Some(ground) = &self.model.rigid.ground {
            for p in 0..P {
                let point = end_of(legs, turns, state, N - P + 1 + p, carriers).point;
                let depth = -Below::new(simd, ground, trunk, &point).gap;
                energy += legs.sole.energy(depth, state.bristles[p]);
            }
            energy += Body {
                simd,
                legs,
                turns,
                state,
                ground,
                trunk,
                carriers,
                is_free: self.model.base != Base::Fixed,
            }
            .energy(self.model);
        }
        energy
    }
}

/// Computation of depths and rates of all elements.
pub(crate) struct Elements<'a, const N: usize, const P: usize, const A: usize, const B: usize> {
    pub(crate) model: &'a CompliantModel<N, A>,
    pub(crate) state: &'a State<Quad, N, P, A, B>,
}

impl<const N: usize, const P: usize, const A: usize, const B: usize> Kernel
    for Elements<'_, N, P, A, B>
{
    type Output = ElementMotion;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let (model, state) = (self.model, self.state.load(simd));
        let legs = model.legs.load(simd);
        let turns = Turns::new(&state.angles);
        let inside = Depths::new(&legs.pantographs, &turns, &state.joints());
        let (mut motion, count) = (ElementMotion::none(), model.rigid.legs.len());
        // The cable is the last.
        let cable = usize::from(model.drives == DriveLaws::None);
        for i in 0..INSIDE - cable {
            motion.set(i, count, inside.depths[i], inside.rates[i]);
        }
        if let (Some(joints), Some(joint)) = (legs.joints.first(), state.abduction.first()) {
            let stop = joints.resistance(joint.angle, joint.rate);
            motion.set(ABDUCTION, count, stop.depth, stop.depth_rate);
        }
        if let Some(ground) = &model.rigid.ground {
            let trunk = TrunkMotion::new(state.trunk());
            let frame = legs.frame(&state, &trunk);
            let carriers = Carriers::new(frame.as_ref(), &trunk);
            for p in 0..P {
                let point = end_of(&legs, &turns, &state, N - P + 1 + p, carriers).point;
                let below = Below::new(simd, ground, &trunk, &point);
                let rate = -below.gap_rate(point.velocity);
                motion.set(GROUND + p, count, -below.gap, rate);
            }
            Body {
                simd,
                legs: &legs,
                turns: &turns,
                state: &state,
                ground,
                trunk: &trunk,
                carriers,
                is_free: model.base != Base::Fixed,
            }
            .elements(model, count, &mut motion);
        }
        motion
    }
}
