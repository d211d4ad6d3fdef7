//! Contact of the trunk with the ground.

use twinrig_compliant::lanes::{Lanes, Quad, Simd};
use twinrig_compliant::{BodyContact, BodyPoints, TrunkForce, TrunkMotion};
use twinrig_contact::Ground;
use twinrig_legged::Base;

use super::model::CompliantModel;
use super::state::State;

/// Corners of a trunk that moves, the ground below them, and their state.
pub(crate) struct Corners<'a, L> {
    points: BodyPoints<L>,
    ground: &'a Ground,
    contact: &'a BodyContact<L>,
}

impl<'a, L: Lanes> Corners<'a, L> {
    /// Returns the corners in a state, if they have contact.
    #[inline(always)]
    pub(crate) fn new<S: Simd<Lanes = L>, const A: usize, const B: usize>(
        simd: S,
        model: &'a CompliantModel<A>,
        state: &'a State<L, A, B>,
    ) -> Option<Self> {
        let contact = state.body.first()?;
        let (points, ground) = (model.body.as_ref()?, model.rigid.ground.as_ref()?);
        let moves = model.rigid.base != Base::Fixed;
        moves.then(|| Self {
            points: points.load(simd),
            ground,
            contact,
        })
    }

    /// Returns the force of the ground.
    #[inline(always)]
    pub(crate) fn force<S: Simd<Lanes = L>>(&self, simd: S, trunk: &TrunkMotion) -> TrunkForce<L> {
        self.points
            .on_trunk(simd, (self.ground, trunk), self.contact)
    }

    /// Returns the energy of elements and bristles \[J\].
    #[inline(always)]
    pub(crate) fn energy<S: Simd<Lanes = L>>(&self, simd: S, trunk: &TrunkMotion) -> L {
        self.points
            .energy_of_trunk(simd, (self.ground, trunk), self.contact)
    }

    /// Returns depth and its rate of the lower (0) or the upper corners \[m, m/s\].
    #[inline(always)]
    pub(crate) fn motion<S: Simd<Lanes = L>>(
        &self,
        simd: S,
        trunk: &TrunkMotion,
        level: usize,
    ) -> [L; 2] {
        self.points
            .motion_of_corners(simd, (self.ground, trunk), level)
    }
}

/// Returns the slope of the contact under a force.
#[inline(always)]
pub(crate) fn slope_under<S: Simd, const B: usize>(
    simd: S,
    force: Option<&TrunkForce<S::Lanes>>,
) -> [BodyContact<S::Lanes>; B] {
    let mut slope = [BodyContact::all(simd.splat(0.0)); B];
    if let (Some(force), Some(slope)) = (force, slope.first_mut()) {
        let [x, y, z] = force.force_in_world;
        slope.corners = force.rates;
        slope.on_trunk = simd.load(Quad([x, y, z, 0.0]));
    }
    slope
}
