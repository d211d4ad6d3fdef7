//! Errors of leg geometry and poses.

/// Invalid leg parameters, or a pose that does not exist.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum LegError {
    /// A parameter does not permit a pantograph.
    #[error("{parameter} = {value}: {why}")]
    Geometry {
        /// Name of the parameter.
        parameter: &'static str,
        /// Its value (SI).
        value: f64,
        /// Requirement that it violates.
        why: &'static str,
    },
    /// The foot is beyond the greatest or within the least leg length.
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
    /// At this hip angle, knee and foot are too far apart or too close for the two segments between
    /// them.
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
    /// No angle corresponds to a length: its cosine lies outside [-1, 1].
    #[error("{what} = {value:.6} m corresponds to no angle: its cosine would be {cosine}")]
    NoAngle {
        /// Name of the length.
        what: &'static str,
        /// Its value \[m\].
        value: f64,
        /// The required cosine.
        cosine: f64,
    },
    /// Middle and distal segment are collinear: foot forces do not determine the forces in the
    /// segments.
    #[error(
        "the leg is straight at the ankle (sine of the angle {sine:e}): its statics are singular"
    )]
    Straight {
        /// Sine of the ankle angle.
        sine: f64,
    },
    /// An argument is NaN or infinite.
    #[error("{what} is not finite")]
    NotFinite {
        /// Name of the argument.
        what: &'static str,
    },
}
