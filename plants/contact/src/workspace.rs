//! Memory of the rarer methods of solution, which a problem keeps.

use crate::bound::Bound;
use crate::lemke::Lemke;

/// One variable x of the standard form.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Variable {
    /// Force in the direction `weights`: of an unknown and, where the second weight is not zero, of
    /// the next.
    Force { row: usize, weights: [f64; 2] },
    /// Slack of the force in column `of` up to its far bound.
    Slack { of: usize, width: f64 },
    /// Slip speed of the pyramid whose sides end at this column, under that normal force.
    Slip { normal: usize, share: f64 },
}

/// Problem in standard form, and the memory of its solver.
#[derive(Debug, Clone, Default)]
pub(crate) struct Direct {
    pub(crate) lemke: Lemke,
    pub(crate) variables: Vec<Variable>,
    /// Columns of the unknowns, for the lookup of normal forces.
    pub(crate) columns: Vec<usize>,
    pub(crate) base: Vec<f64>,
    /// Inverse square roots of the mobilities: scaled by them, G has a unit diagonal.
    pub(crate) units: Vec<f64>,
    /// Greatest offset in these units, and thus the order of magnitude of x.
    pub(crate) size: f64,
    pub(crate) x: Vec<f64>,
    pub(crate) diagonal: Vec<f64>,
    pub(crate) offset: Vec<f64>,
    pub(crate) unknowns: Vec<f64>,
}

/// Workspace of an impact.
#[derive(Debug, Clone, Default)]
pub(crate) struct Phases {
    pub(crate) bounds: Vec<Bound>,
    /// Impulses of the first phase, and the rates after it.
    pub(crate) first: Vec<f64>,
    pub(crate) rates: Vec<f64>,
}
