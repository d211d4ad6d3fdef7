//! Contact points of trunk, knees and ankles.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use twinrig_legged::LEGS;

use crate::addresses::{BodyPoint, Place};
use crate::engine::Engine;
use crate::frame::{LegFrame, TrunkFrame};
use crate::leg_forces::contact_force;
use crate::model::Model;

/// Greatest number of points: two of each leg, and the corners of the trunk.
pub(crate) const POINTS: usize = 2 * LEGS + 8;

impl Place {
    /// Returns the leg of the point, if it is on one.
    pub(crate) fn leg(self) -> Option<usize> {
        match self {
            Self::Joint { leg, .. } => Some(leg),
            Self::Corner(_) => None,
        }
    }

    /// Returns position and velocity of the point, world axes.
    pub(crate) fn motion(
        self,
        model: &Model,
        trunk: &TrunkFrame,
        legs: &[Option<LegFrame>; LEGS],
    ) -> [Vector3<f64>; 2] {
        let [place, relative] = match self {
            Self::Corner(corner) => [corner.into(), Vector3::zeros()],
            Self::Joint { leg, segment } => {
                let (Some(frame), leg) = (&legs[leg], &model.legs[leg]) else {
                    return [Vector3::zeros(); 2];
                };
                frame.end(leg, segment)
            }
        };
        [
            trunk.position + trunk.rotation * place,
            trunk.point_velocity(&place, &relative),
        ]
    }
}

/// Velocities of the points, world axes \[m/s\].
pub(crate) type PointVelocities = [[f64; 3]; POINTS];

/// Returns the velocities of all points.
pub(crate) fn velocities(
    model: &Model,
    points: &[BodyPoint],
    trunk: &TrunkFrame,
    legs: &[Option<LegFrame>; LEGS],
) -> PointVelocities {
    let mut all = [[0.0; 3]; POINTS];
    for (velocity, point) in all.iter_mut().zip(points) {
        let [_, moved] = point.place.motion(model, trunk, legs);
        *velocity = moved.into();
    }
    all
}

/// Forces of the ground on the body beyond the feet, world axes, at an instant or as mean of a step
/// \[N\].
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct BodyForces {
    /// On knee and ankle of each leg.
    pub(crate) segments: [[f64; 3]; LEGS],
    /// On the trunk.
    pub(crate) trunk: [f64; 3],
}

impl BodyForces {
    /// Returns the forces, and their powers at these velocities of the points: of the normal
    /// forces, and of friction \[W\].
    pub(crate) fn new(
        engine: &Engine,
        points: &[BodyPoint],
        velocities: &PointVelocities,
    ) -> (Self, [f64; 2]) {
        let (mut forces, mut powers) = (Self::default(), [0.0; 2]);
        if points.is_empty() {
            return (forces, powers);
        }
        for (id, contact) in engine.data().contact().iter().enumerate() {
            let is_of = |point: &BodyPoint| {
                let mut geoms = contact.geom.iter();
                geoms.any(|geom| usize::try_from(*geom) == Ok(point.geom))
            };
            let Some(index) = points.iter().position(is_of) else {
                continue;
            };
            let BodyPoint { geom, place } = points[index];
            let parts = contact_force(engine, id, geom);
            let sum = match place.leg() {
                Some(leg) => &mut forces.segments[leg],
                None => &mut forces.trunk,
            };
            for (power, part) in powers.iter_mut().zip(parts) {
                for axis in 0..3 {
                    sum[axis] += part[axis];
                    *power += part[axis] * velocities[index][axis];
                }
            }
        }
        (forces, powers)
    }

    /// Adds another's forces times a weight.
    pub(crate) fn add(&mut self, weight: f64, other: &Self) {
        let sums = self.segments.iter_mut().chain([&mut self.trunk]);
        let others = other.segments.iter().chain([&other.trunk]);
        for (sum, other) in sums.zip(others) {
            for (sum, other) in sum.iter_mut().zip(other) {
                *sum += weight * other;
            }
        }
    }
}
