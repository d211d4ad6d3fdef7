//! Contact points of the legs.

use twinrig_compliant::frame::Rotation;
use twinrig_compliant::lanes::{Kernel, Lanes, Quad, Simd};
use twinrig_compliant::{LegFrame, Point, TrunkMotion, Turns, broadcast};

use super::model::{CompliantModel, Legs};
use super::state::State;

/// End of a chain of links: in trunk axes, and its place in leg axes.
pub(crate) struct End<L> {
    pub(crate) place: [L; 3],
    pub(crate) point: Point<L>,
}

/// Carriers of the legs: the trunk, or a frame for each.
#[derive(Clone, Copy)]
pub(crate) enum Carriers<'a, L> {
    Trunk(&'a TrunkMotion),
    Frame(&'a LegFrame<L>),
}

impl<'a, L> Carriers<'a, L> {
    /// Returns the frames of the legs, if they have joints of abduction, or else the trunk.
    #[inline(always)]
    pub(crate) fn new(frame: Option<&'a LegFrame<L>>, trunk: &'a TrunkMotion) -> Self {
        frame.map_or(Self::Trunk(trunk), Self::Frame)
    }
}

/// Computes the end of the first `links` links.
#[inline(always)]
pub(crate) fn end_of<L: Lanes, const N: usize, const P: usize, const A: usize, const B: usize>(
    legs: &Legs<L, N, A>,
    turns: &Turns<L, N>,
    state: &State<L, N, P, A, B>,
    links: usize,
    carrier: Carriers<'_, L>,
) -> End<L> {
    let [mut x, y, mut z] = legs.hip;
    let (mut vx, mut vz) = (x.zero(), x.zero());
    for j in 0..links {
        let length = legs.pantographs.links[j];
        let (ahead, up) = (length * turns.cosines[j], length * turns.sines[j]);
        x += up;
        z -= ahead;
        vx += ahead * state.rates[j];
        vz += up * state.rates[j];
    }
    let place = [x, y, z];
    let point = match carrier {
        Carriers::Frame(frame) => frame.point(place, [vx, vz]),
        Carriers::Trunk(trunk) => {
            let ([wx, wy, wz], v) = (trunk.turning, trunk.velocity);
            Point {
                place,
                velocity: [
                    vx + (z * wy - y * wz + v[0]),
                    x * wz - z * wx + v[1],
                    vz + (y * wx - x * wy + v[2]),
                ],
            }
        }
    };
    End { place, point }
}

/// Computation of the ends of the first `links` links: positions \[m\] and velocities \[m/s\],
/// world frame.
pub(crate) struct Ends<'a, const N: usize, const P: usize, const A: usize, const B: usize> {
    pub(crate) model: &'a CompliantModel<N, A>,
    pub(crate) state: &'a State<Quad, N, P, A, B>,
    pub(crate) links: usize,
}

impl<const N: usize, const P: usize, const A: usize, const B: usize> Kernel
    for Ends<'_, N, P, A, B>
{
    type Output = [[Quad; 3]; 2];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let state = self.state.load(simd);
        let legs = self.model.legs.load(simd);
        let trunk = TrunkMotion::new(state.trunk());
        let turns = Turns::new(&state.angles);
        let frame = legs.frame(&state, &trunk);
        let carrier = Carriers::new(frame.as_ref(), &trunk);
        let end = end_of(&legs, &turns, &state, self.links, carrier).point;
        let zero = state.pulley.zero();
        let [x, y, z] = broadcast(zero, trunk.position);
        let [dx, dy, dz] = turned(&trunk.rotation, end.place);
        let [u, v, w] = turned(&trunk.rotation, end.velocity);
        [
            [(x + dx).quad(), (y + dy).quad(), (z + dz).quad()],
            [u.quad(), v.quad(), w.quad()],
        ]
    }
}

/// Transforms a vector of each leg from trunk to world axes.
#[inline(always)]
fn turned<L: Lanes>([a, b, c]: &Rotation, [x, y, z]: [L; 3]) -> [L; 3] {
    [
        x * a[0] + y * a[1] + z * a[2],
        x * b[0] + y * b[1] + z * b[2],
        x * c[0] + y * c[1] + z * c[2],
    ]
}
