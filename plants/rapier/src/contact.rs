//! What the engine tells of its contacts.

use rapier3d_f64::geometry::{ColliderHandle, PairContacts};
use rapier3d_f64::math::Vector;

use crate::robot::Machine;

impl Machine {
    /// The impulse of the ground on a foot in the last step: along the normal, and across \[N·s\].
    pub(crate) fn impulse_on(
        &self,
        foot: ColliderHandle,
        floor: ColliderHandle,
    ) -> Option<(Vector, Vector)> {
        let pair = self.world.sets.narrow_phase.contact_pair(foot, floor)?;
        let PairContacts::Rigid(contacts) = &pair.contacts else {
            return None;
        };
        // To the engine, normals point from the first collider to the second, which impulses push apart.
        let sign = if pair.collider1 == foot { -1.0 } else { 1.0 };
        let (mut normal, mut along) = (Vector::ZERO, Vector::ZERO);
        for manifold in &contacts.manifolds {
            for point in &manifold.points {
                let data = &point.data;
                normal += manifold.data.normal * (sign * data.impulse);
                // Of the engine's substeps, it tells the last one's direction and all of their size.
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
