//! Bounds of unknowns.

/// Admissible set of an unknown, and the complementarity condition that comes with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bound {
    /// Unbounded: `w = 0`.
    Free,
    /// `0 ≤ z ⊥ w ≥ 0`.
    NonNegative,
    /// `low ≤ z ≤ high`; `w` is zero inside, ≥ 0 at `low`, ≤ 0 at `high`.
    Between {
        /// Lower bound.
        low: f64,
        /// Upper bound.
        high: f64,
    },
    /// This unknown and the next are a friction force: `|z| ≤ friction · z[normal]`, with `w`
    /// antiparallel to `z` where it slips (Coulomb's law; maximum dissipation).
    Disc {
        /// Index of the normal force.
        normal: usize,
        /// Coulomb coefficient.
        friction: f64,
    },
    /// Second component of the preceding [`Bound::Disc`], set together with it.
    DiscSecond,
}

/// Position of an unknown relative to its bound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum BoundState {
    Inside,
    Low,
    High,
    /// On the border of the disc in this direction; the share is the ratio of the radius to the
    /// distance of the projected point from the centre.
    Slipping {
        /// Unit vector.
        direction: [f64; 2],
        /// At most one.
        share: f64,
    },
}
