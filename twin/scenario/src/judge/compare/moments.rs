//! First and second moments of pairs of values.

use super::found::{Found, NOTHING};

/// Range of a signal, relative to its greatest magnitude, below which it counts as constant: far
/// above round-off, far below anything measured.
const CONSTANT: f64 = 1e-12;

/// Sums of pairs of values, relative to the first pair, so that offsets do not cancel.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Moments {
    count: u64,
    origin: [f64; 2],
    sum: [f64; 2],
    squares: [f64; 2],
    product: f64,
    ranges: [ValueRange; 2],
}

/// Least and greatest value.
#[derive(Clone, Copy, Debug)]
pub(super) struct ValueRange {
    least: f64,
    greatest: f64,
}

impl Default for ValueRange {
    fn default() -> Self {
        ValueRange {
            least: f64::INFINITY,
            greatest: f64::NEG_INFINITY,
        }
    }
}

impl ValueRange {
    #[inline]
    pub fn add(&mut self, value: f64) {
        if value < self.least {
            self.least = value;
        }
        if value > self.greatest {
            self.greatest = value;
        }
    }

    pub fn is_constant(&self) -> bool {
        let magnitude = self.greatest.abs().max(self.least.abs());
        self.greatest - self.least <= CONSTANT * magnitude
    }
}

impl Moments {
    #[inline]
    pub fn add(&mut self, signal: f64, with: f64) {
        if self.count == 0 {
            self.origin = [signal, with];
        }
        self.count += 1;
        let (x, y) = (signal - self.origin[0], with - self.origin[1]);
        self.sum[0] += x;
        self.sum[1] += y;
        self.squares[0] += x * x;
        self.squares[1] += y * y;
        self.product += x * y;
        self.ranges[0].add(signal);
        self.ranges[1].add(with);
    }

    /// Returns the sum of products of deviations from the means.
    fn covariation(&self) -> f64 {
        self.product - self.sum[0] * self.sum[1] / self.count as f64
    }

    /// Returns the sum of squared deviations from the mean.
    fn variation(&self, of: usize) -> f64 {
        self.squares[of] - self.sum[of] * self.sum[of] / self.count as f64
    }

    fn check(&self, needs_signal: bool) -> Result<(), String> {
        if self.count == 0 {
            Err(NOTHING.to_owned())
        } else if needs_signal && self.ranges[0].is_constant() {
            Err("the signal is constant".to_owned())
        } else if self.ranges[1].is_constant() {
            Err("the signal that it is compared with is constant".to_owned())
        } else {
            Ok(())
        }
    }

    /// Returns Pearson's coefficient of correlation.
    pub fn correlation(&self) -> Found {
        self.check(true)?;
        let scale = (self.variation(0) * self.variation(1)).sqrt();
        // Round-off may exceed 1 in the last place.
        let coefficient = (self.covariation() / scale).clamp(-1.0, 1.0);
        Ok((coefficient, String::new()))
    }

    /// Returns the slope of the regression of the signal on the other one.
    pub fn gain(&self) -> Found {
        self.check(false)?;
        Ok((self.covariation() / self.variation(1), String::new()))
    }
}
