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
    /// A step is shorter than is reasonable.
    #[error("a step of {longest_s:.1e} s is too short: choose one of {least_s:.1e} s or longer")]
    Fine {
        /// Greatest length of a substep \[s\].
        longest_s: f64,
        /// Least one that is possible \[s\].
        least_s: f64,
    },
}
