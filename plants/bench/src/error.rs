use thiserror::Error;
use twinrig_actuator::MotorError;

/// Bench that cannot be simulated.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum BenchError {
    /// Invalid motor.
    #[error("{0}")]
    Motor(#[from] MotorError),
    /// The maximum step is zero.
    #[error("the maximum step is zero")]
    Step,
}
