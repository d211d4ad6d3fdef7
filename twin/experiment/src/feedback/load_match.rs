//! Error and delay of the load that a controller takes, against that of the plant.

use serde::Serialize;

/// Greatest delay that is searched, either way \[s\].
const RANGE_S: f64 = 0.05;
/// Distance of the searched delays \[s\].
const GRID_S: f64 = 1e-3;
/// Least correlation at which a delay is one.
const RELATED: f64 = 0.5;

/// Load of a leg, as the controller takes it, against that of the plant.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LegLoad {
    /// Name of the leg.
    pub leg: String,
    /// Root mean square of the difference \[N\].
    pub error_n: f64,
    /// Delay at which both correlate most; none without correlation \[s\].
    pub delay_s: Option<f64>,
    /// Root mean square of the difference from the plant's load of that time before \[N\].
    pub rest_n: Option<f64>,
}

/// Load over time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LoadCurve<'a> {
    /// Times \[s\], ascending.
    pub(crate) times_s: &'a [f64],
    /// As many values \[N\].
    pub(crate) loads_n: &'a [f64],
}

impl LegLoad {
    /// Compares the load that is `taken` with the `true_load`; none if they share no time.
    pub(crate) fn new(leg: &str, taken: LoadCurve<'_>, true_load: LoadCurve<'_>) -> Option<Self> {
        let error_n = rms(taken, true_load, 0.0, 0.0)?;
        let delay_s = delay(taken, true_load);
        Some(Self {
            leg: leg.to_owned(),
            error_n,
            delay_s,
            rest_n: delay_s.and_then(|delay_s| rms(taken, true_load, delay_s, RANGE_S)),
        })
    }
}

/// Returns the delay with the greatest correlation, refined by a parabola; none at the end of the
/// range.
fn delay(taken: LoadCurve<'_>, true_load: LoadCurve<'_>) -> Option<f64> {
    let cells = libm::round(RANGE_S / GRID_S);
    let mut found: Vec<[f64; 2]> = Vec::new();
    let mut cell = -cells;
    while cell <= cells {
        found.push([
            cell * GRID_S,
            correlation(taken, true_load, cell * GRID_S).unwrap_or(-1.0),
        ]);
        cell += 1.0;
    }
    let best = (0..found.len()).max_by(|a, b| found[*a][1].total_cmp(&found[*b][1]))?;
    if found[best][1] < RELATED {
        return None;
    }
    let before = best.checked_sub(1).and_then(|place| found.get(place))?;
    let after = found.get(best + 1)?;
    let bend = before[1] - 2.0 * found[best][1] + after[1];
    let aside = if bend < 0.0 {
        0.5 * (before[1] - after[1]) / bend
    } else {
        0.0
    };
    Some(found[best][0] + aside * GRID_S)
}

fn rms(taken: LoadCurve<'_>, true_load: LoadCurve<'_>, delay_s: f64, edge_s: f64) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for_pairs(taken, true_load, delay_s, edge_s, |taken, truth| {
        sum += (taken - truth) * (taken - truth);
        count += 1.0;
    });
    (count > 0.0).then(|| libm::sqrt(sum / count))
}

/// Returns Pearson's coefficient of the load taken and the true one of `delay_s` before.
fn correlation(taken: LoadCurve<'_>, true_load: LoadCurve<'_>, delay_s: f64) -> Option<f64> {
    let (mut count, mut sums, mut squares, mut product) = (0.0, [0.0; 2], [0.0; 2], 0.0);
    for_pairs(taken, true_load, delay_s, RANGE_S, |a, b| {
        count += 1.0;
        for (place, value) in [a, b].into_iter().enumerate() {
            sums[place] += value;
            squares[place] += value * value;
        }
        product += a * b;
    });
    let [a, b] = [0, 1].map(|place| squares[place] - sums[place] * sums[place] / count);
    let spread = libm::sqrt(a * b);
    (spread > 0.0).then(|| (product - sums[0] * sums[1] / count) / spread)
}

/// Passes pairs of the load taken, and the true one of `delay_s` before on the line between its
/// samples. Samples closer than `edge_s` to the ends of the true load are left out, so that every
/// delay is judged by the same.
fn for_pairs(
    taken: LoadCurve<'_>,
    true_load: LoadCurve<'_>,
    delay_s: f64,
    edge_s: f64,
    mut pair: impl FnMut(f64, f64),
) {
    let (times_s, loads_n) = (true_load.times_s, true_load.loads_n);
    let (Some(first_s), Some(last_s)) = (times_s.first(), times_s.last()) else {
        return;
    };
    let mut next = 0;
    for (at_s, load_n) in taken.times_s.iter().zip(taken.loads_n) {
        if *at_s < first_s + edge_s || *at_s > last_s - edge_s {
            continue;
        }
        let then_s = at_s - delay_s;
        while next < times_s.len() && times_s[next] <= then_s {
            next += 1;
        }
        let truth = match (next.checked_sub(1), times_s.get(next)) {
            (Some(before), Some(after_s)) => {
                let share = (then_s - times_s[before]) / (after_s - times_s[before]);
                loads_n[before] + share * (loads_n[next] - loads_n[before])
            }
            (Some(before), None) => loads_n[before],
            (None, _) => continue,
        };
        pair(*load_n, truth);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Stances of a leg: half waves of the greatest load 8 N, smooth at touch-down.
    fn load(at_s: f64) -> f64 {
        let wave = libm::sin(std::f64::consts::TAU * 3.3 * at_s).max(0.0);
        8.0 * wave * wave
    }

    proptest! {
        #[test]
        fn delay_and_error_are_those_of_the_construction(
            delay_s in -0.03..0.03_f64,
            offset_n in -1.0..1.0_f64,
        ) {
            let times_s: Vec<f64> = (0..1500).map(|n| f64::from(n) * 2e-3).collect();
            let true_n: Vec<f64> = times_s.iter().map(|at_s| load(*at_s)).collect();
            let late = times_s.iter().map(|at_s| load(at_s - delay_s) + offset_n);
            let late: Vec<f64> = late.collect();
            let curve = |loads_n| LoadCurve { times_s: &times_s, loads_n };
            let found = LegLoad::new("LF", curve(&late), curve(&true_n)).unwrap();
            prop_assert!((found.delay_s.unwrap() - delay_s).abs() < 1e-4, "{found:?}");
            // Without the delay the offset is left, but for the lines between samples.
            prop_assert!((found.rest_n.unwrap() - offset_n.abs()).abs() < 0.02, "{found:?}");
            prop_assert!(found.error_n >= found.rest_n.unwrap() - 0.02, "{found:?}");
        }
    }

    #[test]
    fn unrelated_loads_have_no_delay() {
        let times_s: Vec<f64> = (0..500).map(|n| f64::from(n) * 2e-3).collect();
        let true_n: Vec<f64> = times_s.iter().map(|at_s| load(*at_s)).collect();
        let constant = vec![2.0; times_s.len()];
        let curve = |loads_n| LoadCurve {
            times_s: &times_s,
            loads_n,
        };
        let found = LegLoad::new("LF", curve(&constant), curve(&true_n)).unwrap();
        assert_eq!((found.delay_s, found.rest_n), (None, None));
        let none = LoadCurve {
            times_s: &[],
            loads_n: &[],
        };
        assert_eq!(LegLoad::new("LF", curve(&constant), none), None);
    }
}
