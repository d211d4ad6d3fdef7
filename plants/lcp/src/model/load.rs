//! Generalised forces of pushes.

use twinrig_legged::ExternalLoad;

use crate::model::constants::Constants;
use crate::model::real::{Lanes, Real, Wide};
use crate::model::rotation::Rotation;
use crate::model::state::State;
use crate::model::trunk::{Spatial, cross};

/// Number of links above the foot.
const FOOT: usize = 3;

/// Load of pushes at one instant, in the number type of the legs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Load<R> {
    trunk: ExternalLoad,
    /// Forces on the feet by leg, world axes \[N\].
    feet: [R; 3],
}

/// Generalised forces of a load: Jᵀ f of the feet's Jacobian, and the wrench on the trunk.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PushForces<R: Real, const N: usize> {
    /// Torques on the links \[N·m\].
    pub(crate) links: [R; N],
    /// Force and torque on the trunk, those on the feet included, trunk axes.
    pub(crate) trunk: Spatial<R::Sum>,
}

impl<R: Wide> Load<R> {
    pub(crate) fn new(load: &ExternalLoad) -> Self {
        let component = |i: usize| R::of(Lanes::new(load.feet.map(|force| force[i])));
        Self {
            trunk: *load,
            feet: [0, 1, 2].map(component),
        }
    }
}

impl<R: Real> Load<R> {
    /// Computes the generalised forces in a pose, given by sines and cosines of the links.
    pub(crate) fn forces<const N: usize>(
        &self,
        legs: &Constants<R, N>,
        [sines, cosines]: [&[R; N]; 2],
        rotation: &Rotation<R::Sum>,
    ) -> PushForces<R, N> {
        let [fx, fy, fz] = [0, 1, 2].map(|i| {
            let mut sum = R::zero();
            for (row, force) in rotation.iter().zip(self.feet) {
                sum += R::broadcast(row[i]) * force;
            }
            sum
        });
        let (mut foot, mut links) = (legs.hip, [R::zero(); N]);
        for j in 0..FOOT {
            let [ahead, up] = [cosines[j], sines[j]].map(|n| legs.links[j] * n);
            foot[0] += up;
            foot[2] -= ahead;
            links[j] = ahead * fx + up * fz;
        }
        let mut trunk = self.trunk.wrench(rotation, <R::Sum as Real>::splat);
        let force = [fx, fy, fz];
        let torque = cross(foot, force);
        for i in 0..3 {
            trunk[i] += force[i].sum();
            trunk[3 + i] += torque[i].sum();
        }
        PushForces { links, trunk }
    }
}

impl<R: Real, const N: usize> PushForces<R, N> {
    /// Returns the power at the velocities of a state, by leg, that on the trunk in the first lane.
    pub(crate) fn power(&self, state: &State<R, N>) -> R {
        let mut on_links = R::zero();
        for (torque, rate) in self.links.iter().zip(state.rates) {
            on_links += *torque * rate;
        }
        let mut sum = on_links.lane(0);
        let twist = state.velocity.iter().chain(&state.turning);
        for (force, velocity) in self.trunk.iter().zip(twist) {
            sum += *force * *velocity;
        }
        on_links.with_lane(0, sum)
    }
}
