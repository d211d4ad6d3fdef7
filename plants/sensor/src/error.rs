use thiserror::Error;

use crate::design::Effect;

/// Sensor that cannot be simulated, mounted, fitted or predicted.
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
    /// Two effects of a model have the same values in all cells.
    #[error("the design cannot distinguish {second} from {first}: name one of them")]
    Aliased {
        /// First effect.
        first: Effect,
        /// Second effect.
        second: Effect,
    },
    /// A model with as many coefficients as cells.
    #[error("{effects} effects and the constant leave no degree of freedom to 16 cells")]
    NoResidual {
        /// Number of effects.
        effects: u32,
    },
    /// A dimension of a cell is not positive and finite.
    #[error("the {what} of the cell is {value}; it must be positive")]
    Dimension {
        /// Name of the dimension.
        what: &'static str,
        /// Its value \[m, or layers\].
        value: f64,
    },
    /// Points to which no characteristic can be fitted.
    #[error("{found} points; three parameters require at least four, all finite")]
    Points {
        /// Number of points.
        found: usize,
    },
    /// Points whose conductance does not rise with the load.
    #[error("the conductance does not rise with the load")]
    NoRise,
}
