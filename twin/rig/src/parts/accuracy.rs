//! Settings of a plant that its numerical error depends on.

use twinrig_kernel::SimDuration;

/// Settings of a plant that its numerical error depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Accuracy {
    /// None: the plant evaluates closed forms.
    Exact,
    /// A step and, of a method with error control, a tolerance.
    Set {
        /// Greatest step.
        step: SimDuration,
        /// Tolerance, in the unit of the option `tolerance`.
        tolerance: Option<f64>,
    },
    /// The plant declares none.
    Unknown,
}
