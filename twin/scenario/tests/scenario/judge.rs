//! Verdicts and measures of synthetic runs with known results.

use std::f64::consts::PI;

use crate::common::run::{BEGIN, END, MISSED, Run, at, cycles, outcome};
use proptest::prelude::*;
use twinrig_kernel::Unit;
use twinrig_scenario::Verdict;

fn close(a: Option<f64>, b: f64) -> bool {
    a.is_some_and(|a| (a - b).abs() < 1e-9)
}

#[test]
fn speed_is_distance_over_time_along_the_heading_or_the_path() {
    // 2 m/s to the left, heading left: forward. On a circle the displacement is zero.
    let left = Run {
        body: &|ms| [0.0, 2e-3 * ms as f64, 0.12],
        rpy: &|_| [0.0, 0.0, PI / 2.0],
        ..Run::default()
    };
    let forward = outcome(
        "body = { speed = { near = '2 m/s', within = '1 %' } }",
        &left,
    );
    assert_eq!(forward.verdict, Verdict::Pass);
    assert!(close(forward.measured, 2.0));
    let circle = Run {
        body: &|ms| {
            let turn = 2.0 * PI * ms as f64 / 10_000.0;
            [libm::sin(turn), libm::cos(turn), 0.12]
        },
        ..Run::default()
    };
    let around = outcome(
        "body = { speed = { min = '0.6 m/s' }, along = 'path' }",
        &circle,
    );
    assert_eq!(around.verdict, Verdict::Pass);
    let away = outcome("body = { speed = { min = '0.6 m/s' } }", &circle);
    assert_eq!(away.verdict, Verdict::Fail);
    assert!(away.margin.unwrap() < -0.5);
}

#[test]
fn samples_outside_the_window_are_ignored() {
    let jump = Run {
        rpy: &|ms| [if ms == 4000 { 0.2 } else { 0.1 }, 0.0, 0.0],
        ..Run::default()
    };
    let all = outcome("body = { roll = { max = '10 deg' } }", &jump);
    assert_eq!(
        (all.verdict, all.first_violation),
        (Verdict::Fail, Some(at(4000)))
    );
    for window in [
        "after = '4002 ms'",
        "before = '3998 ms'",
        "after = '5 s'\nbefore = '6 s'",
    ] {
        let part = outcome(
            &format!("body = {{ roll = {{ max = '10 deg' }} }}\n{window}"),
            &jump,
        );
        assert_eq!(part.verdict, Verdict::Pass, "{window}");
        assert!(close(part.measured, 0.1));
        assert_eq!(part.first_violation, None);
    }
}

#[test]
fn ranges_are_peak_to_peak_and_angles_are_magnitudes() {
    let swing = Run {
        rpy: &|ms| [0.0, if ms % 4 == 0 { -0.03 } else { 0.01 }, 0.0],
        ..Run::default()
    };
    let range = outcome("body = { pitch_range = { max = '0.05 rad' } }", &swing);
    assert!(close(range.measured, 0.04) && close(range.margin, 0.01));
    let angle = outcome("body = { pitch = { max = '0.02 rad' } }", &swing);
    assert_eq!(angle.verdict, Verdict::Fail);
    assert!(close(angle.measured, 0.03));
}

#[test]
fn yaw_drift_includes_whole_turns() {
    let spin = Run {
        rpy: &|ms| {
            let yaw = 3.0 * PI * ms as f64 / 10_000.0;
            [0.0, 0.0, yaw - 2.0 * PI * ((yaw + PI) / (2.0 * PI)).floor()]
        },
        ..Run::default()
    };
    let drift = outcome("body = { yaw_drift = { max = '1 rad' } }", &spin);
    assert_eq!(drift.verdict, Verdict::Fail);
    assert!((drift.measured.unwrap() - 3.0 * PI).abs() < 1e-9);
}

