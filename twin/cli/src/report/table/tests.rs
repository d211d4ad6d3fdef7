use std::sync::Arc;

use anstream::adapter::strip_str;
use twinrig_document::{Place, Source};
use twinrig_kernel::{SimTime, Unit};
use twinrig_runtime::WorkCounts;
use twinrig_scenario::{LeftOut, Witness};

use super::*;

fn outcome(measured: f64, bound: f64, margin: f64, unit: Unit) -> Outcome {
    Outcome {
        name: "it".to_owned(),
        place: Place::new(Arc::new(Source::new("it.toml", String::new())), 0..0),
        subject: "signal",
        verdict: if margin >= 0.0 {
            Verdict::Pass
        } else {
            Verdict::Fail
        },
        optional: false,
        measured: Some(measured),
        bound: Some(bound),
        other_bound: None,
        unit,
        margin: Some(margin),
        first_violation: None,
        witness: Witness::default(),
        detail: String::new(),
    }
}

#[test]
fn sign_follows_from_bound_and_margin() {
    assert_eq!(sign(&outcome(3.0, 5.0, 2.0, Unit::One)), "≤");
    assert_eq!(sign(&outcome(7.0, 5.0, -2.0, Unit::One)), "≤");
    assert_eq!(sign(&outcome(7.0, 5.0, 2.0, Unit::One)), "≥");
    assert_eq!(sign(&outcome(3.0, 5.0, -2.0, Unit::One)), "≥");
}

#[test]
fn unobserved_outcome_is_marked_with_reason() {
    let mut unobserved = outcome(0.0, 0.0, 0.0, Unit::One);
    (unobserved.measured, unobserved.bound, unobserved.margin) = (None, None, None);
    unobserved.verdict = Verdict::Unobserved;
    unobserved.detail = "no load is measured".to_owned();
    assert_eq!(mark(&Line::of(unobserved.clone())).0, "?");
    assert_eq!(
        sentence(&unobserved, true),
        "unobserved: no load is measured"
    );
    unobserved.optional = true;
    assert_eq!(mark(&Line::of(unobserved.clone())).0, "–");
    let mut late = outcome(7.0, 5.0, -2.0, Unit::Newton);
    assert_eq!(sentence(&late, false), "7 N is not ≤ 5 N");
    late.first_violation = Some(SimTime::from_nanos(1_500_000_000));
    assert_eq!(sentence(&late, false), "7 N is not ≤ 5 N, first at 1.500 s");
    late.detail = "worst: LF at 1.750 s".to_owned();
    assert_eq!(
        remark(&late, false),
        "first at 1.500 s, worst: LF at 1.750 s"
    );
    // Recordings begin at 1 s.
    assert_eq!(
        remark(&late, true),
        "first at 1.500 s (2.500 s in the recording), worst: LF at 1.750 s"
    );
    late.first_violation = None;
    late.witness.at = Some(SimTime::from_nanos(1_750_000_000));
    assert_eq!(
        remark(&late, true),
        "worst: LF at 1.750 s (2.750 s in the recording)"
    );
}

#[test]
fn both_ends_of_range_are_shown() {
    let mut speed = outcome(0.97, 0.98, 0.01, Unit::MeterPerSecond);
    speed.other_bound = Some(0.922);
    assert_eq!(remark(&speed, true), "required: 0.922 … 0.980");
    speed.other_bound = Some(1.2);
    assert_eq!(remark(&speed, true), "required: 0.98 … 1.20");
}

#[test]
fn summary_shows_plant_if_scenario_ran_with_several_plants() {
    let of = |file: &str, plant: &str| {
        let mut report = Report::of_error(file, String::new());
        report.plant = Some(plant.to_owned());
        report
    };
    let all = [
        of("a.toml", "lcp"),
        of("a.toml", "massless"),
        of("b.toml", "lcp"),
    ];
    let text = strip_str(&summary(&all)).to_string();
    let rows: Vec<Vec<&str>> = text
        .lines()
        .map(|row| row.split_whitespace().collect())
        .collect();
    let expected = [
        &["ERROR", "a.toml", "lcp"][..],
        &["ERROR", "a.toml", "massless"],
        &["ERROR", "b.toml"],
    ];
    assert_eq!(rows, expected);
}

#[test]
fn integrator_fallbacks_are_reported() {
    let work = |fallbacks| {
        let mut report = Report::of_error("it.toml", String::new());
        report.work = Some(WorkCounts {
            steps: 10_000,
            fallbacks,
            ..WorkCounts::default()
        });
        integrator_fallbacks(&report)
    };
    assert_eq!(work(0), None);
    assert_eq!(
        work(1).unwrap(),
        "fallback to another method or shorter steps once in 10000 steps"
    );
    assert_eq!(
        work(9958).unwrap(),
        "fallback to another method or shorter steps 9958 times in 10000 steps"
    );
}

#[test]
fn parts_left_out_are_one_line_unless_the_run_fails() {
    let left_out = |part: &str, why: &str| LeftOut {
        part: part.to_owned(),
        why: why.to_owned(),
    };
    let mut scenario = Report::of_error("it.toml", String::new());
    scenario.error = None;
    scenario.verdict = Status::Fail;
    scenario.left_out = vec![
        left_out("recording of a", "[record] does not name it"),
        left_out("controller", "there is no [controller]"),
        left_out("recording of b", "[record] does not name it"),
    ];
    let text = strip_str(&report(&scenario)).to_string();
    let lines = [
        "  left out  recording of a, b ([record] does not name it)\n",
        "            controller (there is no [controller])\n",
    ];
    assert!(text.contains(&lines.concat()), "{text}");
    scenario.verdict = Status::Pass;
    let text = strip_str(&report(&scenario)).to_string();
    let line = "  left out  2 recordings, 1 part; twin plan gives the reasons\n";
    assert!(text.contains(line), "{text}");
}
