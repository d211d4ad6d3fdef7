//! Contact points of the legs.

use twinrig_compliant::lanes::Lanes;
use twinrig_compliant::{Point, TrunkMotion, Turns};

use super::model::Legs;
use super::state::State;

/// Computes the end of the first `links` links.
#[inline(always)]
pub(crate) fn end_of<L: Lanes, const N: usize, const P: usize>(
    legs: &Legs<L, N>,
    turns: &Turns<L, N>,
    state: &State<L, N, P>,
    links: usize,
    trunk: &TrunkMotion,
) -> Point<L> {
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
    let ([wx, wy, wz], v) = (trunk.turning, trunk.velocity);
    Point {
        place: [x, y, z],
        velocity: [
            vx + (z * wy - y * wz + v[0]),
            x * wz - z * wx + v[1],
            vz + (y * wx - x * wy + v[2]),
        ],
    }
}