/// On a circle to the right, with a drift to the left of the heading: each part of the twist is
/// constant, though the robot ends where it began.
#[test]
fn means_of_the_twist_are_in_axes_of_the_trunk() {
    // Two circles in the 10 s of the run.
    let rate = -4.0 * PI / 10.0;
    let (forward, left) = (0.3, 0.05);
    let circling = Run {
        body: &|ms| {
            let angle = rate * ms as f64 * 1e-3;
            let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
            [
                (forward * sine - left * (1.0 - cosine)) / rate,
                (forward * (1.0 - cosine) + left * sine) / rate,
                0.12,
            ]
        },
        rpy: &|ms| {
            let yaw = rate * ms as f64 * 1e-3;
            [0.0, 0.0, yaw - 2.0 * PI * ((yaw + PI) / (2.0 * PI)).floor()]
        },
        ..Run::default()
    };
    for (claim, expected) in [
        (
            "turn_rate = { near = '-72 deg/s', within = '1 deg/s' }",
            rate,
        ),
        (
            "speed = { near = '30 cm/s', within = '1 mm/s' }, along = 'forward'",
            forward,
        ),
        (
            "speed = { near = '5 cm/s', within = '1 mm/s' }, along = 'left'",
            left,
        ),
        ("speed = { max = '1 mm/s' }, along = 'heading'", 0.0),
    ] {
        let found = outcome(&format!("body = {{ {claim} }}"), &circling);
        assert_eq!(
            found.verdict,
            Verdict::Pass,
            "{claim}: {:?}",
            found.measured
        );
        // Chords are shorter than arcs by the square of an interval's turn over 24.
        let measured = found.measured.unwrap();
        assert!((measured - expected).abs() < 1e-5, "{claim}: {measured}");
    }
    let wrong = outcome("body = { turn_rate = { min = '0 deg/s' } }", &circling);
    assert_eq!(wrong.verdict, Verdict::Fail);
}

#[test]
fn fall_reports_height_or_tilt_with_its_unit() {
    let up = outcome("body = { fall = false }", &Run::default());
    assert_eq!(up.verdict, Verdict::Pass);
    let sinks = Run {
        body: &|ms| [0.0, 0.0, if ms < 5000 { 0.12 } else { 0.05 }],
        ..Run::default()
    };
    let low = outcome("body = { fall = false }", &sinks);
    assert_eq!(
        (low.verdict, low.unit, low.first_violation),
        (Verdict::Fail, Unit::Meter, Some(at(5000)))
    );
    assert!(close(low.bound, 0.06) && close(low.measured, 0.05));
    // The reference height is that of the first observation of the run, even if the window begins
    // later.
    let late = outcome("body = { fall = false }\nafter = '6 s'", &sinks);
    assert_eq!(late.verdict, Verdict::Fail);
    let tilts: [([f64; 2], &str); 4] = [
        ([1.0, 0.5], "to the right"),
        ([-1.0, 0.5], "to the left"),
        ([-0.5, 1.0], "forward"),
        ([0.5, -1.0], "backward"),
    ];
    for ([roll, pitch], side) in tilts {
        // On its way down it is tilted elsewhere, by less than a fall.
        let tilts = Run {
            rpy: &|ms| match ms {
                ..4000 => [0.0; 3],
                4000..5000 => [-0.5 * roll, -0.5 * pitch, 0.0],
                _ => [roll, pitch, 0.0],
            },
            ..Run::default()
        };
        let tilted = outcome("body = { fall = false }", &tilts);
        assert_eq!((tilted.verdict, tilted.unit), (Verdict::Fail, Unit::Radian));
        assert!(close(tilted.measured, 1.0));
        assert!(tilted.detail.starts_with(side), "{}", tilted.detail);
    }
}

#[test]
fn settled_values_stay_near_the_last_one() {
    let decays = Run {
        body: &|ms| [0.0, 0.0, 0.12 + 0.01 * libm::exp(-(ms as f64) / 1000.0)],
        ..Run::default()
    };
    let by = |by: &str| {
        outcome(
            &format!("body = {{ settles = {{ within = '1 mm', by = '{by}' }} }}"),
            &decays,
        )
    };
    assert_eq!(by("1 s").verdict, Verdict::Fail);
    assert_eq!(by("3 s").verdict, Verdict::Pass);
    let signal = "signal = { name = 'body/position', component = 'z', settles = { within = '1 mm', by = '3 s' } }";
    assert_eq!(outcome(signal, &decays).verdict, Verdict::Pass);
}

#[test]
fn signals_satisfy_always_eventually_or_until() {
    let ramp = Run {
        tension: &|leg, ms| if leg == "LF" { ms as f64 / 1000.0 } else { 3.0 },
        ..Run::default()
    };
    let signal = |rest: &str| outcome(&format!("signal = {{ {rest} }}"), &ramp);
    let always = signal("name = 'leg/*/cable/tension', always = { max = '6 N' }");
    assert_eq!(
        (always.verdict, always.first_violation),
        (Verdict::Fail, Some(at(6002)))
    );
    let one = signal("name = 'leg/RF/cable/tension', always = { max = '6 N' }");
    assert_eq!(one.verdict, Verdict::Pass);
    let rises = "name = 'leg/LF/cable/tension', eventually = { min = '4 N' }";
    assert_eq!(signal(rises).verdict, Verdict::Pass);
    assert_eq!(
        signal(&format!("{rises}, within = '3 s'")).verdict,
        Verdict::Fail
    );
    assert_eq!(
        signal(&format!("{rises}, within = '5 s'")).verdict,
        Verdict::Pass
    );
    let until = |other: &str| {
        signal(&format!(
            "name = 'leg/LF/cable/tension', always = {{ max = '5 N' }}, until = {{ name = 'leg/LF/cable/tension', {other} }}"
        ))
    };
    let over = until("min = '4 N'");
    assert_eq!(
        (over.verdict, over.detail.as_str()),
        (Verdict::Pass, "until 4.000 s")
    );
    assert_eq!(until("min = '7 N'").verdict, Verdict::Fail);
    let never = until("min = '70 N'");
    assert_eq!(never.verdict, Verdict::Fail);
    assert_eq!(never.detail, "the `until` condition never held");
    assert_eq!(until("min = '0 N'").verdict, Verdict::Unobserved);
}

