//! Averaging window of ground forces.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::LEGS;

/// Impulses of the ground since the start of a run, world frame \[N·s\].
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct GroundImpulses {
    /// On the feet.
    pub feet: [[f64; 3]; LEGS],
    /// On knee and ankle of each leg.
    pub segments: [[f64; 3]; LEGS],
    /// On the trunk.
    pub trunk: [f64; 3],
}

/// Start time of the present window, and the ground impulses at that time.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Window {
    begun_s: f64,
    before: GroundImpulses,
}

impl Window {
    /// Starts a window at `now_s` \[s\] with these impulses.
    pub fn begin(&mut self, now_s: f64, impulses: GroundImpulses) {
        (self.begun_s, self.before) = (now_s, impulses);
    }

    /// Returns the start of the window \[s\].
    pub fn begun_s(&self) -> f64 {
        self.begun_s
    }

    /// Returns the mean of a force since the start of the window \[N\], from its impulse since the
    /// start of the run \[N·s\], which `of` selects; zero for an empty window.
    pub fn mean_force(
        &self,
        of: impl Fn(&GroundImpulses) -> [f64; 3],
        impulse: &[f64; 3],
        now_s: f64,
    ) -> Vector3<f64> {
        let elapsed_s = now_s - self.begun_s;
        if elapsed_s > 0.0 {
            (Vector3::from(*impulse) - Vector3::from(of(&self.before))) / elapsed_s
        } else {
            Vector3::zeros()
        }
    }
}
