//! Leg, element and instant that outcomes name.

use crate::common::run::{Run, at, outcome, trot_load};
use twinrig_scenario::Verdict;

#[test]
fn pattern_names_leg_and_instant_of_the_worst() {
    // The tension of RH peaks at 3.176 s; that of LH violates the limit earlier, by less.
    let run = Run {
        tension: &|leg, ms| match (leg, ms) {
            ("RH", 3_176) => 9.0,
            ("LH", 2_000) => 7.0,
            _ => 1.0,
        },
        ..Run::default()
    };
    let found = outcome(
        "signal = { name = 'leg/*/cable/tension', always = { max = '6 N' } }",
        &run,
    );
    assert_eq!(found.detail, "worst: RH at 3.176 s");
    assert_eq!(found.first_violation, Some(at(2_000)));
    let witness = found.witness;
    assert_eq!(witness.leg.as_deref(), Some("RH"));
    assert_eq!(witness.signal.as_deref(), Some("leg/RH/cable/tension"));
    assert_eq!((witness.element, witness.at), (None, Some(at(3_176))));
    assert_eq!(witness.value, Some(9.0));
    let rises = outcome(
        "signal = { name = 'leg/*/cable/tension', eventually = { min = '8 N' } }",
        &run,
    );
    assert_eq!(rises.detail, "closest approach: LF at 0.000 s");
}

#[test]
fn vector_names_its_element() {
    let run = Run {
        body: &|ms| [0.0, if ms == 4_002 { -0.3 } else { 0.0 }, 0.12],
        ..Run::default()
    };
    let found = outcome(
        "signal = { name = 'body/position', always = { min = '-10 cm' } }",
        &run,
    );
    assert_eq!(found.detail, "worst: y at 4.002 s");
    assert_eq!(found.witness.element, Some(1));
    // A failure of one element that the scenario names has the instant alone.
    let one = "signal = { name = 'body/position', component = 'y', always = { min = '-10 cm' } }";
    let found = outcome(one, &run);
    assert_eq!(
        (found.detail.as_str(), found.witness.at),
        ("", Some(at(4_002)))
    );
    let broken = Run {
        body: &|ms| [0.0, 0.0, if ms == 5_000 { f64::NAN } else { 0.12 }],
        ..Run::default()
    };
    let found = outcome(
        "signal = { name = 'body/position', always = { max = '9 m' } }",
        &broken,
    );
    assert_eq!(found.verdict, Verdict::Fail);
    assert_eq!(found.detail, "not a number: z at 5.000 s");
}

#[test]
fn order_names_the_leg_that_came_instead() {
    // At 3.3 s LF comes in the place of RF: the loads of both change places.
    let run = Run {
        load: &|leg, ms| match (leg, ms) {
            ("LF", 3_150..) => trot_load("RF", ms),
            ("RF", 3_150..) => trot_load("LF", ms),
            _ => trot_load(leg, ms),
        },
        ..Run::default()
    };
    let found = outcome("footstep = { order = [['LF', 'RH'], ['RF', 'LH']] }", &run);
    assert_eq!(found.verdict, Verdict::Fail, "{found:?}");
    let first = found.first_violation.unwrap();
    assert_eq!(found.witness.at, Some(first));
    let leg = found.witness.leg.unwrap();
    assert!(
        found.detail.starts_with(&format!("{leg} after ")) && found.detail.contains(" instead of "),
        "{}",
        found.detail
    );
    assert!(found.detail.contains(" touch-downs"), "{}", found.detail);
}

#[test]
fn settling_says_when_the_signal_was_last_outside() {
    let decays = Run {
        body: &|ms| [0.0, 0.0, 0.12 + 0.01 * libm::exp(-(ms as f64) / 1000.0)],
        ..Run::default()
    };
    let found = outcome(
        "body = { settles = { within = '1 mm', by = '1 s' } }",
        &decays,
    );
    // 10 mm · e^(−t) falls below 1 mm over its value at 10 s at ln(10 / (1 + 10 e^−10)) s.
    let expected = libm::log(10.0 / (1.0 + 10.0 * libm::exp(-10.0)));
    let last = found.witness.at.unwrap().since_start().as_secs_f64();
    // A slowly falling signal is not stored as a whole.
    let gap = 9.0 / 63.0;
    assert!(
        (expected - gap..=expected).contains(&last),
        "{last} {expected}"
    );
    assert_eq!(found.detail, format!("last outside: z at {last:.3} s"));
    assert_eq!(found.witness.element, Some(2));
}