#[test]
fn non_finite_values_never_pass() {
    let expectations = [
        "body = { fall = false }",
        "body = { speed = { min = '-9 m/s' } }",
        "body = { height = { max = '9 m' } }",
        "body = { roll = { max = '3 rad' } }",
        "body = { height_range = { max = '9 m' } }",
        "body = { yaw_drift = { max = '99 rad' } }",
        "body = { settles = { within = '9 m', by = '0 s' } }",
        "signal = { name = 'body/position', always = { max = '9 m' } }",
        "signal = { name = 'body/rpy', always = { max = '9 rad' } }",
        "signal = { name = 'body/position', component = 'z', eventually = { max = '9 m' } }",
        "body = { recovers = { after = '1 s', within = '2 s', height = '9 m' } }",
        "response = { whenever = { name = 'body/position', max = '9 m' }, then = { name = 'body/position', component = 'z', max = '9 m' }, within = '1 s' }",
        "footstep = { slip = { max = '9 m' } }",
        "footstep = { count = { max = 999 } }",
    ];
    for non_finite in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for expect in expectations {
            let broken = Run {
                body: &|ms| [0.0, 0.0, if ms == 5000 { non_finite } else { 0.12 }],
                rpy: &|ms| {
                    [
                        if ms == 5000 { non_finite } else { 0.0 },
                        0.0,
                        if ms == 5000 { non_finite } else { 0.0 },
                    ]
                },
                foot: &|_, ms| [0.0, if ms == 5000 { non_finite } else { 0.0 }, 0.0],
                ..Run::default()
            };
            // Speed depends on x and y.
            let broken = if expect.contains("speed") {
                Run {
                    body: &|ms| [if ms == 5000 { non_finite } else { 0.0 }, 0.0, 0.12],
                    ..broken
                }
            } else {
                broken
            };
            let outcome = outcome(expect, &broken);
            assert_eq!(outcome.verdict, Verdict::Fail, "{expect} {non_finite}");
            assert_eq!(outcome.measured, None, "{expect} {non_finite}");
        }
    }
}

#[test]
fn incomplete_run_never_passes() {
    let short = Run {
        end_ms: 5000,
        ..Run::default()
    };
    for expect in [
        "body = { fall = false }",
        "footstep = { duty_factor = { max = 0.99 } }",
        "cost = { steps = { min = 1 } }",
    ] {
        let outcome = outcome(expect, &short);
        assert_eq!(outcome.verdict, Verdict::Unobserved, "{expect}");
        assert_eq!(outcome.detail, "the run ended at 5.000 s of 10.000 s");
        assert!(!outcome.holds());
    }
    let failed = outcome("body = { height = { max = '1 mm' } }", &short);
    assert_eq!(failed.verdict, Verdict::Fail, "what fails, fails");
}

#[test]
fn unobserved_expectation_is_satisfied_only_if_optional() {
    let expect =
        "signal = { name = 'imu/temperature', always = { max = '60 K' } }\noptional = true";
    let absent = outcome(expect, &Run::default());
    assert_eq!(absent.verdict, Verdict::Unobserved);
    assert!(absent.holds());
    let lame = Run {
        load: &|leg, ms| {
            if leg == "LH" {
                0.0
            } else {
                crate::common::run::trot_load(leg, ms)
            }
        },
        ..Run::default()
    };
    let outcome = outcome("footstep = { slip = { max = '1 m' } }", &lame);
    assert_eq!(
        (outcome.verdict, outcome.detail.as_str()),
        (Verdict::Unobserved, "LH never touched down")
    );
    assert!(!outcome.holds());
}

