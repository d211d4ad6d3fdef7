//! Rising from lying to standing, in runs with known courses.

use crate::common::run::{Run, at, outcome};
use proptest::prelude::*;
use twinrig_kernel::Unit;
use twinrig_scenario::{Outcome, Verdict};

const STANDING: f64 = 0.12;

/// A trunk that lies on its side from 2 s on, is upright but low from `turned_ms` on, and stands
/// between `up_ms` and `down_ms`.
fn course(turned_ms: u64, up_ms: u64, down_ms: u64, expect: &str) -> Outcome {
    let lies = move |ms: u64| ms >= 2_000 && (ms < turned_ms || ms >= down_ms);
    let run = Run {
        rpy: &|ms| [if lies(ms) { -1.5 } else { 0.1 }, 0.0, 0.0],
        body: &|ms| {
            let low = ms >= 2_000 && (ms < up_ms || ms >= down_ms);
            [0.0, 0.0, if low { 0.05 } else { STANDING }]
        },
        ..Run::default()
    };
    outcome(expect, &run)
}

const WITHIN_3_S: &str = "body = { gets_up = { within = '3 s' } }";

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// The time is that from the first instant on the side to the first on its feet: being upright
    /// and low does not count.
    #[test]
    fn time_is_that_from_lying_to_standing(turned in 0..2_000_u64, low in 0..2_000_u64) {
        let up = 2_010 + turned + low;
        let outcome = course(2_010 + turned, up, u64::MAX, WITHIN_3_S);
        // The first observation at or after it, each 2 ms.
        let expected = 1e-3 * (up.next_multiple_of(2) - 2_000) as f64;
        prop_assert!((outcome.measured.unwrap() - expected).abs() < 1e-9, "{outcome:?}");
        prop_assert!((outcome.margin.unwrap() - (3.0 - expected)).abs() < 1e-9);
        prop_assert_eq!(outcome.verdict == Verdict::Pass, expected <= 3.0);
        prop_assert_eq!(outcome.unit, Unit::Second);
    }
}

#[test]
fn trunk_that_stays_down_fails_by_the_time_observed() {
    let outcome = course(u64::MAX, u64::MAX, u64::MAX, WITHIN_3_S);
    assert_eq!(outcome.verdict, Verdict::Fail, "{outcome:?}");
    assert_eq!(outcome.measured, Some(8.0));
    assert_eq!(outcome.first_violation, Some(at(5_000)));
    assert_eq!(outcome.detail, "lies from 2.000 s on, not up: roll");
}

/// It stands for 0.4 s, of the 0.5 s of the default, and not before it falls again.
#[test]
fn short_stand_does_not_count_unless_hold_is_as_short() {
    let short = course(3_000, 3_000, 3_400, WITHIN_3_S);
    assert_eq!(short.verdict, Verdict::Fail, "{short:?}");
    let shorter = "body = { gets_up = { within = '3 s', hold = '0.3 s' } }";
    let shorter = course(3_000, 3_000, 3_400, shorter);
    assert_eq!(
        (shorter.verdict, shorter.measured),
        (Verdict::Pass, Some(1.0))
    );
}

#[test]
fn trunk_that_never_lies_is_unobserved_and_so_is_an_attempt_that_is_not_over() {
    let upright = outcome(WITHIN_3_S, &Run::default());
    assert_eq!(upright.verdict, Verdict::Unobserved);
    assert_eq!(upright.detail, "the trunk never lies in its window");
    // At a threshold that its roll does reach.
    let lying = "body = { gets_up = { within = '3 s', lying = '90 deg' } }";
    let leaning = course(u64::MAX, u64::MAX, u64::MAX, lying);
    assert_eq!(leaning.verdict, Verdict::Unobserved);
    let late = |keys: &str| format!("body = {{ gets_up = {{ within = '8 s'{keys} }} }}");
    for keys in ["", ", hold = '0 s'"] {
        let down = course(u64::MAX, u64::MAX, u64::MAX, &late(keys));
        assert_eq!(down.verdict, Verdict::Unobserved, "{keys}: {down:?}");
    }
    let open = course(9_800, 9_800, u64::MAX, &late(""));
    assert_eq!(open.verdict, Verdict::Unobserved, "{open:?}");
    assert_eq!(
        open.detail,
        "the observation ended before `within` was over"
    );
}

/// Nothing that comes later can change it.
#[test]
fn attempt_that_is_late_fails_before_hold_is_over() {
    let late = "body = { gets_up = { within = '7.7 s' } }";
    for up in [9_800, u64::MAX] {
        let outcome = course(up, up, u64::MAX, late);
        assert_eq!(outcome.verdict, Verdict::Fail, "{outcome:?}");
        assert!(outcome.margin.unwrap() < 0.0);
        assert_eq!(
            outcome.detail.contains("not up"),
            up == u64::MAX,
            "{outcome:?}"
        );
    }
}

#[test]
fn height_counts_as_a_share_of_the_first_one() {
    let of_height = |height: f64| {
        let expect = format!("body = {{ gets_up = {{ within = '3 s', height = {height} }} }}");
        // Upright and at 5 of 12 cm from 3 s on.
        course(3_000, u64::MAX, u64::MAX, &expect)
    };
    assert_eq!(of_height(0.41).measured, Some(1.0));
    let low = of_height(0.42);
    assert_eq!(low.verdict, Verdict::Fail);
    assert!(low.detail.ends_with("not up: height"), "{low:?}");
}

#[test]
fn nan_fails() {
    let run = Run {
        rpy: &|ms| [if ms > 4_000 { f64::NAN } else { 1.5 }, 0.0, 0.0],
        ..Run::default()
    };
    assert_eq!(outcome(WITHIN_3_S, &run).verdict, Verdict::Fail);
}
