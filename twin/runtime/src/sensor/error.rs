use thiserror::Error;

use crate::TimingError;

/// A sensor that cannot be added to a rig.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SensorModelError {
    /// The process does not read the signal.
    #[error("{process} does not read it{}", did_you_mean(near))]
    NotRead {
        /// The process.
        process: String,
        /// Similar inputs.
        near: Vec<String>,
    },
    /// The signal has a sensor already.
    #[error("it has the sensor `{other}` already: combine both in one")]
    TwoSensors {
        /// The name of the other.
        other: String,
    },
    /// A rotation is neither quantised nor limited: the elements of a quaternion are no angles.
    #[error("it is a rotation, which has no `{key}`; noise, bias and random walk turn it")]
    OfRotation {
        /// The key.
        key: &'static str,
    },
    /// A parameter is out of its range.
    #[error("`{key}` is out of its range, {range}")]
    OutOfRange {
        /// The key.
        key: &'static str,
        /// The range.
        range: &'static str,
    },
    /// The delay is invalid.
    #[error("delay: {0}")]
    Delay(#[from] TimingError),
}

fn did_you_mean(near: &[String]) -> String {
    if near.is_empty() {
        String::new()
    } else {
        format!("; did you mean `{}`?", near.join("` or `"))
    }
}
