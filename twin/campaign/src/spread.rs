//! Spread of the expectations of a scenario over the runs of an ensemble.

use std::borrow::Borrow;
use std::fmt;

use serde::{Deserialize, Serialize, Serializer};
use twinrig_kernel::Stream;

use crate::sweep::{ExpectationVerdict, RowExpectation, ShareInterval, SweepRow};

/// Confidence of the interval of a share.
pub const CONFIDENCE: f64 = 0.95;

/// Least and greatest magnitude of the starts of an ensemble, above the unit in the last place.
const MAGNITUDES: [f64; 2] = [1e-15, 1e-6];
/// One member of so many starts a unit in the last place away.
const LAST_PLACE_SHARE: usize = 8;
/// Values below it, 1 mm or 1 mrad, move by the unit in its last place: that of 0 is lost in every
/// sum.
pub const LEAST: f64 = 1.0 / 1024.0;

/// Difference between the runs of an ensemble.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EnsembleKind {
    /// The start: every run has the same random numbers.
    Starts,
    /// The seed: the plant cannot be moved at its start.
    Seeds,
    /// Values of a fit, drawn from its distribution.
    Parameters,
}

/// Magnitude of a perturbation, the same for every coordinate.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
pub enum Magnitude {
    /// One unit in the last place of each coordinate, up or down.
    LastPlace,
    /// Greatest change of a coordinate, in its unit: m or rad.
    UpTo(f64),
}

impl Magnitude {
    /// Returns the magnitudes of `count` perturbed starts, the least first: an eighth of them, at
    /// least one, is one unit in the last place, the others are evenly spaced on a logarithmic
    /// scale from 1e-15 to 1e-6.
    pub fn spaced(count: usize) -> Vec<Self> {
        let last_place = count.div_ceil(LAST_PLACE_SHARE);
        let spaced = count - last_place;
        let [least, greatest] = MAGNITUDES.map(libm::log);
        let magnitude = |n: usize| {
            // Of one alone, the greatest.
            let share = (spaced - 1 - n) as f64 / (spaced - 1).max(1) as f64;
            let log = greatest - share * (greatest - least);
            Self::UpTo(if share > 0.0 {
                libm::exp(log)
            } else {
                MAGNITUDES[1]
            })
        };
        let first = std::iter::repeat_n(Self::LastPlace, last_place);
        first.chain((0..spaced).map(magnitude)).collect()
    }

    /// Returns the value of JSON and CSV: `"1 ulp"`, or a number.
    ///
    /// # Errors
    /// Those of the serializer.
    pub fn serialized<S: Serializer>(
        magnitude: impl Borrow<Option<Self>>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        match magnitude.borrow() {
            None => serializer.serialize_none(),
            Some(Self::LastPlace) => serializer.serialize_str("1 ulp"),
            Some(Self::UpTo(most)) => serializer.serialize_f64(*most),
        }
    }

    /// Returns the change of a coordinate by the next number of `numbers`.
    pub fn change(self, value: f64, numbers: &mut Stream) -> f64 {
        match self {
            Self::UpTo(most) => most * (2.0 * numbers.unit() - 1.0),
            Self::LastPlace => {
                let size = value.abs().max(LEAST);
                let unit = size.next_up() - size;
                if numbers.bits() & 1 == 0 { unit } else { -unit }
            }
        }
    }
}

/// `1 ulp`, `1.0e-9`
impl fmt::Display for Magnitude {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LastPlace => f.write_str("1 ulp"),
            Self::UpTo(most) => write!(f, "{most:.1e}"),
        }
    }
}

/// Run of an ensemble.
#[derive(Clone, Debug, PartialEq)]
pub struct Member {
    /// Perturbation of its start; none: it has none.
    pub magnitude: Option<Magnitude>,
    /// Verdict and expectations.
    pub row: SweepRow,
}

/// Distribution of margins, in the unit of the expectation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MarginQuantiles {
    /// Least.
    pub min: f64,
    /// Quantile of 5 %.
    pub p5: f64,
    /// Median.
    pub median: f64,
    /// Quantile of 95 %.
    pub p95: f64,
    /// Greatest.
    pub max: f64,
}

