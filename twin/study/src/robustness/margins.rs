//! Margins of an expectation over the runs of an ensemble.

use serde::Serialize;
use twinrig_campaign::sweep::{ExpectationVerdict, ShareInterval, SweepRow};

use crate::number::{plain, si};
use crate::start::Magnitude;

/// Confidence of the interval of a share.
pub(crate) const CONFIDENCE: f64 = 0.95;

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
        let margin = |outcome: Option<&twinrig_campaign::sweep::RowExpectation>| outcome?.margin;
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

    /// Returns a margin with its unit.
    pub fn margin_text(&self, margin: f64) -> String {
        match &*self.unit {
            "1" => plain(margin),
            unit => si(margin, unit),
        }
    }

    /// Returns whether a perturbation of one unit in the last place changes the verdict.
    pub fn is_undetermined(&self) -> bool {
        self.changes_at == Some(Magnitude::LastPlace)
    }
}

#[cfg(test)]
mod tests {
    use twinrig_campaign::sweep::{RowExpectation, RowVerdict};

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
}
