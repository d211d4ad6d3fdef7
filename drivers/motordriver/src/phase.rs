use serde::{Deserialize, Serialize};

/// Standard deviation of the phases of instants relative to an even grid.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) enum Phase {
    /// Grid of the nominal period.
    Nominal(Box<NominalGrid>),
    /// Without a nominal period: the even grid that fits best.
    Fitted(FittedGrid),
}

impl Phase {
    /// Creates the statistics for the nominal period; for the best-fitting grid without one.
    pub(crate) fn new(nominal_ns: Option<u64>) -> Self {
        match nominal_ns {
            Some(period_ns) => Self::Nominal(Box::new(NominalGrid::new(period_ns))),
            None => Self::Fitted(FittedGrid::default()),
        }
    }

    pub(crate) fn record(&mut self, at_ns: u64) {
        match self {
            Self::Nominal(grid) => grid.record(at_ns),
            Self::Fitted(grid) => grid.record(at_ns),
        }
    }

    /// Returns the standard deviation \[s\]; 0 for too few instants.
    pub(crate) fn deviation(&self) -> f64 {
        let variance = match self {
            Self::Nominal(grid) => grid.variance(),
            Self::Fitted(grid) => grid.variance(),
        };
        variance.max(0.0).sqrt() * 1e-9
    }
}

/// Sectors of a period over which phases are summed.
const SECTORS: usize = 16;

/// Phases of instants in a grid of known period and unknown offset.
///
/// The phase is the time since the last grid point, known modulo the period: an instant that is
/// late by a whole period is on time, and a missing one has no influence. Like a circle, the phases
/// have to be cut to compute their spread. The cut is the middle of the sixteenth of the period
/// with the fewest instants, so phases that spread over less than 7/8 of the period are not split.
/// The sums are integers, so the result is independent of the order and free of rounding.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct NominalGrid {
    period_ns: u64,
    sectors: [Sector; SECTORS],
    squares: u128,
}

#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Sector {
    count: u64,
    sum_ns: u64,
}

impl NominalGrid {
    fn new(period_ns: u64) -> Self {
        Self {
            period_ns: period_ns.max(1),
            sectors: [Sector::default(); SECTORS],
            squares: 0,
        }
    }

    fn record(&mut self, at_ns: u64) {
        let phase = at_ns % self.period_ns;
        // A period is a second at most.
        #[expect(clippy::cast_possible_truncation, reason = "below SECTORS")]
        let sector = (phase * SECTORS as u64 / self.period_ns) as usize;
        let sector = &mut self.sectors[sector];
        sector.count += 1;
        sector.sum_ns += phase;
        self.squares += u128::from(phase) * u128::from(phase);
    }

    /// Returns the variance \[ns²\].
    fn variance(&self) -> f64 {
        let counts = self.sectors.iter().map(|sector| sector.count);
        let count: u64 = counts.clone().sum();
        if count < 2 {
            return 0.0;
        }
        let cut = (0..SECTORS).min_by_key(|sector| self.sectors[*sector].count);
        let (before, after) = self.sectors.split_at(cut.unwrap_or_default() + 1);
        // Instants before the cut are shifted by a period, behind the others.
        let (period, moved) = (u128::from(self.period_ns), |of: fn(&Sector) -> u64| {
            u128::from(before.iter().map(of).sum::<u64>())
        });
        let (moved_count, moved_sum) =
            (moved(|sector| sector.count), moved(|sector| sector.sum_ns));
        let rest: u64 = after.iter().map(|sector| sector.sum_ns).sum();
        let sum = u128::from(rest) + moved_sum + moved_count * period;
        let squares = self.squares + (2 * moved_sum + moved_count * period) * period;
        // Moments about an integer next to the mean, so that the difference has few digits.
        let n = u128::from(count);
        let centre = sum / n;
        let off = sum - n * centre;
        let squares = squares + n * centre * centre - 2 * centre * sum;
        let (n, off) = (count as f64, off as f64);
        (squares as f64 - off * (off / n)) / n
    }
}

/// Even grid fitted by least squares to instant over index, each instant being the next grid point.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct FittedGrid {
    first_ns: Option<u64>,
    /// First interval, subtracted from the instants to preserve digits.
    interval_ns: Option<u64>,
    count: u64,
    mean_number: f64,
    mean_ns: f64,
    sum_number_number: f64,
    sum_number_ns: f64,
    sum_ns_ns: f64,
}

impl FittedGrid {
    fn record(&mut self, at_ns: u64) {
        let since = at_ns.saturating_sub(*self.first_ns.get_or_insert(at_ns));
        let number = self.count as f64;
        self.count += 1;
        if self.count == 2 {
            self.interval_ns = Some(since);
        }
        // Both terms are far below 2^53, so the difference is exact.
        let ns = since as f64 - number * self.interval_ns.unwrap_or_default() as f64;
        let count = self.count as f64;
        let (off_number, off_ns) = (number - self.mean_number, ns - self.mean_ns);
        self.mean_number += off_number / count;
        self.mean_ns += off_ns / count;
        let rest_ns = ns - self.mean_ns;
        self.sum_number_number += off_number * (number - self.mean_number);
        self.sum_number_ns += off_number * rest_ns;
        self.sum_ns_ns += off_ns * rest_ns;
    }