impl MarginQuantiles {
    /// Returns the quantiles, linear between order statistics; none without values.
    fn of(mut values: Vec<f64>) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        let last = values.len().checked_sub(1)?;
        let quantile = |share: f64| {
            let place = share * last as f64;
            let below = (0..last).rev().find(|&n| n as f64 <= place).unwrap_or(0);
            let part = place - below as f64;
            let next = values[(below + 1).min(last)];
            values[below] + part * (next - values[below])
        };
        Some(Self {
            min: values[0],
            p5: quantile(0.05),
            median: quantile(0.5),
            p95: quantile(0.95),
            max: values[last],
        })
    }
}

/// An expectation over the runs of an ensemble.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExpectationSpread {
    /// Name.
    pub name: String,
    /// Symbol of the unit of margins.
    pub unit: String,
    /// Verdict of the unperturbed run.
    pub verdict: ExpectationVerdict,
    /// Its margin.
    pub margin: Option<f64>,
    /// Runs.
    pub runs: usize,
    /// Runs in which it holds; one that is not observed does not hold, unless it is optional.
    pub held: usize,
    /// Runs in which it is not observed.
    pub unobserved: usize,
    /// Share of the runs in which it holds.
    pub share: f64,
    /// 95 % confidence interval of the share, after Wilson.
    pub interval: ShareInterval,
    /// Margins of the runs in which it is observed.
    pub margins: Option<MarginQuantiles>,
    /// Runs whose verdict differs from the unperturbed one.
    pub changed: usize,
    /// Least perturbation with another verdict than the unperturbed run.
    #[serde(serialize_with = "Magnitude::serialized")]
    pub changes_at: Option<Magnitude>,
}

impl ExpectationSpread {
    /// Evaluates the expectations of the first member, which is the unperturbed one, over all of
    /// them. In a run with an error none holds, and none is observed.
    pub fn all(members: &[Member]) -> Vec<Self> {
        let Some(first) = members.first() else {
            return Vec::new();
        };
        let names = first.row.expectations.iter();
        names.map(|one| Self::of(&one.name, members)).collect()
    }

    /// Evaluates the expectations of a run over others, which alone count, as draws from a
    /// distribution to which that run need not belong.
    pub fn over_draws(run: &Member, draws: &[Member]) -> Vec<Self> {
        let of_run = Self::all(std::slice::from_ref(run)).into_iter();
        of_run
            .map(|own| Self {
                verdict: own.verdict,
                margin: own.margin,
                unit: own.unit,
                ..Self::of(&own.name, draws)
            })
            .collect()
    }

    fn of(name: &str, members: &[Member]) -> Self {
        let outcomes: Vec<_> = members
            .iter()
            .map(|member| {
                let completed = member.row.error.is_none();
                let outcome = member.row.expectation(name).filter(|_| completed);
                let verdict = outcome.map_or(ExpectationVerdict::Unobserved, |it| it.verdict);
                (member, outcome, verdict)
            })
            .collect();
        let verdict = outcomes
            .first()
            .map_or(ExpectationVerdict::Unobserved, |(.., verdict)| *verdict);
        let held = members.iter().filter(|it| it.row.holds(name) == Some(true));
        let (runs, held) = (members.len(), held.count());
        let unobserved = outcomes
            .iter()
            .filter(|(.., verdict)| *verdict == ExpectationVerdict::Unobserved);
        let changed: Vec<_> = outcomes
            .iter()
            .filter(|(.., found)| *found != verdict)
            .collect();
        let magnitudes = changed.iter().filter_map(|(member, ..)| member.magnitude);
        let margin = |outcome: Option<&RowExpectation>| outcome?.margin;
        let margins = outcomes
            .iter()
            .filter_map(|(_, outcome, _)| margin(*outcome));
        let first = members.first().and_then(|it| it.row.expectation(name));
        Self {
            name: name.to_owned(),
            unit: first.map_or(String::new(), |it| it.unit.clone()),
            verdict,
            margin: margin(first),
            runs,
            held,
            unobserved: unobserved.count(),
            share: held as f64 / runs.max(1) as f64,
            interval: ShareInterval::wilson(held, runs, CONFIDENCE),
            margins: MarginQuantiles::of(margins.collect()),
            changed: changed.len(),
            changes_at: magnitudes
                .min_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal)),
        }
    }

    /// Returns whether a perturbation of one unit in the last place changes the verdict.
    pub fn is_undetermined(&self) -> bool {
        self.changes_at == Some(Magnitude::LastPlace)
    }
}

