//! Ground contact of one point of each leg.

use nalgebra::Vector3;
use twinrig_compliant::lanes::{LANES, Lanes, Quad, Simd};
use twinrig_compliant::{Approach, Sole};
use twinrig_contact::{Ground, Terrain};
use twinrig_robot::GRAVITY;

use super::chain::Turns;
use super::model::{CompliantModel, Legs};
use super::state::State;
use crate::articulated::{Rotation, rotation};
use crate::trunk::cross;

/// Motion of the trunk.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TrunkMotion {
    pub(crate) rotation: Rotation<f64>,
    pub(crate) position: [f64; 3],
    pub(crate) velocity: [f64; 3],
    pub(crate) turning: [f64; 3],
    /// g − ω × v, trunk axes \[m/s²\].
    pub(crate) field: [f64; 3],
}

/// Returns the first three lanes.
#[inline(always)]
fn first_three<L: Lanes>(lanes: L) -> [f64; 3] {
    let [x, y, z, _] = lanes.quad().0;
    [x, y, z]
}

impl TrunkMotion {
    #[inline(always)]
    pub(crate) fn new<L: Lanes, const N: usize, const P: usize>(state: &State<L, N, P>) -> Self {
        let rotation = rotation(state.attitude.quad().0);
        let (velocity, turning) = (first_three(state.velocity), first_three(state.turning));
        let turned = cross(turning, velocity);
        Self {
            position: first_three(state.position),
            velocity,
            turning,
            field: [
                -GRAVITY * rotation[2][0] - turned[0],
                -GRAVITY * rotation[2][1] - turned[1],
                -GRAVITY * rotation[2][2] - turned[2],
            ],
            rotation,
        }
    }
}

/// Contact point in trunk axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Point<L> {
    /// Position relative to the centre of mass of the trunk \[m\], and velocity \[m/s\].
    pub(crate) place: [L; 3],
    pub(crate) velocity: [L; 3],
}

impl<L: Lanes> Point<L> {
    /// Computes the end of the first `links` links.
    #[inline(always)]
    pub(crate) fn new<const N: usize, const P: usize>(
        legs: &Legs<L, N>,
        turns: &Turns<L, N>,
        state: &State<L, N, P>,
        links: usize,
        trunk: &TrunkMotion,
    ) -> Self {
        let [mut x, y, mut z] = legs.hip;
        let (mut vx, mut vz) = (x.zero(), x.zero());
        for j in 0..links {
            let (ahead, up) = (
                legs.links[j] * turns.cosines[j],
                legs.links[j] * turns.sines[j],
            );
            x += up;
            z -= ahead;
            vx += ahead * state.rates[j];
            vz += up * state.rates[j];
        }
        let ([wx, wy, wz], v) = (trunk.turning, trunk.velocity);
        Self {
            place: [x, y, z],
            velocity: [
                vx + (z * wy - y * wz + v[0]),
                x * wz - z * wx + v[1],
                vz + (y * wx - x * wy + v[2]),
            ],
        }
    }
}

impl<const N: usize> CompliantModel<N> {
    /// Returns the ground at a contact point.
    #[inline(always)]
    pub(crate) fn below<S: Simd>(
        &self,
        simd: S,
        trunk: &TrunkMotion,
        point: &Point<S::Lanes>,
    ) -> Below<S::Lanes> {
        match &self.rigid.ground {
            Some(ground) if !matches!(ground.terrain, Terrain::Flat) => {
                Below::shaped(simd, ground, &trunk.rotation, trunk.position, point)
            }
            _ => Below::level(&trunk.rotation, simd.splat(trunk.position[2]), point),
        }
    }
}

/// Ground at a contact point: distance \[m\], and its gradient and the two tangents in trunk axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Below<L> {
    pub(crate) gap: L,
    pub(crate) directions: [[L; 3]; 3],
    /// The same in the world frame; none where they are up, ahead and left.
    in_world: Option<[[L; 3]; 3]>,
}

