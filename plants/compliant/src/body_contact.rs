//! Contact of trunk, knees and ankles with the ground.
//!
//! The corners of the trunk's box, the knees and the ankles press as soles do ([`Sole`]). They are
//! rarely on the ground: where no point of four side by side is, only its distance is computed, and
//! its bristle relaxes.

use twinrig_contact::Ground;
use twinrig_legged::{Contacts, LeggedError, Setup};
use twinrig_robot::Robot;

use crate::element::Element;
use crate::events::{CORNERS, if_compressed};
use crate::frame::into_world;
use crate::friction::Sole;
use crate::ground::{Below, Footforce, Point, TrunkMotion, broadcast};
use crate::lanes::{LANES, Lanes, Quad, Simd, Task};

/// Deflections of the contact points along the two tangents of the ground \[m\], and impulses, in a
/// state; their rates in a slope. `T` is [`Quad`] in memory, or lanes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyContact<T> {
    /// Knees and ankles.
    pub joints: [[T; 2]; 2],
    /// Integral of the force of the ground on knee and ankle of each leg, world frame \[N·s\].
    pub on_legs: [T; 3],
    /// Lower and upper corners of the trunk.
    pub corners: [[T; 2]; 2],
    /// Integral of the force of the ground on the trunk, world frame \[N·s\].
    pub on_trunk: T,
}

impl BodyContact<Quad> {
    /// No deflection and no impulse.
    pub const RELAXED: Self = Self::all(Quad::splat(0.0));
}

impl<T: Copy> BodyContact<T> {
    /// Number of the members that belong to the trunk, which are the last.
    pub const OF_TRUNK: usize = 5;

    /// Returns contacts all of whose members are `value`.
    #[inline(always)]
    pub const fn all(value: T) -> Self {
        Self {
            joints: [[value; 2]; 2],
            on_legs: [value; 3],
            corners: [[value; 2]; 2],
            on_trunk: value,
        }
    }

    /// Applies a function to all members of the contacts, if there are any; `any` is a value of the
    /// result.
    #[inline(always)]
    pub fn map_each<U: Copy, const B: usize>(
        contacts: &[Self; B],
        any: U,
        mut of: impl FnMut(T) -> U,
    ) -> [BodyContact<U>; B] {
        let mut next = [BodyContact::all(any); B];
        for (next, contact) in next.iter_mut().zip(contacts) {
            for i in 0..2 {
                next.joints[i] = [of(contact.joints[i][0]), of(contact.joints[i][1])];
            }
            let [x, y, z] = contact.on_legs;
            next.on_legs = [of(x), of(y), of(z)];
            for i in 0..2 {
                next.corners[i] = [of(contact.corners[i][0]), of(contact.corners[i][1])];
            }
            next.on_trunk = of(contact.on_trunk);
        }
        next
    }

    /// Combines two member by member.
    #[inline(always)]
    #[must_use]
    pub fn zip<U: Copy>(&self, other: &BodyContact<U>, mut of: impl FnMut(T, U) -> T) -> Self {
        let mut next = *self;
        for i in 0..2 {
            for k in 0..2 {
                next.joints[i][k] = of(self.joints[i][k], other.joints[i][k]);
                next.corners[i][k] = of(self.corners[i][k], other.corners[i][k]);
            }
        }
        for i in 0..3 {
            next.on_legs[i] = of(self.on_legs[i], other.on_legs[i]);
        }
        next.on_trunk = of(self.on_trunk, other.on_trunk);
        next
    }
}

impl<L: Lanes> BodyContact<L> {
    /// Returns the greatest deflection, of non-negative members \[m\].
    #[inline(always)]
    pub fn greatest_deflection(&self) -> L {
        let [[a, b], [c, d]] = self.joints;
        let [[e, f], [g, h]] = self.corners;
        (a + b).max(c + d).max((e + f).max(g + h))
    }
}

/// Constants of the contact points; `T` is [`Quad`] in memory, or lanes.
#[derive(Debug, Clone, Copy)]
pub struct BodyPoints<T> {
    /// Lower and upper corners of the trunk, in its coordinates \[m\].
    corners: [[T; 3]; 2],
    trunk: Sole<T>,
    joints: Sole<T>,
    /// Whether knees and ankles have contact.
    pub has_joints: bool,
}

impl BodyPoints<Quad> {
    /// Creates the points of a robot, in coordinates about the trunk's own centre of mass.
    ///
    /// # Errors
    /// As [`Setup::contact`].
    pub fn new(robot: &Robot, setup: &Setup) -> Result<Self, LeggedError> {
        let contact = setup.contact(robot)?;
        let joints = match setup.contacts {
            Contacts::All => setup.legs.len(),
            Contacts::Feet | Contacts::Trunk => 0,
        };
        let friction = setup.ground.as_ref().map_or(0.0, |ground| ground.friction);
        let corners = robot.trunk.corners();
        let level = |from: usize| {
            let place = |axis: usize, lane: usize| corners[from + lane][axis];
            [0, 1, 2].map(|axis| Quad([0, 1, 2, 3].map(|lane| place(axis, lane))))
        };
        let sole = |count: usize| {
            let elements = std::iter::repeat_n(contact.element(), count);
            let deflections = [contact.slip_deflection; LANES];
            Sole::new(Element::side_by_side(elements), friction, &deflections)
        };
        Ok(Self {
            corners: [level(0), level(LANES)],
            trunk: sole(LANES),
            joints: sole(joints),
            has_joints: joints > 0,
        })
    }

