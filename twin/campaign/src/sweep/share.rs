//! Shares of runs that are asserted, and their verdicts.

use std::ops::Bound;

use serde::Serialize;
use twinrig_document::declaration::{Key, TableSpec, Type, quantity, table};
use twinrig_document::{Item, Placed, Range, Reported};
use twinrig_kernel::Unit;

use super::summary::RowSummary;
use super::wilson::ShareInterval;

const RATIO: Range = Range::between(0.0, 1.0);
const INNER: Range = Range {
    min: Bound::Excluded(0.0),
    max: Bound::Excluded(1.0),
};

table! {
    /// Keys of `[[share]]`.
    pub(super) share_table = TableSpec::new("[[share]]", "assertion about a share of the runs");
    OF: Placed<String> = "of", Type::PLACED,
        "name of an expectation, or `verdict` for all of a run together",
        r#"of = "does not fall""#, required();
    MIN: f64 = "min", quantity(Unit::One, RATIO), "least share, below 1", r#"min = "80 %""#;
    MAX: f64 = "max", quantity(Unit::One, RATIO), "greatest share, above 0", "max = 0.05";
    CONFIDENCE: f64 = "confidence", quantity(Unit::One, INNER), "confidence of the interval",
        r#"confidence = "99 %""#, default("'95 %'");
}

/// Assertion about a share.
#[derive(Clone, Debug, PartialEq)]
pub struct ShareSpec {
    /// Name of an expectation, or [`VERDICT_SHARE`](crate::sweep::VERDICT_SHARE).
    pub of: Placed<String>,
    /// Least share, 0 to 1.
    pub min: Option<f64>,
    /// Greatest share, 0 to 1.
    pub max: Option<f64>,
    /// Confidence of the interval, 0 to 1, exclusive.
    pub confidence: f64,
}

/// Verdict of a share, and of all shares.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ShareVerdict {
    /// The whole interval is within the bounds.
    Pass,
    /// The interval contains a bound: more runs are needed.
    Undecided,
    /// The whole interval is outside the bounds.
    Fail,
}

impl ShareVerdict {
    /// Returns the word of reports.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Undecided => "undecided",
            Self::Fail => "fail",
        }
    }
}

/// A share of the runs, with its confidence interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Share {
    /// Name of an expectation, or [`VERDICT_SHARE`](crate::sweep::VERDICT_SHARE).
    pub of: String,
    /// Runs in which it holds.
    pub held: usize,
    /// Runs that have it; runs with an error among them.
    pub runs: usize,
    /// Their ratio; none without a run.
    pub share: Option<f64>,
    /// Confidence interval.
    #[serde(flatten)]
    pub interval: ShareInterval,
    /// Confidence.
    pub confidence: f64,
    /// Least share, if asserted.
    pub min: Option<f64>,
    /// Greatest share, if asserted.
    pub max: Option<f64>,
    /// Verdict.
    pub verdict: ShareVerdict,
}

impl ShareSpec {
    /// Counts the runs. An expectation that was not observed does not hold, and in a run with an
    /// error none does; a run without the expectation, which is about another plant, does not
    /// count.
    pub fn share<'r>(&self, rows: impl IntoIterator<Item = &'r RowSummary>) -> Share {
        let holds = rows.into_iter().filter_map(|row| row.holds(&self.of.value));
        let (held, runs) = holds.fold((0, 0), |(held, runs), holds| {
            (held + usize::from(holds), runs + 1)
        });
        let interval = ShareInterval::wilson(held, runs, self.confidence);
        Share {
            of: self.of.value.clone(),
            held,
            runs,
            share: (runs > 0).then(|| held as f64 / runs as f64),
            interval,
            confidence: self.confidence,
            min: self.min,
            max: self.max,
            verdict: self.verdict(interval),
        }
    }

    /// Returns whether any number of held runs among `runs` gives [`ShareVerdict::Pass`].
    pub fn can_pass(&self, runs: usize) -> bool {
        let interval = |held| ShareInterval::wilson(held, runs, self.confidence);
        // Both ends rise with the held runs: the least number that shows `min` has the lowest upper
        // end.
        let min = self.min.unwrap_or(0.0);
        let (mut least, mut past) = (0, runs);
        while least < past {
            let held = least.midpoint(past);
            if interval(held).low >= min {
                past = held;
            } else {
                least = held + 1;
            }
        }
        self.verdict(interval(least)) == ShareVerdict::Pass
    }

    /// Judges an interval. A bound belongs to its permitted side.
    fn verdict(&self, ShareInterval { low, high }: ShareInterval) -> ShareVerdict {
        let (min, max) = (self.min.unwrap_or(0.0), self.max.unwrap_or(1.0));
        if low >= min && high <= max {
            ShareVerdict::Pass
        } else if high < min || low > max {
            ShareVerdict::Fail
        } else {
            ShareVerdict::Undecided
        }
    }
}

/// Reads a `[[share]]`.
pub(super) fn share(item: &Item<'_>) -> Result<ShareSpec, Reported> {
    use share_table::{CONFIDENCE, MAX, MIN, OF};
    let table = &item.table()?;
    let keys = share_table::TABLE.of(table);
    let of = keys.read(&OF);
    // No number of runs shows a share of exactly 0 or 1.
    let bound = |key: &Key<f64>, excluded: f64, help: &str| {
        keys.get_with(key, |item| {
            let share = item.number(&RATIO)?;
            if share == excluded {
                let (key, percent) = (key.name, 100.0 * share);
                let message = format!("no number of runs shows a `{key}` of {percent:.1} %");
                return Err(item.report(message, help));
            }
            Ok(share)
        })
    };
    let all = "take less, as `min = \"99 %\"`; without shares, every run has to pass";
    let none = "take more, as `max = \"1 %\"`, which runs without one can show";
    let (min, max) = (bound(&MIN, 1.0, all), bound(&MAX, 0.0, none));
    let confidence = keys.read(&CONFIDENCE);
    let (min, max) = (min?, max?);
    match (min, max) {
        (None, None) => {
            let help = format!("add `{MIN} = …` or `{MAX} = …`");
            Err(item.report("the share has no bound", help))
        }
        (Some(least), Some(most)) if least > most => {
            let message = format!("`{MIN}` is above `{MAX}`");
            Err(keys.report(&MIN, message, "exchange them"))
        }
        _ => Ok(ShareSpec {
            of: of?,
            min,
            max,
            confidence: confidence?,
        }),
    }
}
