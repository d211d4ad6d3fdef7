//! Dimensions of a sweep: a setting and its values.

use twinrig_document::Placed;
use twinrig_kernel::{Stream, Unit};

use super::value::SweepValue;

/// A setting that a sweep varies.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepDimension {
    /// The key as the specification has it: a dotted key of the scenario, or the name of a process
    /// variable.
    pub key: Placed<String>,
    /// Further keys with the same value.
    pub also: Vec<Placed<String>>,
    /// Its values.
    pub values: DimensionValues,
}

impl SweepDimension {
    /// Returns all keys that have its value.
    pub fn keys(&self) -> impl Iterator<Item = &Placed<String>> {
        std::iter::once(&self.key).chain(&self.also)
    }
}

/// Values of a dimension.
#[derive(Clone, Debug, PartialEq)]
pub enum DimensionValues {
    /// These, in their order.
    Listed(Vec<SweepValue>),
    /// Quantities of an interval.
    Interval(ValueInterval),
    /// Whole numbers of an interval, both ends included.
    Whole {
        /// Least one.
        from: u64,
        /// Greatest one.
        to: u64,
    },
}

/// Interval of quantities, with `from < to`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValueInterval {
    /// Lower end, in the SI unit.
    pub from: f64,
    /// Upper end.
    pub to: f64,
    /// Their unit.
    pub unit: Unit,
    /// Number of values of a grid, at equal distances with both ends; at least 2.
    pub count: Option<usize>,
    /// Whether ratios count instead of differences; both ends are positive then.
    pub logarithmic: bool,
}

impl DimensionValues {
    /// Returns the number of values of a grid; none for an interval without a count.
    pub fn count(&self) -> Option<usize> {
        match self {
            Self::Listed(values) => Some(values.len()),
            Self::Interval(interval) => interval.count,
            Self::Whole { from, to } => usize::try_from(numbers(*from, *to)).ok(),
        }
    }

    /// Returns the value `index` of a grid.
    pub(super) fn on_grid(&self, index: usize) -> SweepValue {
        match self {
            Self::Listed(values) => values[index.min(values.len() - 1)].clone(),
            Self::Interval(interval) => {
                let last = interval.count.unwrap_or(2).saturating_sub(1).max(1);
                interval.on_grid(index as f64 / last as f64)
            }
            Self::Whole { from, to } => {
                SweepValue::whole(from.saturating_add(index as u64).min(*to))
            }
        }
    }

    /// Draws a value from stratum `stratum` of `strata` equally probable ones; from all values with
    /// one stratum.
    pub(super) fn draw(&self, stratum: usize, strata: usize, numbers: &mut Stream) -> SweepValue {
        match self {
            Self::Interval(interval) => interval.draw(stratum, strata, numbers),
            Self::Listed(values) => {
                let index = drawn(values.len() as u128, stratum, strata, numbers);
                let index = usize::try_from(index).unwrap_or(usize::MAX);
                values[index.min(values.len() - 1)].clone()
            }
            Self::Whole { from, to } => {
                let offset = drawn(self::numbers(*from, *to), stratum, strata, numbers);
                SweepValue::whole(from.saturating_add(offset))
            }
        }
    }
}

/// Number of whole numbers from `from` to `to`.
fn numbers(from: u64, to: u64) -> u128 {
    u128::from(to.saturating_sub(from)) + 1
}

/// Draws one of `count` numbers from 0, of the part of them in the stratum. A stratum without one,
/// as there are more strata than numbers, has the number in which it lies.
fn drawn(count: u128, stratum: usize, strata: usize, numbers: &mut Stream) -> u64 {
    let end = |stratum: usize| count * stratum as u128 / strata as u128;
    let (first, past) = (end(stratum), end(stratum + 1));
    let last = past.saturating_sub(1).max(first);
    let whole = |number: u128| u64::try_from(number).unwrap_or(u64::MAX);
    numbers.between(whole(first), whole(last))
}

