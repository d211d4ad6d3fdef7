//! Averaging window of ground forces.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::LEGS;

/// Start time of the present window, and the ground impulses at that time.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Window {
    begun_s: f64,
    impulses: [[f64; 3]; LEGS],
}

impl Window {
    /// Starts a window at `now_s` \[s\] with the ground impulses on each leg since the start of the
    /// run \[N·s\].
    pub fn begin(&mut self, now_s: f64, impulses: impl IntoIterator<Item = [f64; 3]>) {
        self.begun_s = now_s;
        for (before, now) in self.impulses.iter_mut().zip(impulses) {
            *before = now;
        }
    }

    /// Returns the start of the window \[s\].
    pub fn begun_s(&self) -> f64 {
        self.begun_s
    }

    /// Returns the mean force on a leg since the start of the window \[N\], from the impulse since
    /// the start of the run \[N·s\]; zero for an empty window.
    pub fn mean_force(&self, leg: usize, impulse: &[f64; 3], now_s: f64) -> Vector3<f64> {
        let elapsed_s = now_s - self.begun_s;
        if elapsed_s > 0.0 {
            (Vector3::from(*impulse) - Vector3::from(self.impulses[leg])) / elapsed_s
        } else {
            Vector3::zeros()
        }
    }
}
