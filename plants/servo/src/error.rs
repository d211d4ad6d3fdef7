use thiserror::Error;

/// Parameters with which a servo cannot be simulated.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ServoBenchError {
    /// A step of the firmware would take more substeps than is reasonable.
    #[error(
        "the time constant of the motor, {time_constant_s:.1e} s, is too short for steps of {period_s:.1e} s"
    )]
    Stiff {
        /// Inertia over damping \[s\].
        time_constant_s: f64,
        /// Period of the controller \[s\].
        period_s: f64,
    },
}
