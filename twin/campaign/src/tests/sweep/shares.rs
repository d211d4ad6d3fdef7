use proptest::prelude::*;
use twinrig_campaign::sweep::{
    ExpectationVerdict, RowSummaries, RowSummary, RowVerdict, ShareInterval, ShareSpec,
    ShareVerdict, SweepRow,
};

use super::{row, spec};

fn share(bounds: &str) -> ShareSpec {
    let text =
        format!("[[dimension]]\nkey = 'seed'\nvalues = [1]\n[[share]]\nof = 'stands'\n{bounds}");
    spec(&text).unwrap().shares.remove(0)
}

fn with(verdict: ExpectationVerdict) -> SweepRow {
    let mut row = row(1);
    "stands".clone_into(&mut row.expectations[0].name);
    row.expectations[0].verdict = verdict;
    row.expectations[0].holds = verdict == ExpectationVerdict::Pass;
    row
}

fn summaries(rows: &[SweepRow]) -> Vec<RowSummary> {
    let mut summaries = RowSummaries::default();
    let rows = rows.iter().cloned();
    rows.map(|row| summaries.summary(row)).collect()
}

fn rows(held: usize, of: usize) -> Vec<SweepRow> {
    let mut rows = vec![with(ExpectationVerdict::Pass); held];
    rows.resize(of, with(ExpectationVerdict::Fail));
    rows
}

#[test]
fn verdict_changes_where_the_interval_passes_the_bound() {
    let share = share("min = '80 %'");
    let verdict = |held: usize, of: usize| share.share(&summaries(&rows(held, of))).verdict;
    // The lower ends of 88 and 87 of 100 are 0.802 and 0.790, the upper ends of 71 and 72 are 0.790
    // and 0.7986; that of 73 is 0.807 (SciPy 1.17.1).
    assert_eq!(verdict(88, 100), ShareVerdict::Pass);
    assert_eq!(verdict(87, 100), ShareVerdict::Undecided);
    assert_eq!(verdict(73, 100), ShareVerdict::Undecided);
    assert_eq!(verdict(72, 100), ShareVerdict::Fail);
    // Ten of ten do not show 80 %; no run shows nothing.
    assert_eq!(verdict(10, 10), ShareVerdict::Undecided);
    assert_eq!(verdict(0, 0), ShareVerdict::Undecided);
}

#[test]
fn only_observed_and_satisfied_expectations_count_as_held() {
    let mut other = row(2);
    other.expectations.clear();
    let rows = [
        with(ExpectationVerdict::Pass),
        with(ExpectationVerdict::Fail),
        with(ExpectationVerdict::Unobserved),
        SweepRow::of_error("panicked"),
        // Of another plant, without the expectation: does not count.
        other,
    ];
    let share = share("max = 0.5").share(&summaries(&rows));
    assert_eq!((share.held, share.runs), (1, 4));
}

/// A run passes with an optional expectation that was not observed, and so does the share.
#[test]
fn optional_expectation_holds_without_an_observation() {
    let mut optional = with(ExpectationVerdict::Unobserved);
    optional.expectations[0].holds = true;
    let share = share("min = 0.5").share(&summaries(&[optional]));
    assert_eq!((share.held, share.runs), (1, 1));
}

#[test]
fn share_of_the_verdict_counts_runs_that_pass() {
    let mut share = share("min = 0.1");
    "verdict".clone_into(&mut share.of.value);
    let mut passing = row(1);
    passing.verdict = RowVerdict::Pass;
    let share = share.share(&summaries(&[passing, row(2), SweepRow::of_error("")]));
    assert_eq!((share.held, share.runs), (1, 3));
}

proptest! {
    /// The verdicts of a bound and of the opposite bound exclude each other, and a wider interval
    /// decides less.
    #[test]
    fn verdicts_are_consistent(of in 1_usize..300, part: prop::sample::Index, bound in 0.001..1.0_f64) {
        let held = part.index(of + 1);
        let rows = rows(held, of);
        let verdict = |bounds: &str, confidence: f64| {
            let mut share = share(&format!("{bounds} = {bound}"));
            share.confidence = confidence;
            share.share(&summaries(&rows)).verdict
        };
        let (least, most) = (verdict("min", 0.95), verdict("max", 0.95));
        prop_assert_eq!(least == ShareVerdict::Fail, most == ShareVerdict::Pass);
        let surer = verdict("min", 0.999);
        prop_assert!(surer == least || surer == ShareVerdict::Undecided);
        let interval = ShareInterval::wilson(held, of, 0.95);
        let inside = (interval.low..interval.high).contains(&bound);
        prop_assert_eq!(least == ShareVerdict::Undecided, inside && bound != interval.low);
    }

    /// Against trying all numbers of held runs.
    #[test]
    fn share_can_pass_if_a_number_of_held_runs_does(
        runs in 0_usize..60, min in 0.0..0.999_f64, width in 0.001..1.0_f64, two_sided: bool,
    ) {
        let max = (min + width).min(1.0);
        let bounds = if two_sided { format!("min = {min}\nmax = {max}") } else { format!("max = {max}") };
        let share = share(&bounds);
        let passes = |held: usize| share.share(&summaries(&rows(held, runs))).verdict == ShareVerdict::Pass;
        prop_assert_eq!(share.can_pass(runs), (0..=runs).any(passes));
    }
}
