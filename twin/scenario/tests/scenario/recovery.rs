//! Recovery from a disturbance at 3 s, in runs with known results.

use crate::common::run::{Run, at, outcome};
use proptest::prelude::*;
use twinrig_kernel::Unit;
use twinrig_scenario::{Outcome, Verdict};

/// Time of the disturbance \[ms\].
const AT_MS: u64 = 3_000;

fn of_trunk(keys: &str, run: &Run<'_>) -> Outcome {
    let expect = format!("body = {{ recovers = {{ after = '3 s', within = '2 s', {keys} }} }}");
    outcome(&format!("{expect}\nafter = '1 s'"), run)
}

/// Oscillation of a gait, with another amplitude from the disturbance on.
fn sway(ms: u64, amplitude: impl Fn(u64) -> f64) -> f64 {
    let swing = libm::sin(std::f64::consts::TAU * (ms % 300) as f64 / 300.0);
    let after = ms.checked_sub(AT_MS).filter(|after| *after > 0);
    swing * after.map_or(0.02, amplitude)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// A decay leaves the range of the time before by the tolerance up to a time in closed form.
    #[test]
    fn recovery_time_of_a_decay_is_its_closed_form(
        tolerance in 1e-3..1e-2_f64,
        excess in 1.5..60.0_f64,
        decay_ms in 100.0..700.0_f64,
        before in -0.1..0.1_f64,
    ) {
        let decay = Run {
            rpy: &|ms| {
                let after = ms.checked_sub(AT_MS + 1).map_or(f64::INFINITY, |after| after as f64 + 1.0);
                [before + excess * tolerance * libm::exp(-after / decay_ms), 0.0, 0.0]
            },
            ..Run::default()
        };
        let expected_ms = decay_ms * libm::log(excess);
        for outcome in [
            of_trunk(&format!("roll = '{tolerance} rad', pitch = '1 deg'"), &decay),
            outcome(
                &format!(
                    "signal = {{ name = 'body/rpy', component = 'x', recovers = {{ after = '3 s', \
                     within = '2 s', tolerance = '{tolerance} rad' }} }}"
                ),
                &decay,
            ),
        ] {
            let measured_ms = 1e3 * outcome.measured.unwrap();
            prop_assert!((0.0..=2.0 + 1e-9).contains(&(measured_ms - expected_ms)), "{measured_ms} {expected_ms}");
            prop_assert_eq!(outcome.verdict == Verdict::Pass, measured_ms <= 2_000.0);
            prop_assert!((outcome.margin.unwrap() - (2.0 - 1e-3 * measured_ms)).abs() < 1e-12);
            prop_assert_eq!(outcome.unit, Unit::Second);
        }
    }
}

#[test]
fn range_of_the_time_before_is_no_deviation() {
    let same = Run {
        rpy: &|ms| [sway(ms, |_| 0.02), 0.0, 0.0],
        ..Run::default()
    };
    let outcome = of_trunk("roll = '0 deg', height = '0 mm'", &same);
    assert_eq!(
        (outcome.verdict, outcome.measured, outcome.detail.as_str()),
        (Verdict::Pass, Some(0.0), "never outside")
    );
    let wider = Run {
        rpy: &|ms| [sway(ms, |_| 0.03), 0.0, 0.0],
        ..Run::default()
    };
    assert_eq!(
        of_trunk("roll = '0.011 rad'", &wider).verdict,
        Verdict::Pass
    );
    let outcome = of_trunk("roll = '0.009 rad', height = '0 mm'", &wider);
    assert_eq!(
        (outcome.verdict, outcome.detail.as_str()),
        (Verdict::Fail, "last outside: roll at 9.986 s")
    );
    assert!(outcome.margin.unwrap() < -4.9, "{outcome:?}");
    assert_eq!(outcome.first_violation, Some(at(5_000)));
}

#[test]
fn heading_includes_whole_turns_and_speed_follows_it() {
    // A turn to the left by 370° from 3 s to 4 s, without a change of the speed of 1 m/s.
    let heading = |ms: u64| {
        let turned = ms.clamp(AT_MS, AT_MS + 1000) - AT_MS;
        370.0_f64.to_radians() * turned as f64 * 1e-3
    };
    let run = Run {
        body: &|ms| {
            let mut place = [0.0, 0.0, 0.12];
            for step in (2..=ms).step_by(2) {
                place[0] += 2e-3 * libm::cos(heading(step));
                place[1] += 2e-3 * libm::sin(heading(step));
            }
            place
        },
        rpy: &|ms| {
            let yaw = heading(ms);
            [0.0, 0.0, libm::atan2(libm::sin(yaw), libm::cos(yaw))]
        },
        end_ms: 10_000,
        ..Run::default()
    };
    assert_eq!(
        of_trunk("speed = '0.001 mm/s'", &run).verdict,
        Verdict::Pass
    );
    let turned = of_trunk("yaw = '11 deg'", &run);
    assert_eq!(turned.detail, "not recovered: yaw");
}

#[test]
fn robot_that_falls_does_not_recover() {
    let falls = Run {
        body: &|ms| [0.0, 0.0, if ms < 4_000 { 0.12 } else { 0.01 }],
        ..Run::default()
    };
    let outcome = of_trunk("roll = '2 deg'", &falls);
    assert_eq!(
        (outcome.verdict, outcome.detail.as_str()),
        (Verdict::Fail, "fell at 4.000 s")
    );
    // To the end of the window, at 10 s.
    assert_eq!(outcome.measured, Some(7.0));
}

#[test]
fn incomplete_observation_shows_no_recovery() {
    let deviates = |end_ms| {
        let run = Run {
            rpy: &|ms| [if ms > AT_MS { 0.1 } else { 0.0 }, 0.0, 0.0],
            end_ms,
            ..Run::default()
        };
        of_trunk("roll = '2 deg'", &run)
    };
    let early = deviates(4_000);
    assert_eq!(
        (early.verdict, early.detail.as_str()),
        (
            Verdict::Unobserved,
            "the observation ended before `within` was over"
        )
    );
    assert_eq!(deviates(5_500).verdict, Verdict::Fail);
    assert_eq!(deviates(2_000).verdict, Verdict::Unobserved);
}
