use thiserror::Error;

/// Sensor that cannot be simulated or mounted.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SensorError {
    /// The time constants of amplifier and silicone are equal.
    #[error(
        "the time constants of amplifier and silicone, {amplifier} s and {silicone} s, are equal: separate them by a thousandth"
    )]
    EqualTimes {
        /// Time constant of the amplifier \[s\].
        amplifier: f64,
        /// Time constant of the silicone \[s\].
        silicone: f64,
    },
    /// The plant has no load at which the sensor could be mounted.
    #[error(
        "the plant has no force `{signal}` of one component, at which a sensor could be mounted"
    )]
    NoLoad {
        /// Name of the signal.
        signal: String,
    },
}