    /// Returns the same for coordinates whose origin is `centre` from that of the trunk \[m\].
    #[must_use]
    pub fn about(mut self, centre: [f64; 3]) -> Self {
        for corners in &mut self.corners {
            for (places, by) in corners.iter_mut().zip(centre) {
                places.0.iter_mut().for_each(|place| *place -= by);
            }
        }
        self
    }

    /// Sets the coefficients of friction of the legs and of the trunk.
    pub fn set_friction(&mut self, legs: &[f64; LANES], trunk: f64) {
        self.joints.set_friction(legs);
        self.trunk.set_friction(&[trunk; LANES]);
    }

    /// Loads the points into lanes.
    #[inline(always)]
    pub fn load<S: Simd>(&self, simd: S) -> BodyPoints<S::Lanes> {
        BodyPoints {
            corners: [
                simd.load_all(&self.corners[0]),
                simd.load_all(&self.corners[1]),
            ],
            trunk: self.trunk.load(simd),
            joints: self.joints.load(simd),
            has_joints: self.has_joints,
        }
    }
}

/// Force of the ground on the trunk.
#[derive(Debug, Clone, Copy)]
pub struct TrunkForce<L> {
    /// Force \[N\] and torque about the origin of the trunk's coordinates \[N·m\], trunk axes.
    pub wrench: [f64; 6],
    /// World frame \[N\].
    pub force_in_world: [f64; 3],
    /// Rates of the bristles \[m/s\].
    pub rates: [[L; 2]; 2],
    /// Dissipated power \[W\].
    pub dissipated: L,
    /// Compressed elements.
    pub compressed: L,
}

/// Force law at points of which one at least is on the ground.
struct Touch<'a, S: Simd> {
    below: &'a Below<S::Lanes>,
    sole: &'a Sole<S::Lanes>,
    velocity: [S::Lanes; 3],
    bristle: [S::Lanes; 2],
}

impl<S: Simd> Task for Touch<'_, S> {
    type Output = Footforce<S::Lanes>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        self.below.force(self.sole, self.velocity, self.bristle)
    }
}

/// Returns the force on points; that of the law, which is none in the air.
#[inline(always)]
fn touch<S: Simd<Lanes = L>, L: Lanes>(
    simd: S,
    below: &Below<L>,
    sole: &Sole<L>,
    velocity: [L; 3],
    bristle: [L; 2],
) -> Footforce<L> {
    let zero = below.gap.zero();
    if below.gap.any(zero.gt(below.gap)) {
        return simd.call(Touch::<S> {
            below,
            sole,
            velocity,
            bristle,
        });
    }
    Footforce {
        force: [zero; 3],
        force_in_world: [zero; 3],
        bristle_rate: Sole::relaxation(bristle),
        dissipated: sole.relaxed_power(bristle),
        depth: -below.gap,
    }
}

impl<L: Lanes> BodyPoints<L> {
    /// Returns the force on knees or ankles at `point`.
    #[inline(always)]
    pub fn on_joint<S: Simd<Lanes = L>>(
        &self,
        simd: S,
        (ground, trunk): (&Ground, &TrunkMotion),
        point: &Point<L>,
        bristle: [L; 2],
    ) -> Footforce<L> {
        let below = Below::new(simd, ground, trunk, point);
        touch(simd, &below, &self.joints, point.velocity, bristle)
    }

    /// Returns the force on the trunk.
    #[inline(always)]
    pub fn on_trunk<S: Simd<Lanes = L>>(
        &self,
        simd: S,
        (ground, trunk): (&Ground, &TrunkMotion),
        state: &BodyContact<L>,
    ) -> TrunkForce<L> {
        let zero = state.on_trunk.zero();
        let (mut force, mut torque, mut rates) = ([zero; 3], [zero; 3], state.corners);
        let (mut dissipated, mut compressed) = (zero, zero);
        for (level, rate) in rates.iter_mut().enumerate() {
            let point = self.corner(level, trunk);
            let below = Below::new(simd, ground, trunk, &point);
            let pressed = touch(
                simd,
                &below,
                &self.trunk,
                point.velocity,
                state.corners[level],
            );
            let ([x, y, z], [fx, fy, fz]) = (point.place, pressed.force);
            force = [force[0] + fx, force[1] + fy, force[2] + fz];
            torque = [
                torque[0] + (y * fz - z * fy),
                torque[1] + (z * fx - x * fz),
                torque[2] + (x * fy - y * fx),
            ];
            *rate = pressed.bristle_rate;
            dissipated += pressed.dissipated;
            compressed += if_compressed(CORNERS + level, pressed.depth);
        }
        let [fx, fy, fz, _] = L::sums([force[0], force[1], force[2], zero]).quad().0;
        let [roll, pitch, yaw, _] = L::sums([torque[0], torque[1], torque[2], zero]).quad().0;
        TrunkForce {
            wrench: [fx, fy, fz, roll, pitch, yaw],
            force_in_world: into_world(&trunk.rotation, [fx, fy, fz]),
            rates,
            dissipated,
            compressed,
        }
    }

