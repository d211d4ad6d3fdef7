//! Maxima of two signals in the periods of the second.

use super::found::Found;

/// Least number of periods for a finding.
const MIN_PERIODS: u64 = 3;
/// Half-width of the band around the middle level that separates two crossings, as a share of the
/// range.
const HYSTERESIS: f64 = 0.1;

/// Maxima of both signals in each complete period of the second. A period begins where the second
/// signal, after it was below the band around the middle of its range so far, rises above it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Peaks {
    /// Least and greatest value of the second signal so far.
    least: f64,
    greatest: f64,
    /// The second signal was below the band.
    is_low: bool,
    /// Range of the second signal at the begin of the present period; none before the first.
    begun_with: Option<f64>,
    /// Maxima in the present period.
    maxima: [f64; 2],
    periods: u64,
    sums: [f64; 2],
}

impl Default for Peaks {
    fn default() -> Self {
        Peaks {
            least: f64::INFINITY,
            greatest: f64::NEG_INFINITY,
            is_low: false,
            begun_with: None,
            maxima: [f64::NEG_INFINITY; 2],
            periods: 0,
            sums: [0.0; 2],
        }
    }
}

impl Peaks {
    #[inline]
    pub fn add(&mut self, signal: f64, with: f64) {
        self.least = self.least.min(with);
        self.greatest = self.greatest.max(with);
        let range = self.greatest - self.least;
        let (middle, band) = (self.least + 0.5 * range, HYSTERESIS * range);
        if with < middle - band {
            self.is_low = true;
        } else if self.is_low && with > middle + band {
            self.begin_period(range);
        }
        let [of_signal, of_other] = self.maxima;
        self.maxima = [of_signal.max(signal), of_other.max(with)];
    }

    fn begin_period(&mut self, range: f64) {
        // Before the whole range was seen, ripples cross its middle, too.
        if self.begun_with.is_some_and(|begun| 2.0 * begun >= range) {
            self.periods += 1;
            self.sums[0] += self.maxima[0];
            self.sums[1] += self.maxima[1];
        }
        self.is_low = false;
        self.begun_with = Some(range);
        self.maxima = [f64::NEG_INFINITY; 2];
    }

    /// Returns the ratio of the means of the maxima.
    pub fn found(&self) -> Found {
        let periods = self.periods;
        if periods < MIN_PERIODS {
            return Err(format!(
                "{periods} periods of the signal that it is compared with, and {MIN_PERIODS} are needed"
            ));
        }
        if self.sums[1] == 0.0 {
            return Err("the maxima that it is compared with are zero on average".to_owned());
        }
        Ok((
            self.sums[0] / self.sums[1],
            format!("over {periods} periods"),
        ))
    }
}
