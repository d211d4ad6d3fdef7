//! Outliers: settings whose results contradict those of the neighbouring settings.
//!
//! The error of a method falls, rises or levels off from setting to setting. A value far above or
//! far below both neighbours is not a property of the method but of the particular run.

/// Factor by which an outlier lies above or below both neighbours.
const CONTRADICTS: f64 = 10.0;

/// Returns the outliers among results in the order of their settings, each with the indices of its
/// nearest known neighbours. If results should fall from setting to setting (`falling`), the last
/// one is compared with the two before it. The worst outlier is found first and excluded from later
/// comparisons.
pub(crate) fn contradicting(results: &[Option<f64>], falling: bool) -> Vec<(usize, [usize; 2])> {
    let known = results.iter().enumerate();
    let mut known: Vec<(usize, f64)> = known
        .filter_map(|(n, result)| Some((n, (*result)?)))
        .collect();
    let mut found = Vec::new();
    while let Some((at, neighbours)) = worst(&known, falling) {
        found.push((known.remove(at).0, neighbours));
    }
    found.sort_by_key(|(place, _)| *place);
    found
}

/// Returns the worst outlier, by its place in `known`, and the indices of its neighbours.
fn worst(known: &[(usize, f64)], falling: bool) -> Option<(usize, [usize; 2])> {
    let mut worst: Option<(f64, usize, [usize; 2])> = None;
    let mut consider = |factor: f64, at: usize, neighbours: [usize; 2]| {
        if factor > CONTRADICTS && worst.is_none_or(|(most, ..)| factor > most) {
            worst = Some((factor, at, neighbours));
        }
    };
    for (n, three) in known.windows(3).enumerate() {
        let [(first, before), (_, result), (last, after)] = [three[0], three[1], three[2]];
        let above = result / before.max(after);
        let below = before.min(after) / result;
        consider(above.max(below), n + 1, [first, last]);
    }
    if let (true, [.., (n, first), (m, second), (_, last)]) = (falling, known) {
        consider(last / first.max(*second), known.len() - 1, [*n, *m]);
    }
    worst.map(|(_, at, neighbours)| (at, neighbours))
}

/// Result of a neighbouring setting.
pub(crate) struct Neighbour {
    /// Result with its unit.
    pub(crate) result: String,
    /// Its setting.
    pub(crate) setting: String,
}

/// Returns the reason text of an outlier.
pub(crate) fn contradiction(neighbours: [Neighbour; 2]) -> String {
    let [before, after] =
        neighbours.map(|Neighbour { result, setting }| format!("{result} at {setting}"));
    format!("contradicts the settings next to it: {before} and {after}")
}

/// Adds the text of an outlier to the reason that its row has.
pub(crate) fn append_reason(why: Option<String>, contradiction: String) -> String {
    match why {
        Some(why) => format!("{why}; {contradiction}"),
        None => contradiction,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(results: &[Option<f64>], falling: bool) -> Vec<usize> {
        let found = contradicting(results, falling).into_iter();
        found.map(|(place, _)| place).collect()
    }

    #[test]
    fn result_far_from_both_neighbours_contradicts_them() {
        let falls: Vec<Option<f64>> = (0..8)
            .map(|n| Some(libm::pow(100.0, -f64::from(n))))
            .collect();
        assert!(
            places(&falls, true).is_empty(),
            "that is the order of a method"
        );
        let mut peak = falls.clone();
        peak[4] = Some(0.18);
        assert_eq!(places(&peak, true), [4]);
        let mut dip = falls.clone();
        dip[2] = Some(1e-15);
        assert_eq!(places(&dip, true), [2]);
        // A failed run is not a neighbour.
        peak[5] = None;
        assert_eq!(places(&peak, true), [4]);
    }

    #[test]
    fn last_result_is_checked_only_if_results_should_fall() {
        let results = [Some(1e-3), Some(1e-4), Some(1e-5), Some(0.18), None];
        assert_eq!(places(&results, true), [3]);
        assert!(places(&results, false).is_empty());
        assert!(places(&[Some(1.0), Some(1e-9)], true).is_empty());
    }
}
