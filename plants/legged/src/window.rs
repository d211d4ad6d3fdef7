//! The time over which ground forces are means.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::LEGS;

/// Ground impulses at the start of the present window, and when that was.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Window {
    begun_s: f64,
    impulses: [[f64; 3]; LEGS],
}

impl Window {
    /// Begins anew at `now_s` \[s\] with the impulses of the ground on each leg since the start \[N·s\].
    pub fn begin<'i>(&mut self, now_s: f64, impulses: impl IntoIterator<Item = &'i [f64; 3]>) {
        self.begun_s = now_s;
        for (before, now) in self.impulses.iter_mut().zip(impulses) {
            *before = *now;
        }
    }

    /// Mean force on a leg since the window began \[N\], from the impulse since the start \[N·s\]; zero as it begins.
    pub fn mean_force(&self, leg: usize, impulse: &[f64; 3], now_s: f64) -> Vector3<f64> {
        let elapsed_s = now_s - self.begun_s;
        if elapsed_s > 0.0 {
            (Vector3::from(*impulse) - Vector3::from(self.impulses[leg])) / elapsed_s
        } else {
            Vector3::zeros()
        }
    }
}