#[cfg(test)]
mod tests {
    use crate::sweep::{RowExpectation, RowVerdict};

    use super::*;

    fn member(magnitude: Option<Magnitude>, margin: Option<f64>) -> Member {
        let verdict = match margin {
            None => ExpectationVerdict::Unobserved,
            Some(margin) if margin >= 0.0 => ExpectationVerdict::Pass,
            Some(_) => ExpectationVerdict::Fail,
        };
        let holds = verdict == ExpectationVerdict::Pass;
        Member {
            magnitude,
            row: SweepRow {
                verdict: if holds {
                    RowVerdict::Pass
                } else {
                    RowVerdict::Fail
                },
                error: None,
                expectations: vec![RowExpectation {
                    name: "fast".to_owned(),
                    verdict,
                    holds,
                    measured: margin,
                    bound: Some(0.0),
                    margin,
                    unit: "m/s".to_owned(),
                    detail: String::new(),
                }],
                ..SweepRow::of_error("")
            },
        }
    }

    /// `statistics.quantiles(x, n=20, method="inclusive")` of Python 3.
    #[test]
    fn quantiles_are_those_of_python() {
        let found = MarginQuantiles::of(vec![0.3, -0.1, 0.25, 0.9, 0.4, 0.05]).unwrap();
        let expected = [-0.1, -0.0625, 0.275, 0.775, 0.9];
        let found = [found.min, found.p5, found.median, found.p95, found.max];
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-15, "{found} {expected}");
        }
        assert_eq!(MarginQuantiles::of(vec![2.0]).unwrap().p95, 2.0);
        assert_eq!(MarginQuantiles::of(Vec::new()), None);
    }

    #[test]
    fn unobserved_runs_and_errors_do_not_hold_and_are_counted_apart() {
        let up_to = |most| Some(Magnitude::UpTo(most));
        let error = Member {
            row: SweepRow {
                error: Some("diverged".to_owned()),
                verdict: RowVerdict::Error,
                ..member(None, Some(1.0)).row
            },
            magnitude: up_to(1e-6),
        };
        let members = [
            member(None, Some(0.2)),
            member(Some(Magnitude::LastPlace), Some(0.1)),
            member(up_to(1e-12), Some(0.3)),
            member(up_to(1e-9), Some(-0.1)),
            member(up_to(1e-8), None),
            error,
        ];
        let [found] = &ExpectationSpread::all(&members)[..] else {
            panic!("one expectation");
        };
        assert_eq!((found.runs, found.held, found.unobserved), (6, 3, 2));
        assert_eq!((found.changed, found.changes_at), (3, up_to(1e-9)));
        assert!(!found.is_undetermined());
        assert_eq!(found.interval, ShareInterval::wilson(3, 6, 0.95));
        let margins = found.margins.unwrap();
        assert_eq!((margins.min, margins.max), (-0.1, 0.3));
        // The verdict may change for the better, too.
        let rescued = [
            member(None, Some(-0.1)),
            member(Some(Magnitude::LastPlace), Some(0.1)),
        ];
        assert!(ExpectationSpread::all(&rescued)[0].is_undetermined());
    }

    #[test]
    fn magnitudes_are_spaced_from_the_last_place_to_the_greatest() {
        let found = Magnitude::spaced(31);
        let last = found.iter().filter(|it| **it == Magnitude::LastPlace);
        assert_eq!((last.count(), found.len()), (4, 31));
        assert!(found.is_sorted_by(|a, b| a <= b));
        assert_eq!(found[30], Magnitude::UpTo(1e-6));
        assert_eq!(Magnitude::spaced(1), [Magnitude::LastPlace]);
    }
}
