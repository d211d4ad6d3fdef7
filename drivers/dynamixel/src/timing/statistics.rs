use twinrig_kernel::SimDuration;

/// Sorts periods and returns their percentile, zero if there are none.
pub fn percentile(periods: &mut [SimDuration], percent: usize) -> SimDuration {
    periods.sort_unstable();
    let last = periods.len().saturating_sub(1);
    let found = periods.get(last * percent / 100);
    found.copied().unwrap_or_default()
}

/// Sorts periods of two loops and returns the distance of Kolmogorov and Smirnov: the greatest
/// difference of their cumulative distributions, 0 to 1.
pub fn ks_distance(one: &mut [SimDuration], other: &mut [SimDuration]) -> f64 {
    one.sort_unstable();
    other.sort_unstable();
    let share = |of: &[SimDuration], at: SimDuration| {
        of.partition_point(|period| *period <= at) as f64 / of.len().max(1) as f64
    };
    let distances = one.iter().chain(&*other);
    let distances = distances.map(|at| (share(one, *at) - share(other, *at)).abs());
    distances.fold(0.0, f64::max)
}
