//! Motion of all feet at once, and the ground below them.

use twinrig_contact::Surface;
use twinrig_legged::{FootMotion, LEGS, surfaces_below};

use super::Model;
use super::constants::Constants;
use super::real::{Lanes, Real};
use super::rotation::{into_world, rotation};
use super::state::State;
use super::trunk::cross;

/// Vectors of all legs.
type Vectors = [Lanes; 3];

/// Returns position and velocity of the ends of the first `links` links of all legs, world
/// frame. A [`Site`](super::site::Site) has the same for one leg.
fn link_ends<const N: usize>(
    legs: &Constants<Lanes, N>,
    state: &State<Lanes, N>,
    links: usize,
) -> [Vectors; 2] {
    let mut point = legs.hip;
    let mut relative = [Lanes::zero(); 3];
    for i in 0..links {
        // The method of `Lanes` itself has other bits.
        let (sine, cosine) = Real::sin_cos(state.angles[i]);
        let [forward, up] = [legs.links[i] * cosine, legs.links[i] * sine];
        point[0] += up;
        point[2] -= forward;
        relative[0] += forward * state.rates[i];
        relative[2] += up * state.rates[i];
    }
    let [carried, turning] = [state.velocity, state.turning].map(|v| v.map(Lanes::splat));
    let rotational = cross(turning, point);
    let velocity = std::array::from_fn(|i| carried[i] + rotational[i] + relative[i]);
    let rotation = rotation(state.attitude).map(|row| row.map(Lanes::splat));
    let offset = into_world(&rotation, point);
    let position = std::array::from_fn(|i| Lanes::splat(state.position[i]) + offset[i]);
    [position, into_world(&rotation, velocity)]
}

/// Returns the motion of all feet in a state.
pub(crate) fn feet<const N: usize>(
    model: &Model<N>,
    state: &State<Lanes, N>,
) -> [FootMotion; LEGS] {
    foot_motions(&link_ends(&model.side_by_side, state, 3))
}

/// Returns the ground below each leg: of foot and toe, the point nearer to the ground is the
/// contact point.
pub(crate) fn surfaces<const N: usize>(
    model: &Model<N>,
    state: &State<Lanes, N>,
    feet: &[FootMotion; LEGS],
) -> [Surface; LEGS] {
    let ground = model.ground.as_ref();
    let mut surfaces = surfaces_below(ground, feet);
    for links in 4..=N {
        let tips = foot_motions(&link_ends(&model.side_by_side, state, links));
        for (surface, below) in surfaces.iter_mut().zip(surfaces_below(ground, &tips)) {
            if below.gap < surface.gap {
                *surface = below;
            }
        }
    }
    surfaces
}

/// Converts positions and velocities in lanes.
fn foot_motions(ends: &[Vectors; 2]) -> [FootMotion; LEGS] {
    let [position, velocity] = ends.map(|vectors| vectors.map(Lanes::to_array));
    std::array::from_fn(|leg| FootMotion {
        position: position.map(|lanes| lanes[leg]).into(),
        velocity: velocity.map(|lanes| lanes[leg]).into(),
    })
}
