use std::fmt;
use std::ops::{Bound, RangeBounds};

use serde::{Deserialize, Serialize};
use thiserror::Error;
use twinrig_kernel::{SimDuration, Unit};

/// A parameter of a process that may be set during a run.
///
/// ```
/// use twinrig_kernel::Unit;
/// use twinrig_runtime::{Bound, ProcessVariable};
///
/// let open = (Bound::Excluded(0.0), Bound::Excluded(1.0));
/// let mut duty = ProcessVariable::new("duty", Unit::One, open, 0.5);
/// assert_eq!(duty.range_text(), "]0, 1[");
/// duty.set(0.4)?;
/// assert_eq!(duty.set(1.0).unwrap_err().to_string(), "duty = 1 is not in ]0, 1[");
/// assert_eq!(duty.value(), 0.4);
/// # Ok::<(), twinrig_runtime::VariableError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProcessVariable {
    name: String,
    unit: Unit,
    min: Bound<f64>,
    max: Bound<f64>,
    default: f64,
    value: f64,
}

/// Failure to set a process variable.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum VariableError {
    /// The value is out of range, infinite or NaN.
    #[error("{name} = {} is not in {range}", short(*value))]
    OutOfRange {
        /// The variable.
        name: String,
        /// The refused value, in its unit.
        value: f64,
        /// The permitted range: `]0, 1]` excludes 0 and includes 1.
        range: String,
    },
    /// The index is past the last variable.
    #[error("there is no process variable {index}, only {count}")]
    NoSuchIndex {
        /// The requested index.
        index: usize,
        /// Number of variables.
        count: usize,
    },
    /// The process refuses the value for another reason, such as the values of other variables.
    #[error("{name} = {} is refused: {why}", short(*value))]
    Refused {
        /// The variable.
        name: String,
        /// The refused value, in its unit.
        value: f64,
        /// The reason.
        why: String,
    },
}

impl ProcessVariable {
    /// Creates a variable with its range (`0.0..=1.0`, `0.1..`, `..`, or a pair of [`Bound`]s) and
    /// its default value, both in `unit`.
    ///
    /// # Panics
    /// If the default is out of range, which is a bug in the process that declares it.
    #[must_use]
    pub fn new(
        name: impl Into<String>,
        unit: Unit,
        range: impl RangeBounds<f64>,
        default: f64,
    ) -> Self {
        let variable = Self {
            name: name.into(),
            unit,
            min: range.start_bound().cloned(),
            max: range.end_bound().cloned(),
            default,
            value: default,
        };
        if let Err(error) = variable.check(default) {
            panic!("the default of a process variable must be in its range: {error}");
        }
        variable
    }

    /// Returns the name, as written in a scenario.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the unit of value, default and range.
    pub const fn unit(&self) -> Unit {
        self.unit
    }

    /// Returns the default value.
    pub const fn default(&self) -> f64 {
        self.default
    }

    /// Returns the current value.
    pub const fn value(&self) -> f64 {
        self.value
    }

    /// Returns the bounds of the range.
    pub const fn range(&self) -> (Bound<f64>, Bound<f64>) {
        (self.min, self.max)
    }

    /// Formats the range in ISO 31-11 notation: a bracket turned away from a bound excludes it.
    pub fn range_text(&self) -> String {
        let min = match self.min {
            Bound::Included(min) => format!("[{min}"),
            Bound::Excluded(min) => format!("]{min}"),
            Bound::Unbounded => "]-∞".into(),
        };
        match self.max {
            Bound::Included(max) => format!("{min}, {max}]"),
            Bound::Excluded(max) => format!("{min}, {max}["),
            Bound::Unbounded => format!("{min}, ∞["),
        }
    }

    /// Sets the value.
    ///
    /// # Errors
    /// [`VariableError::OutOfRange`]; the value is then unchanged.
    pub fn set(&mut self, value: f64) -> Result<(), VariableError> {
        self.check(value)?;
        self.value = value;
        Ok(())
    }

    /// Checks whether the variable may be set to `value`.
    ///
    /// # Errors
    /// [`VariableError::OutOfRange`] if not. Neither infinities nor `NaN` are ever in range.
    pub fn check(&self, value: f64) -> Result<(), VariableError> {
        if value.is_finite() && (self.min, self.max).contains(&value) {
            return Ok(());
        }
        Err(VariableError::OutOfRange {
            name: self.name.clone(),
            value,
            range: self.range_text(),
        })
    }

    /// Checks whether a controller with this `period` samples a frequency of this `value`: up to
    /// half of its rate. Variables in another unit than Hz always pass.
    ///
    /// # Errors
    /// [`VariableError::Refused`].
    pub fn check_sampled(&self, value: f64, period: SimDuration) -> Result<(), VariableError> {
        let greatest = 0.5 / period.as_secs_f64();
        // A period that is rounded to whole nanoseconds may shift the limit.
        if self.unit != Unit::Hertz || value.abs() <= greatest * (1.0 + 1e-9) {
            return Ok(());
        }
        Err(VariableError::Refused {
            name: self.name.clone(),
            value,
            why: format!("a controller with a period of {period} samples up to {greatest} Hz"),
        })
    }
}

/// Formats a number, of an extreme magnitude with an exponent.
fn short(value: f64) -> String {
    let text = format!("{value:?}");
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}

/// `frequency = 3 Hz in ]0, ∞[`
impl fmt::Display for ProcessVariable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} = {} {} in {}",
            self.name,
            self.value,
            self.unit,
            self.range_text()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn range_bounds_are_open_closed_or_absent() {
        let text = |variable: &ProcessVariable| variable.range_text();
        let mut length = ProcessVariable::new("length", Unit::Meter, 0.0.., 0.1);
        assert_eq!(text(&length), "[0, ∞[");
        length.set(0.0).unwrap();
        let refused = length.set(-1e-300).unwrap_err();
        assert_eq!(refused.to_string(), "length = -1e-300 is not in [0, ∞[");
        assert!(length.set(f64::INFINITY).is_err());
        assert!(length.set(f64::NAN).is_err());
        assert_eq!((length.value(), length.default()), (0.0, 0.1));
        assert_eq!(
            text(&ProcessVariable::new("any", Unit::One, .., -5.0)),
            "]-∞, ∞["
        );
        assert_eq!(
            text(&ProcessVariable::new("angle", Unit::Radian, 0.0..=3.0, 3.0)),
            "[0, 3]"
        );
    }

    #[test]
    #[should_panic(expected = "default = 2 is not in [0, 1]")]
    fn default_out_of_range_panics() {
        let _ = ProcessVariable::new("default", Unit::One, 0.0..=1.0, 2.0);
    }
}
