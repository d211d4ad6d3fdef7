//! What can be wrong with a leg or a pose.

/// Why a leg or a pose of it does not exist.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum LegError {
    /// A parameter of the leg makes no pantograph.
    #[error("{parameter} = {value}: {why}")]
    Geometry {
        /// Name of the parameter.
        parameter: &'static str,
        /// Its value (SI).
        value: f64,
        /// What it has to be.
        why: &'static str,
    },
    /// The foot is farther from the hip, or closer to it, than the leg can reach.
    #[error(
        "the foot is {length:.6} m from the hip; the leg reaches {least:.6} to {greatest:.6} m"
    )]
    OutOfReach {
        /// Distance from hip to foot \[m\].
        length: f64,
        /// Shortest leg \[m\].
        least: f64,
        /// Longest leg \[m\].
        greatest: f64,
    },
    /// With this hip angle, knee and foot are too far apart, or too close, for the two segments between them.
    #[error(
        "knee and foot are {distance:.6} m apart; the two segments between them span {least:.6} to {greatest:.6} m"
    )]
    NoTriangle {
        /// Distance from knee to foot \[m\].
        distance: f64,
        /// Shortest span \[m\].
        least: f64,
        /// Longest span \[m\].
        greatest: f64,
    },
    /// A length has no angle: the cosine it asks for lies outside [-1, 1].
    #[error("no angle has the cosine {cosine} that {what} = {value:.6} m asks for")]
    NoAngle {
        /// The length in question.
        what: &'static str,
        /// Its value \[m\].
        value: f64,
        /// The cosine it asks for.
        cosine: f64,
    },
    /// Middle and distal segment are in line: foot forces do not fix the forces in the segments.
    #[error(
        "the leg is straight at the ankle (sine of the angle {sine:e}): its statics are singular"
    )]
    Straight {
        /// Sine of the ankle angle.
        sine: f64,
    },
    /// An argument is NaN or infinite.
    #[error("{what} is not a number")]
    NotFinite {
        /// The argument.
        what: &'static str,
    },
}