    /// Returns the variance \[ns²\].
    fn variance(&self) -> f64 {
        if self.count < 3 {
            return 0.0;
        }
        let explained = self.sum_number_ns * (self.sum_number_ns / self.sum_number_number);
        (self.sum_ns_ns - explained) / self.count as f64
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use twinrig_kernel::Snapshot;

    use super::*;

    const PERIOD_NS: u64 = 2_000_123;

    fn deviation(nominal_ns: Option<u64>, instants: impl IntoIterator<Item = u64>) -> f64 {
        let mut phase = Phase::new(nominal_ns);
        instants.into_iter().for_each(|at| phase.record(at));
        phase.deviation()
    }

    /// Standard deviation \[s\] of lateness \[ns\].
    fn direct(late_ns: &[u64]) -> f64 {
        let n = late_ns.len() as f64;
        let mean = late_ns.iter().sum::<u64>() as f64 / n;
        let squares = late_ns
            .iter()
            .map(|late| (*late as f64 - mean) * (*late as f64 - mean));
        (squares.sum::<f64>() / n).sqrt() * 1e-9
    }

    proptest! {
        /// For any offset of the grid and any subset of missing instants.
        #[test]
        fn nominal_grid_deviation_equals_that_of_lateness(
            width in 1..7 * PERIOD_NS / 8 - PERIOD_NS / 16,
            offset in 0..3 * PERIOD_NS,
            lost in 0.0..0.9_f64,
            seed in any::<u64>(),
        ) {
            let mut random = twinrig_kernel::stream(seed, "jitter");
            let (mut late, mut instants) = (vec![], vec![]);
            for n in 0..3_000 {
                let by = random.between(0, width);
                if random.unit() >= lost {
                    late.push(by);
                    instants.push(offset + n * PERIOD_NS + by);
                }
            }
            let (found, exact) = (deviation(Some(PERIOD_NS), instants), direct(&late));
            prop_assert!((found - exact).abs() <= 1e-9 * exact + 1e-14, "{found}, not {exact}");
        }

        /// Compares with a linear regression in two passes.
        #[test]
        fn fitted_grid_deviation_equals_least_squares_residual(
            intervals in prop::collection::vec(0..10 * PERIOD_NS, 3..400),
        ) {
            let instants: Vec<u64> = intervals
                .iter()
                .scan(7_000, |at, interval| {
                    *at += interval;
                    Some(*at)
                })
                .collect();
            let n = instants.len() as f64;
            let points = || instants.iter().enumerate().map(|(n, at)| (n as f64, *at as f64));
            let (mean_x, mean_y) = (points().map(|(x, _)| x).sum::<f64>() / n, points().map(|(_, y)| y).sum::<f64>() / n);
            let slope = points().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum::<f64>()
                / points().map(|(x, _)| (x - mean_x) * (x - mean_x)).sum::<f64>();
            let off = |(x, y)| y - mean_y - slope * (x - mean_x);
            let exact = (points().map(|point| off(point) * off(point)).sum::<f64>() / n).sqrt() * 1e-9;
            let found = deviation(None, instants.iter().copied());
            prop_assert!((found - exact).abs() <= 1e-9 * exact + 1e-12, "{found}, not {exact}");
        }

        #[test]
        fn restored_phase_continues_bit_for_bit(
            nominal in any::<bool>(), instants in prop::collection::vec(0..10 * PERIOD_NS, 1..60), cut in 0..60_usize,
        ) {
            let nominal = nominal.then_some(PERIOD_NS);
            let (mut straight, mut resumed) = (Phase::new(nominal), Phase::new(nominal));
            let mut at = 0;
            for (n, interval) in instants.iter().enumerate() {
                at += interval;
                straight.record(at);
                resumed.record(at);
                if n == cut {
                    resumed = Snapshot::of(&resumed).read().unwrap();
                }
            }
            prop_assert_eq!(resumed.deviation(), straight.deviation());
            prop_assert_eq!(Snapshot::of(&resumed), Snapshot::of(&straight));
        }
    }

    #[test]
    fn even_grid_has_zero_deviation() {
        let even = |n: u64| 5_000 + n * PERIOD_NS;
        assert_eq!(deviation(None, (0..1_000_000).map(even)), 0.0);
        let gaps = (0..1_000_000).filter(|n| n % 1_000 != 7 && n % 300 > 20);
        assert_eq!(deviation(Some(PERIOD_NS), gaps.map(even)), 0.0);
    }

    #[test]
    fn too_few_instants_have_zero_deviation() {
        assert_eq!(deviation(Some(PERIOD_NS), [7]), 0.0);
        assert_eq!(deviation(None, [7, 9]), 0.0);
    }
}