/// Force of the ground on a contact point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Footforce<L> {
    /// Trunk axes, and world frame \[N\].
    pub(crate) force: [L; 3],
    pub(crate) force_in_world: [L; 3],
    pub(crate) bristle_rate: [L; 2],
    pub(crate) dissipated: L,
}

/// Returns a vector in all lanes.
#[inline(always)]
pub(crate) fn broadcast<L: Lanes>(like: L, [x, y, z]: [f64; 3]) -> [L; 3] {
    [like.like(x), like.like(y), like.like(z)]
}

#[inline(always)]
fn combine<L: Lanes>([n, a, b]: &[[L; 3]; 3], normal: L, [ahead, left]: [L; 2]) -> [L; 3] {
    [
        normal * n[0] + ahead * a[0] + left * b[0],
        normal * n[1] + ahead * a[1] + left * b[1],
        normal * n[2] + ahead * a[2] + left * b[2],
    ]
}

#[inline(always)]
fn dot<L: Lanes>(a: [L; 3], b: [L; 3]) -> L {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl<L: Lanes> Below<L> {
    /// Returns level ground at height zero.
    #[inline(always)]
    pub(crate) fn level(rotation: &Rotation<f64>, height: L, point: &Point<L>) -> Self {
        let [ahead, left, up] = *rotation;
        let [x, y, z] = point.place;
        Self {
            gap: height + x * up[0] + y * up[1] + z * up[2],
            directions: [
                broadcast(height, up),
                broadcast(height, ahead),
                broadcast(height, left),
            ],
            in_world: None,
        }
    }

    /// Returns shaped ground.
    pub(crate) fn shaped<S: Simd<Lanes = L>>(
        simd: S,
        ground: &Ground,
        rotation: &Rotation<f64>,
        position: [f64; 3],
        point: &Point<L>,
    ) -> Self {
        let place = point.place.map(|x| x.quad().0);
        let (mut gap, mut directions) = ([0.0; LANES], [[[0.0; LANES]; 3]; 3]);
        let mut in_world = directions;
        for lane in 0..LANES {
            let local = place.map(|x| x[lane]);
            let world: [f64; 3] = std::array::from_fn(|i| {
                let row = rotation[i];
                position[i] + row[0] * local[0] + row[1] * local[1] + row[2] * local[2]
            });
            let (surface, gradient) = ground.nearest(&Vector3::from(world));
            gap[lane] = surface.gap;
            let [ahead, left] = surface.tangents();
            for (k, world) in [gradient, ahead, left].into_iter().enumerate() {
                for i in 0..3 {
                    in_world[k][i][lane] = world[i];
                    directions[k][i][lane] = rotation[0][i] * world.x
                        + rotation[1][i] * world.y
                        + rotation[2][i] * world.z;
                }
            }
        }
        let load = |rows: [[[f64; LANES]; 3]; 3]| rows.map(|row| row.map(|x| simd.load(Quad(x))));
        Self {
            gap: simd.load(Quad(gap)),
            directions: load(directions),
            in_world: Some(load(in_world)),
        }
    }

    /// Returns the force on a point.
    #[inline(always)]
    pub(crate) fn force(&self, sole: &Sole<L>, velocity: [L; 3], bristle: [L; 2]) -> Footforce<L> {
        let [normal, along, across] = self.directions;
        let grip = sole.grip(&Approach {
            gap: self.gap,
            gap_rate: dot(normal, velocity),
            slip: [dot(along, velocity), dot(across, velocity)],
            bristle,
        });
        let [ahead, left] = grip.tangential;
        let force_in_world = match &self.in_world {
            None => [ahead, left, grip.normal],
            Some(directions) => combine(directions, grip.normal, grip.tangential),
        };
        Footforce {
            force: combine(&self.directions, grip.normal, grip.tangential),
            force_in_world,
            bristle_rate: grip.bristle_rate,
            dissipated: grip.dissipated,
        }
    }
}
