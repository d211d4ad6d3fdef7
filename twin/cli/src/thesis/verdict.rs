//! Verdicts on printed figures.

use serde::{Deserialize, Serialize};
use twinrig_report::table::Tone;

/// Verdict on a printed figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Verdict {
    /// An outcome that was free to differ agrees.
    Reproduced,
    /// An input, a fit or a demand comes back.
    Consistent,
    /// Arithmetic on printed numbers agrees.
    Recomputed,
    /// The same experiment has another result.
    Contradicted,
    /// Printed numbers or formulas exclude each other.
    Misprint,
    /// The experiment was not repeated: data, parameters or the method are not there.
    NotRun,
    /// Nothing was determined, or an interval that contains a limit of the tolerance.
    Unobserved,
}

impl Verdict {
    /// All verdicts, in the order of summaries.
    pub(crate) const ALL: [Self; 7] = [
        Self::Reproduced,
        Self::Consistent,
        Self::Recomputed,
        Self::Contradicted,
        Self::Misprint,
        Self::NotRun,
        Self::Unobserved,
    ];

    /// Words for readers.
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Reproduced => "reproduced",
            Self::Consistent => "consistent",
            Self::Recomputed => "recomputed",
            Self::Contradicted => "contradicted",
            Self::Misprint => "misprint",
            Self::NotRun => "not run",
            Self::Unobserved => "unobserved",
        }
    }

    /// Returns the tone of tables.
    pub(crate) fn tone(self) -> Tone {
        match self {
            Self::Reproduced => Tone::Good,
            Self::Consistent | Self::Recomputed => Tone::Plain,
            Self::Contradicted | Self::Misprint => Tone::Doubtful,
            Self::NotRun => Tone::Faint,
            Self::Unobserved => Tone::Bad,
        }
    }
}

/// Origin of a figure of ours, by which its agreement or difference is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Basis {
    /// Arithmetic on printed numbers and formulas.
    Arithmetic,
    /// An input, a value fitted to the printed one, or a demand that a search had to meet.
    Given,
    /// Outcome of the experiment of the thesis, free to differ.
    Outcome,
    /// Outcome of another method, model or controller, free to differ: a difference contradicts
    /// nothing.
    Substitute,
}

impl Basis {
    /// Returns the verdict on a figure that agrees.
    pub(crate) fn agreement(self) -> Verdict {
        match self {
            Self::Arithmetic => Verdict::Recomputed,
            Self::Given => Verdict::Consistent,
            Self::Outcome | Self::Substitute => Verdict::Reproduced,
        }
    }

    /// Returns the verdict on a figure that differs.
    pub(crate) fn difference(self) -> Verdict {
        match self {
            Self::Arithmetic => Verdict::Misprint,
            Self::Given | Self::Outcome => Verdict::Contradicted,
            Self::Substitute => Verdict::NotRun,
        }
    }
}

/// Input or outcome of what determines a figure of ours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Input {
    /// Taken from the thesis or another source, or chosen without regard to the printed figure.
    Set(&'static str),
    /// Chosen so that the printed figure, or one that determines it, comes out.
    Fitted(&'static str),
    /// Not chosen: what the model, protocol or search gives.
    Free(&'static str),
}

impl Input {
    /// Returns the input for readers: `fitted: geometry of the leg`.
    pub(crate) fn text(self) -> String {
        match self {
            Self::Set(input) => format!("set: {input}"),
            Self::Fitted(input) => format!("fitted: {input}"),
            Self::Free(outcome) => format!("free: {outcome}"),
        }
    }
}

/// Our figure, in the unit of the printed one: a value, and the interval that is known to contain
/// it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Measurement {
    /// Value.
    pub value: f64,
    /// Lower end of the interval; none without a lower bound.
    pub low: Option<f64>,
    /// Upper end; none without an upper bound.
    pub high: Option<f64>,
}

impl Measurement {
    /// A value without an uncertainty.
    pub(crate) fn exact(value: f64) -> Self {
        Self::within(value, value, value)
    }

    /// A value in an interval.
    pub(crate) fn within(value: f64, low: f64, high: f64) -> Self {
        Self {
            value,
            low: Some(low),
            high: Some(high),
        }
    }

    /// A lower bound.
    pub(crate) fn at_least(value: f64) -> Self {
        Self {
            value,
            low: Some(value),
            high: None,
        }
    }

    /// Returns the measurement in a unit that is `factor` times smaller, for a positive factor.
    pub(crate) fn times(self, factor: f64) -> Self {
        Self {
            value: self.value * factor,
            low: self.low.map(|low| low * factor),
            high: self.high.map(|high| high * factor),
        }
    }

    /// Returns both ends; infinite without a bound.
    fn ends(&self) -> [f64; 2] {
        let [low, high] = [self.low, self.high];
        [
            low.unwrap_or(f64::NEG_INFINITY),
            high.unwrap_or(f64::INFINITY),
        ]
    }
}

/// Rule of a verdict.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Rule {
    /// Ours differs by at most this share of the printed value.
    Within(f64),
    /// Ours is at most this many times the printed value, and at least that part of it.
    Factor(f64),
    /// Ours is at least this, in the unit of the figure.
    AtLeast(f64),
    /// Ours is at most this.
    AtMost(f64),
    /// Ours is between both.
    Between(f64, f64),
    /// Declared not run; the remark of the figure has the reason.
    NotRun,
}