    /// Returns the lower (0) or the upper corners.
    #[inline(always)]
    fn corner(&self, level: usize, trunk: &TrunkMotion) -> Point<L> {
        let place = self.corners[level];
        let [x, y, z] = place;
        let [vx, vy, vz] = broadcast(x, trunk.velocity);
        let [wx, wy, wz] = trunk.turning;
        let velocity = [
            vx + (z * wy - y * wz),
            vy + (x * wz - z * wx),
            vz + (y * wx - x * wy),
        ];
        Point { place, velocity }
    }

    /// Returns the energy of elements and bristles of the trunk \[J\].
    #[inline(always)]
    pub fn energy_of_trunk<S: Simd<Lanes = L>>(
        &self,
        simd: S,
        (ground, trunk): (&Ground, &TrunkMotion),
        state: &BodyContact<L>,
    ) -> L {
        let mut energy = state.on_trunk.zero();
        for level in 0..2 {
            let point = self.corner(level, trunk);
            let depth = -Below::new(simd, ground, trunk, &point).gap;
            energy += self.trunk.energy(depth, state.corners[level]);
        }
        energy
    }

    /// Returns the energy of elements and bristles of knees or ankles at `point` \[J\].
    #[inline(always)]
    pub fn energy_of_joint<S: Simd<Lanes = L>>(
        &self,
        simd: S,
        (ground, trunk): (&Ground, &TrunkMotion),
        point: &Point<L>,
        bristle: [L; 2],
    ) -> L {
        let depth = -Below::new(simd, ground, trunk, point).gap;
        self.joints.energy(depth, bristle)
    }

    /// Returns depth and its rate of knees or ankles at `point` \[m, m/s\].
    #[inline(always)]
    pub fn motion_of_joint<S: Simd<Lanes = L>>(
        &self,
        simd: S,
        (ground, trunk): (&Ground, &TrunkMotion),
        point: &Point<L>,
    ) -> [L; 2] {
        let below = Below::new(simd, ground, trunk, point);
        [-below.gap, -below.gap_rate(point.velocity)]
    }

    /// Returns depth and its rate of the lower (0) or the upper corners \[m, m/s\].
    #[inline(always)]
    pub fn motion_of_corners<S: Simd<Lanes = L>>(
        &self,
        simd: S,
        (ground, trunk): (&Ground, &TrunkMotion),
        level: usize,
    ) -> [L; 2] {
        let point = self.corner(level, trunk);
        let below = Below::new(simd, ground, trunk, &point);
        [-below.gap, -below.gap_rate(point.velocity)]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use twinrig_robot::OneSided;

    use super::*;
    use crate::friction::Approach;
    use crate::lanes::{Features, Kernel, dispatch};

    /// Rates of the bristles and dissipated power in the air, by the short way and by the law.
    struct InTheAir {
        sole: Sole<Quad>,
        gap: Quad,
        gap_rate: Quad,
        slip: [Quad; 2],
        bristle: [Quad; 2],
    }

    impl Kernel for InTheAir {
        type Output = [[Quad; 3]; 2];

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Self::Output {
            let (sole, bristle) = (self.sole.load(simd), simd.load_all(&self.bristle));
            let [x, y] = Sole::relaxation(bristle);
            let short = [x, y, sole.relaxed_power(bristle)];
            let grip = sole.grip(&Approach {
                gap: simd.load(self.gap),
                gap_rate: simd.load(self.gap_rate),
                slip: simd.load_all(&self.slip),
                bristle,
            });
            let [x, y] = grip.bristle_rate;
            [short, [x, y, grip.dissipated]].map(|values| values.map(Lanes::quad))
        }
    }

    proptest! {
        #[test]
        fn short_way_in_the_air_is_the_law(
            gap in 1e-9..0.1_f64, gap_rate in -5.0..5.0_f64,
            slip in prop::array::uniform2(-3.0..3.0_f64),
            bristle in prop::array::uniform2(-1e-3..1e-3_f64),
        ) {
            let side = OneSided { stiffness: 10e3, damping: 40.0, toe_region: 0.2e-3 };
            let sole = Sole::new(Element::side_by_side([side; LANES]), 0.6, &[0.3e-3; LANES]);
            let [short, law] = dispatch(Features::Detected, InTheAir {
                sole,
                gap: Quad::splat(gap),
                gap_rate: Quad::splat(gap_rate),
                slip: slip.map(Quad::splat),
                bristle: bristle.map(Quad::splat),
            });
            prop_assert_eq!(short, law);
        }
    }
}
