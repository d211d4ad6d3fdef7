//! Contact impulses, read from the engine.

use rapier3d_f64::geometry::{ColliderHandle, PairContacts};
use rapier3d_f64::math::Vector;

use crate::robot::Machine;

impl Machine {
    /// Returns the ground's impulse on a foot in the last step: normal and tangential part \[N·s\].
    pub(crate) fn impulse_on(
        &self,
        foot: ColliderHandle,
        floor: ColliderHandle,
    ) -> Option<(Vector, Vector)> {
        let pair = self.world.sets.narrow_phase.contact_pair(foot, floor)?;
        let PairContacts::Rigid(contacts) = &pair.contacts else {
            return None;
        };
        // The engine's normals point from the first collider to the second; impulses separate the
        // two.
        let sign = if pair.collider1 == foot { -1.0 } else { 1.0 };
        let (mut normal, mut along) = (Vector::ZERO, Vector::ZERO);
        for manifold in &contacts.manifolds {
            for point in &manifold.points {
                let data = &point.data;
                normal += manifold.data.normal * (sign * data.impulse);
                // Over its substeps, the engine reports the direction of the last tangential
                // impulse and the magnitude of all.
                let last = data.warmstart_tangent_world;
                let (size, all) = (last.length(), data.tangent_impulse.norm());
                if size > 0.0 {
                    along -= last * (sign * all / size);
                }
            }
        }
        Some((normal, along))
    }
}
