//! Logarithmic axis.

use crate::number::{plain, ten_to};

/// Logarithmic axis between two powers of ten, with an optional separate place for zero at the
/// lower end.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Exponents of the ends.
    low: i32,
    high: i32,
    /// Positions of the ends \[px\].
    from: f64,
    to: f64,
    zero: bool,
}

/// Width of the place for zero with the gap behind it, in decades.
const ZERO_DECADES: f64 = 0.7;

impl Axis {
    /// Creates an axis that contains all `values`, between `from` and `to` \[px\]. Negative and
    /// non-finite values are ignored.
    pub fn around(values: impl IntoIterator<Item = f64>, from: f64, to: f64) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut zero = false;
        for value in values {
            if value == 0.0 {
                zero = true;
            } else if value > 0.0 && value.is_finite() {
                let exponent = libm::log10(value);
                low = low.min(exponent);
                high = high.max(exponent);
            }
        }
        if low > high {
            (low, high) = (-1.0, 1.0);
        }
        // Values on a power of ten lie on the end, whichever way the logarithm rounds.
        let mut low = to_i32(libm::floor(low + 1e-9));
        let mut high = to_i32(libm::ceil(high - 1e-9));
        if high == low {
            low -= 1;
            high += 1;
        }
        Self {
            low,
            high,
            from,
            to,
            zero,
        }
    }

    fn decades(&self) -> f64 {
        f64::from(self.high - self.low) + if self.zero { ZERO_DECADES } else { 0.0 }
    }

    /// Returns the position of a value \[px\]; values outside of the scale are placed at its nearer
    /// end, non-positive ones at the lower.
    pub fn at(&self, value: f64) -> f64 {
        let base = if self.zero { ZERO_DECADES } else { 0.0 };
        let decades = if value > 0.0 {
            let exponent = libm::log10(value).clamp(f64::from(self.low), f64::from(self.high));
            base + exponent - f64::from(self.low)
        } else {
            0.0
        };
        self.from + (self.to - self.from) * decades / self.decades()
    }

    /// Returns whether a value is within the ends.
    pub fn contains(&self, value: f64) -> bool {
        value > 0.0 && (f64::from(self.low)..=f64::from(self.high)).contains(&libm::log10(value))
    }

    /// Returns positions and labels of the ticks; `room` is the size of a label \[px\].
    pub fn ticks(&self, room: f64) -> Vec<(f64, String)> {
        let decade = (self.to - self.from).abs() / self.decades();
        let every = to_i32(libm::ceil(room / decade)).max(1);
        let mut ticks = Vec::new();
        if self.zero {
            ticks.push((self.from, "0".to_owned()));
        }
        // One notation for the whole axis: decimal if all labels are short, powers of ten
        // otherwise.
        let short = self.low >= -1 && self.high <= 3;
        let marked = (self.low..=self.high).filter(|exponent| exponent % every == 0);
        ticks.extend(marked.map(|exponent| {
            let value = ten_raised(exponent);
            let label = if short {
                plain(value)
            } else {
                ten_to(exponent)
            };
            (self.at(value), label)
        }));
        ticks
    }

    /// Returns the positions of the minor grid lines, 2 to 9 in each decade, if they are far enough
    /// apart.
    pub fn lines(&self) -> Vec<f64> {
        /// \[px\]
        const APART: f64 = 90.0;
        if (self.to - self.from).abs() / self.decades() < APART {
            return Vec::new();
        }
        let decades = self.low..self.high;
        let lines =
            decades.flat_map(|exponent| (2..10).map(move |n| f64::from(n) * ten_raised(exponent)));
        lines.map(|value| self.at(value)).collect()
    }
}

fn ten_raised(exponent: i32) -> f64 {
    libm::pow(10.0, f64::from(exponent))
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "exponents of f64 and numbers of ticks"
)]
fn to_i32(value: f64) -> i32 {
    value as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axis_ends_at_powers_of_ten_with_separate_zero() {
        let axis = Axis::around([0.0, 1e-6, 0.5], 0.0, 670.0);
        assert_eq!(axis.at(0.0), 0.0);
        assert!((axis.at(1e-6) - 70.0).abs() < 1e-9);
        assert!((axis.at(1.0) - 670.0).abs() < 1e-9);
        let labels: Vec<String> = axis
            .ticks(30.0)
            .into_iter()
            .map(|(_, label)| label)
            .collect();
        assert_eq!(
            labels,
            ["0", "10⁻⁶", "10⁻⁵", "10⁻⁴", "10⁻³", "10⁻²", "10⁻¹", "1"]
        );
        let near = Axis::around([0.1, 100.0], 0.0, 300.0).ticks(30.0);
        let labels: Vec<String> = near.into_iter().map(|(_, label)| label).collect();
        assert_eq!(labels, ["0.1", "1", "10", "100"]);
        let far = Axis::around([0.1, 1e4], 0.0, 300.0).ticks(30.0);
        let labels: Vec<String> = far.into_iter().map(|(_, label)| label).collect();
        assert_eq!(labels, ["10⁻¹", "1", "10", "10²", "10³", "10⁴"]);
        assert!(axis.contains(0.5) && !axis.contains(2.0) && !axis.contains(0.0));
    }

    #[test]
    fn every_decade_with_room_has_lines_at_two_to_nine() {
        assert_eq!(Axis::around([0.1, 100.0], 0.0, 300.0).lines().len(), 3 * 8);
        assert!(Axis::around([0.1, 100.0], 0.0, 200.0).lines().is_empty());
    }

    #[test]
    fn axis_is_valid_for_any_values() {
        for values in [vec![], vec![f64::NAN], vec![1.0], vec![-1.0, f64::INFINITY]] {
            let axis = Axis::around(values, 10.0, 20.0);
            assert!((10.0..=20.0).contains(&axis.at(1.0)));
            assert!(!axis.ticks(1.0).is_empty());
        }
    }
}