impl ValueInterval {
    /// Returns the quantity at a share of the interval, 0 to 1; the ends are exact. Where a decimal
    /// number of a few digits differs from it by rounding errors alone, that number is meant: 2.4,
    /// not 2.4000000000000004.
    pub(super) fn on_grid(&self, share: f64) -> SweepValue {
        /// Digits after the first one.
        const DIGITS: usize = 11;
        /// Roundings of the interpolation, relative to the greater end.
        const ROUNDINGS: f64 = 4.0 * f64::EPSILON;
        let number = self.number_at(share);
        let short: f64 = format!("{number:.DIGITS$e}").parse().unwrap_or(number);
        let error = ROUNDINGS * self.from.abs().max(self.to.abs());
        let is_meant = (short - number).abs() <= error && (self.from..=self.to).contains(&short);
        SweepValue::quantity(if is_meant { short } else { number }, self.unit)
    }

    /// Returns the number at a share of the interval, 0 to 1; the ends are exact.
    pub fn number_at(&self, share: f64) -> f64 {
        let between = |from: f64, to: f64| from * (1.0 - share) + to * share;
        let number = if share <= 0.0 {
            self.from
        } else if share >= 1.0 {
            self.to
        } else if self.logarithmic {
            libm::exp(between(libm::log(self.from), libm::log(self.to)))
        } else {
            between(self.from, self.to)
        };
        number.clamp(self.from, self.to)
    }

    /// Returns both ends.
    pub fn ends(&self) -> [SweepValue; 2] {
        [self.from, self.to].map(|end| SweepValue::quantity(end, self.unit))
    }

    /// Returns the quantity at a share of the interval, with as few decimals as a millionth of the
    /// range takes; the ends are exact. For optimizations.
    #[cfg(not(target_family = "wasm"))]
    pub(crate) fn legible_at(&self, share: f64) -> SweepValue {
        let number = self.number_at(share);
        if share <= 0.0 || share >= 1.0 {
            return SweepValue::quantity(number, self.unit);
        }
        let rounded = self.rounded(number);
        let is_inside = (self.from..=self.to).contains(&rounded);
        SweepValue::quantity(if is_inside { rounded } else { number }, self.unit)
    }

    /// Rounds a quantity to the decimals that a millionth of the range takes.
    fn rounded(&self, number: f64) -> f64 {
        let range = if self.logarithmic {
            number
        } else {
            self.to - self.from
        };
        rounded(number, RESOLUTION * range)
    }

    /// Draws a quantity from a stratum, with as few decimals as a millionth of the range takes, so
    /// that commands are legible; with all of them where that would leave the stratum.
    fn draw(&self, stratum: usize, strata: usize, numbers: &mut Stream) -> SweepValue {
        let share_of = |place: f64| place / strata as f64;
        let number = self.number_at(share_of(stratum as f64 + numbers.unit()));
        let rounded = self.rounded(number);
        let low = self.number_at(share_of(stratum as f64));
        let high = self.number_at(share_of((stratum + 1) as f64));
        // The last stratum includes its upper end.
        let is_last = stratum + 1 == strata;
        let is_inside = rounded >= low && (rounded < high || is_last && rounded <= high);
        SweepValue::quantity(if is_inside { rounded } else { number }, self.unit)
    }
}

/// Resolution of draws, as a part of their range.
const RESOLUTION: f64 = 1e-6;

/// Rounds a number to the decimals that a resolution takes.
pub(crate) fn rounded(number: f64, resolution: f64) -> f64 {
    let decimals = -libm::floor(libm::log10(resolution));
    let decimals = (0..=17).find(|&count| f64::from(count) >= decimals);
    let text =
        decimals.map(|count: i32| format!("{number:.*}", usize::try_from(count).unwrap_or(0)));
    text.and_then(|text| text.parse().ok()).unwrap_or(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The last of many strata is narrower than the resolution of draws.
    #[test]
    fn draws_of_the_last_stratum_are_within_the_interval() {
        let interval = ValueInterval {
            from: 0.0,
            to: 0.666_666_666,
            unit: Unit::Meter,
            count: None,
            logarithmic: false,
        };
        let mut numbers = twinrig_kernel::stream(1, "test");
        let strata = 1_000_000;
        let low = interval.number_at((strata - 1) as f64 / strata as f64);
        for _ in 0..100 {
            let drawn = interval.draw(strata - 1, strata, &mut numbers);
            let number = drawn.number.unwrap();
            assert!((low..=interval.to).contains(&number), "{number}");
        }
    }
}
