//! Contact of trunk, knees and ankles with the ground.

use twinrig_compliant::events::{ANKLE, CORNERS, ElementMotion, KNEE, if_compressed};
use twinrig_compliant::lanes::{LANES, Lanes, Quad, Simd};
use twinrig_compliant::{BodyContact, BodyPoints, TrunkMotion, Turns};
use twinrig_contact::Ground;
use twinrig_legged::Base;

use super::contact::{Carriers, end_of};
use super::evaluation::Evaluation;
use super::forces::Equations;
use super::model::{CompliantModel, Legs};
use super::state::State;

/// Slope of the contact of the body in one state.
pub(super) struct BodySlope<L, const B: usize> {
    /// Rates of the bristles \[m/s\], and forces \[N\].
    pub(super) rates: [BodyContact<L>; B],
    /// Dissipated power \[W\].
    pub(super) dissipated: L,
    /// Compressed elements.
    pub(super) compressed: L,
}

impl<S: Simd<Lanes = L>, L: Lanes, const N: usize, const P: usize, const A: usize, const B: usize>
    Evaluation<'_, S, N, P, A, B>
{
    /// Adds the forces of the ground on trunk, knees and ankles, if they have contact.
    #[inline(always)]
    pub(super) fn add_body_contact<const FREE: bool>(
        &self,
        ground: &Ground,
        turns: &Turns<L, N>,
        trunk: &TrunkMotion,
        equations: &mut Equations<L, N>,
    ) -> BodySlope<L, B> {
        let (simd, state) = (self.simd, self.state);
        let zero = state.pulley.zero();
        let mut slope = BodySlope {
            rates: [BodyContact::all(zero); B],
            dissipated: zero,
            compressed: zero,
        };
        let (Some(points), Some(contact)) = (&self.model.body, state.body.first()) else {
            return slope;
        };
        let (points, at) = (points.load(simd), (ground, trunk));
        let mut rates = BodyContact::all(zero);
        for joint in 0..2 {
            if !points.has_joints {
                break;
            }
            let links = joint + 1;
            let end = end_of(self.legs, turns, state, links, equations.carriers(trunk));
            let pressed = points.on_joint(simd, at, &end.point, contact.joints[joint]);
            self.add_force::<FREE>(turns, links, &end, pressed.force, equations);
            rates.joints[joint] = pressed.bristle_rate;
            for (sum, force) in rates.on_legs.iter_mut().zip(pressed.force_in_world) {
                *sum += force;
            }
            slope.dissipated += pressed.dissipated;
            slope.compressed += if_compressed([KNEE, ANKLE][joint], pressed.depth);
        }
        if FREE && self.model.base != Base::Fixed {
            let pressed = points.on_trunk(simd, at, contact);
            equations.add_on_trunk(pressed.wrench);
            rates.corners = pressed.rates;
            let [x, y, z] = pressed.force_in_world;
            rates.on_trunk = simd.load(Quad([x, y, z, 0.0]));
            slope.dissipated += pressed.dissipated;
            slope.compressed += pressed.compressed;
        }
        if let Some(first) = slope.rates.first_mut() {
            *first = rates;
        }
        slope
    }
}

/// Contact points of a body in a state.
pub(super) struct Body<'a, S: Simd, const N: usize, const P: usize, const A: usize, const B: usize>
{
    pub(super) simd: S,
    pub(super) legs: &'a Legs<S::Lanes, N, A>,
    pub(super) turns: &'a Turns<S::Lanes, N>,
    pub(super) state: &'a State<S::Lanes, N, P, A, B>,
    pub(super) ground: &'a Ground,
    pub(super) trunk: &'a TrunkMotion,
    pub(super) carriers: Carriers<'a, S::Lanes>,
    /// Whether the trunk moves.
    pub(super) is_free: bool,
}

impl<S: Simd<Lanes = L>, L: Lanes, const N: usize, const P: usize, const A: usize, const B: usize>
    Body<'_, S, N, P, A, B>
{
    /// Returns the points of a model, and their state, if there are any.
    #[inline(always)]
    fn points(&self, model: &CompliantModel<N, A>) -> Option<(BodyPoints<L>, &BodyContact<L>)> {
        Some((
            model.body.as_ref()?.load(self.simd),
            self.state.body.first()?,
        ))
    }

    /// Returns the energy of elements and bristles \[J\].
    #[inline(always)]
    pub(super) fn energy(&self, model: &CompliantModel<N, A>) -> L {
        let mut energy = self.state.pulley.zero();
        let Some((points, contact)) = self.points(model) else {
            return energy;
        };
        let at = (self.ground, self.trunk);
        for joint in 0..2 {
            if !points.has_joints {
                break;
            }
            let end = end_of(self.legs, self.turns, self.state, joint + 1, self.carriers);
            energy += points.energy_of_joint(self.simd, at, &end.point, contact.joints[joint]);
        }
        if self.is_free {
            energy += points.energy_of_trunk(self.simd, at, contact);
        }
        energy
    }

    /// Sets the motion of the elements of a model with this number of legs.
    #[inline(always)]
    pub(super) fn elements(
        &self,
        model: &CompliantModel<N, A>,
        count: usize,
        to: &mut ElementMotion,
    ) {
        let Some((points, _)) = self.points(model) else {
            return;
        };
        let at = (self.ground, self.trunk);
        for (joint, element) in [KNEE, ANKLE].into_iter().enumerate() {
            if !points.has_joints {
                break;
            }
            let end = end_of(self.legs, self.turns, self.state, joint + 1, self.carriers);
            let [depth, rate] = points.motion_of_joint(self.simd, at, &end.point);
            to.set(element, count, depth, rate);
        }
        for level in 0..2 {
            if self.is_free {
                let [depth, rate] = points.motion_of_corners(self.simd, at, level);
                to.set(CORNERS + level, LANES, depth, rate);
            }
        }
    }
}
