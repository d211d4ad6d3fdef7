//! Contact point of a leg.

use nalgebra::Vector3;
use twinrig_contact::{Ground, Surface};

use crate::model::articulated::Row;
use crate::model::chain::Chain;
use crate::model::constants::Constants;
use crate::model::real::Real;
use crate::model::rotation::{Rotation, into_trunk, into_world};
use crate::model::state::State;
use crate::model::trunk::cross;

/// Position, velocity and bias acceleration of a leg point, in trunk axes, relative to the trunk's
/// centre of mass.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Site<T, const N: usize> {
    pub(crate) leg: usize,
    pub(crate) point: [T; 3],
    pub(crate) velocity: [T; 3],
    /// Acceleration at constant velocities of trunk and links.
    pub(crate) bias: [T; 3],
    /// Velocity per unit rate of each link: forward and up.
    arms: [[T; 2]; N],
}

/// Ground below a site.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Footing<T> {
    pub(crate) gap: T,
    /// Normal and two tangents of the ground, trunk axes.
    pub(crate) directions: [[T; 3]; 3],
    /// Velocity of the site along `directions`.
    pub(crate) velocity: [T; 3],
    /// Acceleration of the site along `directions` at constant velocities of trunk and links,
    /// including the curvature of the ground.
    pub(crate) bias: [T; 3],
    pub(crate) surface: Surface,
}

impl<T: Real<Sum = T>, const N: usize> Site<T, N> {
    /// Computes the end of the first `links` links of a leg. The velocity of a fixed trunk is zero.
    pub(crate) fn new<R: Real<Sum = T>>(
        legs: &Constants<R, N>,
        chain: &Chain<R, N>,
        state: &State<R, N>,
        leg: usize,
        links: usize,
    ) -> Self {
        let turns = [&chain.sines, &chain.cosines, &chain.rates];
        Self::from_turns(legs, turns, [state.velocity, state.turning], leg, links)
    }

    /// Computes the same from sines, cosines and rates of the links, and the velocities of the
    /// trunk.
    pub(crate) fn from_turns<R: Real<Sum = T>>(
        legs: &Constants<R, N>,
        [sines, cosines, rates]: [&[R; N]; 3],
        [v, w]: [[T; 3]; 2],
        leg: usize,
        links: usize,
    ) -> Self {
        let mut point = legs.hip.map(|x| x.lane(leg));
        let (mut relative, mut inward) = ([T::zero(); 3], [T::zero(); 2]);
        let mut arms = [[T::zero(); 2]; N];
        for (i, arm) in arms.iter_mut().enumerate().take(links) {
            let length = legs.links[i].lane(leg);
            let (s, c) = (sines[i].lane(leg), cosines[i].lane(leg));
            let rate = rates[i].lane(leg);
            *arm = [length * c, length * s];
            point[0] += length * s;
            point[2] -= length * c;
            relative[0] += arm[0] * rate;
            relative[2] += arm[1] * rate;
            inward[0] -= length * s * rate * rate;
            inward[1] += length * c * rate * rate;
        }
        let rotational = cross(w, point);
        let sums: [T; 3] = std::array::from_fn(|i| v[i] + rotational[i] + relative[i]);
        // ω × v + ω × (ω × r) + 2 ω × ṙ
        let twice: [T; 3] =
            std::array::from_fn(|i| v[i] + rotational[i] + T::splat(2.0) * relative[i]);
        let mut bias = cross(w, twice);
        bias[0] += inward[0];
        bias[2] += inward[1];
        Self {
            leg,
            point,
            velocity: sums,
            bias,
            arms,
        }
    }

    /// Returns the Jacobian row of a direction in trunk axes.
    pub(crate) fn row(&self, direction: [T; 3]) -> Row<T, N> {
        let turn = cross(self.point, direction);
        let [x, y, z] = direction;
        Row {
            leg: self.leg,
            trunk: [x, y, z, turn[0], turn[1], turn[2]],
            links: self.arms.map(|arm| arm[0] * x + arm[1] * z),
        }
    }

    /// Returns the position of the site in the world frame.
    pub(crate) fn in_world(&self, position: [T; 3], rotation: &Rotation<T>) -> [T; 3] {
        let offset = into_world(rotation, self.point);
        std::array::from_fn(|i| position[i] + offset[i])
    }

    /// Returns the ground below the site. Its curvature is in the acceleration; derivatives by dual
    /// numbers are those of the tangent plane.
    pub(crate) fn footing(
        &self,
        ground: &Ground,
        position: [T; 3],
        rotation: &Rotation<T>,
    ) -> Footing<T> {
        let dot = |a: [T; 3], b: [T; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let world = self.in_world(position, rotation);
        let plain = Vector3::from(world.map(T::plain));
        let surface = ground.below(&plain);
        let [along, across] = surface.tangents();
        let directions = [surface.normal, along, across].map(|d| {
            let d: [f64; 3] = d.into();
            into_trunk(rotation, d.map(T::splat))
        });
        let moved = Vector3::from(into_world(rotation, self.velocity).map(T::plain));
        let curvature = ground.normal_rate(&plain, &moved).dot(&moved);
        let mut gap = T::splat(surface.gap);
        for i in 0..3 {
            gap += T::splat(surface.normal[i]) * (world[i] - T::splat(plain[i]));
        }
        let mut bias = directions.map(|d| dot(d, self.bias));
        bias[0] += T::splat(curvature);
        Footing {
            gap,
            directions,
            velocity: directions.map(|d| dot(d, self.velocity)),
            bias,
            surface,
        }
    }
}
