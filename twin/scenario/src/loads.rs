//! Payloads of the trunk, and surfaces of the ground.

use std::ops::Range;

use twinrig_kernel::SimTime;

/// `[[surface]]`: friction of the ground over an extent along x, for a time.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceSpec {
    /// Coulomb friction coefficient.
    pub friction: f64,
    /// Extent along x from the start; infinite where it is open \[m\].
    pub extent: Range<f64>,
    /// The time from which it applies.
    pub begin: SimTime,
    /// The time from which it applies no more; none for the rest of the run.
    pub end: Option<SimTime>,
}

/// `[[payload]]`: a point mass on the trunk.
#[derive(Clone, Debug, PartialEq)]
pub struct PayloadSpec {
    /// Name, for `twin plan`.
    pub name: String,
    /// \[kg\]
    pub mass: f64,
    /// Place in trunk axes, from the trunk's centre of mass \[m\].
    pub at: [f64; 3],
}