#[test]
fn cycle_measures_are_computed() {
    let steady: Vec<_> = (0..100_u64)
        .flat_map(|cycle| [(2000 * cycle, BEGIN), (2000 * cycle + 300, END)])
        .collect();
    let mut late = steady.clone();
    late[10].0 += 150;
    late.extend([(200_000, MISSED); 3]);
    let timing =
        |what: &str, events| cycles(&format!("timing = {{ of = 'control', {what} }}"), events);
    assert!(close(
        timing("cycle_rate = { near = '500 Hz', within = '1 %' }", &steady).measured,
        500.0
    ));
    assert!(close(
        timing("jitter = { max = '1 us' }", &steady).measured,
        0.0
    ));
    assert!(close(
        timing("latency = { max = '1 ms' }", &steady).measured,
        3e-4
    ));
    assert_eq!(
        timing("deadline_misses = { max = 0 }", &steady).verdict,
        Verdict::Pass
    );
    let jitter = timing("jitter = { max = '100 us' }", &late);
    assert_eq!(jitter.verdict, Verdict::Fail);
    assert!(close(jitter.measured, 1.5e-4));
    let missed = timing("deadline_misses = { max = 0 }", &late);
    assert_eq!(
        (missed.verdict, missed.measured),
        (Verdict::Fail, Some(3.0))
    );
    assert_eq!(missed.first_violation, Some(at(200)));
    assert_eq!(
        timing("jitter = { max = '1 s' }", &[]).verdict,
        Verdict::Unobserved
    );
    assert_eq!(
        timing("deadline_misses = { max = 0 }", &[]).verdict,
        Verdict::Unobserved
    );
}

#[test]
fn hung_controller_misses_all_further_cycles() {
    let mut hung = vec![(0, BEGIN), (300, END), (2000, BEGIN)];
    hung.extend((2..100).map(|cycle| (2000 * cycle, MISSED)));
    let timing = |what: &str| cycles(&format!("timing = {{ of = 'control', {what} }}"), &hung);
    assert_eq!(timing("deadline_misses = { max = 0 }").measured, Some(98.0));
    assert!(close(timing("latency = { max = '1 ms' }").measured, 0.196));
    assert!(close(timing("jitter = { max = '1 ms' }").measured, 0.194));
    assert!(close(
        timing("cycle_rate = { min = '400 Hz' }").measured,
        1.0 / 0.198
    ));
}

#[test]
fn energy_balance_and_costs_are_judged_at_the_end() {
    let run = Run::default();
    let residual = outcome("energy = { residual = { max = 1e-6 } }", &run);
    assert!(close(residual.measured.map(|x| x * 1e7), 2.0));
    assert_eq!(
        outcome("energy = { residual = { max = 1e-7 } }", &run).verdict,
        Verdict::Fail
    );
    assert_eq!(
        outcome("cost = { evaluations = { max = 40000 } }", &run).verdict,
        Verdict::Pass
    );
    assert_eq!(
        outcome("cost = { steps = { max = 9999 } }", &run).verdict,
        Verdict::Fail
    );
    assert_eq!(
        outcome("cost = { fallbacks = { max = 0 } }", &run).verdict,
        Verdict::Pass
    );
    assert_eq!(
        outcome("cost = { real_time_factor = { min = 200 } }", &run).verdict,
        Verdict::Pass
    );
}

proptest! {
    // A case is a run of 5000 observations.
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// The judge agrees with a batch evaluation of all samples.
    #[test]
    fn always_agrees_with_batch_evaluation(
        values in proptest::collection::vec(prop_oneof![9 => -1.0..1.0_f64, 1 => Just(f64::NAN)], 1..40),
        min in -1.5..0.0_f64,
        max in 0.0..1.5_f64,
    ) {
        let value = |ms: u64| values[usize::try_from(ms / 2).unwrap() % values.len()];
        let run = Run { tension: &|_, ms| value(ms), ..Run::default() };
        let expect = format!(
            "signal = {{ name = 'leg/LF/cable/tension', always = {{ min = '{min} N', max = '{max} N' }} }}"
        );
        let outcome = outcome(&expect, &run);
        let holds = values.iter().all(|value| (min..=max).contains(value));
        prop_assert_eq!(outcome.verdict == Verdict::Pass, holds);
        let first = values.iter().position(|value| !(min..=max).contains(value));
        let broken = values.iter().position(|value| value.is_nan());
        prop_assert_eq!(outcome.first_violation, broken.or(first).map(|index| at(2 * index as u64)));
        if broken.is_none() {
            let least = values.iter().fold(f64::INFINITY, |a, b| a.min(*b));
            let greatest = values.iter().fold(f64::NEG_INFINITY, |a, b| a.max(*b));
            let margin = (least - min).min(max - greatest);
            prop_assert!((outcome.margin.unwrap() - margin).abs() < 1e-12);
        }
    }
}