impl Rule {
    /// Returns the accepted values for a printed value; none if the figure is declared not
    /// run, or if the rule refers to a printed value that does not exist.
    pub(crate) fn accepted(self, printed: Option<f64>) -> Option<[f64; 2]> {
        let (minus, plus) = (f64::NEG_INFINITY, f64::INFINITY);
        match self {
            Self::Within(share) => {
                let printed = printed?;
                let distance = share * printed.abs();
                Some([printed - distance, printed + distance])
            }
            Self::Factor(factor) => {
                let printed = printed?;
                let ends = [printed / factor, printed * factor];
                Some([ends[0].min(ends[1]), ends[0].max(ends[1])])
            }
            Self::AtLeast(least) => Some([least, plus]),
            Self::AtMost(most) => Some([minus, most]),
            Self::Between(least, most) => Some([least, most]),
            Self::NotRun => None,
        }
    }

    /// Returns the verdict on a printed value, given ours and its basis.
    pub(crate) fn verdict(
        self,
        basis: Basis,
        printed: Option<f64>,
        ours: Option<Measurement>,
    ) -> Verdict {
        if self == Self::NotRun {
            return Verdict::NotRun;
        }
        let (Some([least, most]), Some(ours)) = (self.accepted(printed), ours) else {
            return Verdict::Unobserved;
        };
        let [low, high] = ours.ends();
        // NaN satisfies none of these.
        if low >= least && high <= most {
            basis.agreement()
        } else if high < least || low > most {
            basis.difference()
        } else {
            Verdict::Unobserved
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const OUTCOME: Basis = Basis::Outcome;
    const PRINTED: Option<f64> = Some(253.27);

    fn any_rule() -> impl Strategy<Value = Rule> {
        prop_oneof![
            (0.0..1.0).prop_map(Rule::Within),
            (1.0..10.0).prop_map(Rule::Factor),
            (-1e3..1e3).prop_map(Rule::AtLeast),
            (-1e3..1e3).prop_map(Rule::AtMost),
            (-1e3..0.0, 0.0..1e3).prop_map(|(low, high)| Rule::Between(low, high)),
        ]
    }

    proptest! {
        #[test]
        fn value_within_the_tolerance_is_reproduced_and_any_other_refuted(
            printed in -1e3..1e3, share in 0.0..1.0, ours in -2e3..2e3
        ) {
            let verdict = Rule::Within(share).verdict(OUTCOME, Some(printed), Some(Measurement::exact(ours)));
            let distance: f64 = ours - printed;
            // At the limit the rounding of the product decides.
            prop_assume!((distance.abs() - share * printed.abs()).abs() > 1e-9);
            let is_within = distance.abs() < share * printed.abs();
            prop_assert_eq!(verdict == Verdict::Reproduced, is_within);
            prop_assert_eq!(verdict == Verdict::Contradicted, !is_within);
        }

        /// Verdicts on an interval hold for every value in it, and only an interval that contains a
        /// limit has none.
        #[test]
        fn verdict_on_an_interval_is_that_on_all_of_its_values(
            rule in any_rule(), ends in (-2e3..2e3, 0.0..1e3), inside in 0.0..1.0
        ) {
            let (low, high) = (ends.0, ends.0 + ends.1);
            let value = low + inside * (high - low);
            let whole = rule.verdict(OUTCOME, PRINTED, Some(Measurement::within(value, low, high)));
            let single = |value| rule.verdict(OUTCOME, PRINTED, Some(Measurement::exact(value)));
            if whole == Verdict::Unobserved {
                let [least, most] = rule.accepted(PRINTED).unwrap();
                prop_assert!((low..=high).contains(&least) || (low..=high).contains(&most));
            } else {
                prop_assert_eq!([low, value, high].map(single), [whole; 3]);
            }
        }

        #[test]
        fn nothing_measured_is_no_verdict(rule in any_rule()) {
            prop_assert_eq!(rule.verdict(OUTCOME, PRINTED, None), Verdict::Unobserved);
            let nan = Some(Measurement::exact(f64::NAN));
            prop_assert_eq!(rule.verdict(OUTCOME, PRINTED, nan), Verdict::Unobserved);
        }
    }

    #[test]
    fn bound_refutes_what_it_excludes_and_confirms_nothing_else() {
        let bound = Some(Measurement::at_least(100.0));
        assert_eq!(
            Rule::Within(0.2).verdict(OUTCOME, Some(1.69), bound),
            Verdict::Contradicted
        );
        assert_eq!(
            Rule::AtLeast(1.42).verdict(OUTCOME, None, bound),
            Verdict::Reproduced
        );
        assert_eq!(
            Rule::AtLeast(200.0).verdict(OUTCOME, None, bound),
            Verdict::Unobserved
        );
    }
}
