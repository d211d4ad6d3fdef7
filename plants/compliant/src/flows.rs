//! Powers and forces of legs.

use crate::lanes::{Lanes, Quad};

/// Powers and forces, which are integrated with the motion. `T` is [`Quad`] in memory, or lanes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flows<T> {
    /// Power of the drives on links and cable, beyond that into their own inertia \[W\].
    pub actuator: T,
    /// Power of pushes on the foot, and in the first lane that on the trunk too \[W\].
    pub external: T,
    /// Power dissipated by joints, elements and friction \[W\].
    pub dissipated: T,
    /// Torque of the hip drive on its link \[N·m\].
    pub hip: T,
    /// Torque of the cable on the pulley \[N·m\].
    pub knee: T,
    /// Tension of the cable \[N\].
    pub cable: T,
    /// Force of the ground on the leg, world frame \[N\].
    pub ground: [T; 3],
}

impl<T: Copy> Flows<T> {
    /// Applies a function to all members.
    #[inline(always)]
    pub fn map<U: Copy>(&self, mut of: impl FnMut(T) -> U) -> Flows<U> {
        let [x, y, z] = self.ground;
        Flows {
            actuator: of(self.actuator),
            external: of(self.external),
            dissipated: of(self.dissipated),
            hip: of(self.hip),
            knee: of(self.knee),
            cable: of(self.cable),
            ground: [of(x), of(y), of(z)],
        }
    }

    /// Combines two member by member.
    #[inline(always)]
    #[must_use]
    pub fn zip(&self, other: &Self, mut of: impl FnMut(T, T) -> T) -> Self {
        Self {
            actuator: of(self.actuator, other.actuator),
            external: of(self.external, other.external),
            dissipated: of(self.dissipated, other.dissipated),
            hip: of(self.hip, other.hip),
            knee: of(self.knee, other.knee),
            cable: of(self.cable, other.cable),
            ground: [
                of(self.ground[0], other.ground[0]),
                of(self.ground[1], other.ground[1]),
                of(self.ground[2], other.ground[2]),
            ],
        }
    }
}

impl<L: Lanes> Flows<L> {
    /// Returns a sum of the powers of drives and pushes less the dissipated ones, each times its
    /// seconds \[J\].
    #[inline(always)]
    pub fn net_work<const M: usize>(flows: [&Self; M], seconds: [f64; M]) -> L {
        let mut work = flows[0].actuator.zero();
        for (flow, seconds) in flows.into_iter().zip(seconds) {
            work += (flow.actuator + flow.external - flow.dissipated) * seconds;
        }
        work
    }
}

impl Flows<Quad> {
    /// Returns no power and no force.
    pub fn zero() -> Self {
        let zero = Quad::splat(0.0);
        Self {
            actuator: zero,
            external: zero,
            dissipated: zero,
            hip: zero,
            knee: zero,
            cable: zero,
            ground: [zero; 3],
        }
    }
}
