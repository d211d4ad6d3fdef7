//! Verdicts, and what remains unobserved.

use std::f64::consts::TAU;

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_scenario::Verdict;

use super::run::{BESIDE, NOTHING, Run, judge, measured};
use crate::common;

fn bump(t: f64) -> f64 {
    14.0 * (1.0 - libm::cos(TAU * 2.0 * t))
}

fn with_estimate(estimate: &dyn Fn(f64) -> f64) -> Run<'_> {
    Run {
        truth: &bump,
        estimate,
        ..NOTHING
    }
}

#[test]
fn peaks_are_the_ratio_of_the_maxima() {
    // Maxima 1.1 and 0.9 times the truth's in turns, at samples; a quarter of a period late.
    let scaled = |t: f64| {
        let late = t - 0.06;
        bump(late)
            * if (late * 2.0).floor() % 2.0 == 0.0 {
                1.1
            } else {
                0.9
            }
    };
    let run = with_estimate(&scaled);
    let found = judge(BESIDE, "peaks = { near = 1, within = '1 %' }", &run);
    // The first period of the truth begins within its second bump: eight of ten are complete.
    assert_eq!(
        (found.verdict, found.detail.as_str()),
        (Verdict::Pass, "over 8 periods")
    );
    assert!((found.measured.unwrap() - 1.0).abs() < 1e-9, "{found:?}");
    // A ripple below the hysteresis begins no period.
    let rippled = |t: f64| bump(t) + libm::sin(TAU * 50.0 * t);
    let run = Run {
        truth: &rippled,
        estimate: &rippled,
        ..NOTHING
    };
    assert_eq!(
        judge(BESIDE, "peaks = { min = 1 }", &run).detail,
        "over 8 periods"
    );
}

#[test]
fn each_limit_can_hold_and_fail() {
    let run = with_estimate(&|t| 0.9 * bump(t - 0.020));
    for (measure, held, violated) in [
        ("error", "{ max = '5 N' }", "{ max = '1 N' }"),
        ("error_peak", "{ max = '10 N' }", "{ max = '2 N' }"),
        (
            "delay",
            "{ near = '20 ms', within = '10 us' }",
            "{ max = '19.9 ms' }",
        ),
        (
            "delay",
            "{ min = '15 ms' }",
            "{ min = '-30 ms', max = '10 ms' }",
        ),
        ("correlation", "{ min = 0.9 }", "{ min = 0.99 }"),
        ("gain", "{ near = 0.87, within = '1 %' }", "{ min = 0.89 }"),
        ("peaks", "{ near = 0.9, within = '1 %' }", "{ min = 0.95 }"),
    ] {
        for (limits, verdict) in [(held, Verdict::Pass), (violated, Verdict::Fail)] {
            let found = judge(BESIDE, &format!("{measure} = {limits}"), &run);
            assert_eq!(found.verdict, verdict, "{measure} = {limits}: {found:?}");
            assert_eq!(found.margin.unwrap() >= 0.0, verdict == Verdict::Pass);
        }
    }
    // The first excess has a time: 28 · (1 − 0.9) and more near the first flank.
    let found = judge(BESIDE, "error_peak = { max = '2 N' }", &run);
    assert!(
        found
            .first_violation
            .is_some_and(|at| at < SimTime::ZERO + SimDuration::from_millis(250))
    );
}

/// A noise without memory: the fractional parts of large multiples of a sine.
fn noise(seed: f64) -> impl Fn(f64) -> f64 {
    move |t: f64| {
        let large = 43_758.545 * libm::sin(7_919.0 * t + seed);
        large - large.floor()
    }
}

#[test]
fn missing_evidence_is_unobserved_with_its_reason() {
    let (one, two) = (noise(1.0), noise(2.0));
    let delayed = |t: f64| bump(t - 0.02);
    // A ramp of one and a half periods per second, so that the delay has one maximum.
    let slow = |t: f64| libm::sin(TAU * 0.5 * t);
    let (far, steady) = (|t: f64| slow(t - 0.3), |_: f64| 3.0);
    let run = |truth, estimate, lasts_ms| Run {
        truth,
        estimate,
        lasts_ms,
        ..NOTHING
    };
    for (expect, run, reason) in [
        (
            "delay = { max = '1 s' }",
            run(&bump, &steady, 5_000),
            "the signal is constant",
        ),
        (
            "delay = { max = '1 s' }",
            run(&steady, &bump, 5_000),
            "the signal that it is compared with is constant",
        ),
        (
            "correlation = { max = 0.5 }",
            run(&bump, &steady, 5_000),
            "the signal is constant",
        ),
        (
            "gain = { max = 1 }",
            run(&steady, &bump, 5_000),
            "the signal that it is compared with is constant",
        ),
        (
            "delay = { max = '1 s' }",
            run(&bump, &delayed, 404),
            "too short",
        ),
        (
            "delay = { max = '1 s' }",
            run(&slow, &far, 5_000),
            "the delay is beyond `delay_range`",
        ),
        (
            "delay = { max = '1 s' }",
            run(&one, &two, 5_000),
            "the signals are not related",
        ),
        (
            "peaks = { max = 2 }",
            run(&bump, &delayed, 1_900),
            "2 periods",
        ),
        (
            "peaks = { max = 2 }",
            run(&steady, &bump, 5_000),
            "0 periods",
        ),
        (
            "error = { max = '1 kN' }",
            run(&bump, &delayed, 9),
            "9 samples, and 10 are needed",
        ),
    ] {
        let found = judge(BESIDE, expect, &run);
        assert_eq!(found.verdict, Verdict::Unobserved, "{expect}: {found:?}");
        assert!(found.detail.contains(reason), "{expect}: {found:?}");
        assert!(!found.holds());
    }
    let run = run(&bump, &delayed, 405);
    let found = judge(BESIDE, "delay = { max = '1 s' }", &run);
    assert_eq!(found.verdict, Verdict::Pass, "{found:?}");
}

#[test]
fn nan_fails() {
    let broken = |t: f64| if t > 2.0 { f64::NAN } else { bump(t) };
    for expect in [
        "error = { max = '1 N' }",
        "delay = { max = '1 s' }",
        "peaks = { max = 3 }",
    ] {
        let found = judge(BESIDE, expect, &with_estimate(&broken));
        assert_eq!(
            (found.verdict, found.detail.as_str()),
            (Verdict::Fail, "not a number"),
            "{expect}"
        );
    }
}

#[test]
fn least_of_the_equal_delays_of_a_periodic_signal_counts() {
    let fast = |t: f64| libm::sin(TAU * 20.0 * t);
    for delay in [-0.012, 0.005, 0.0123] {
        let estimate = |t: f64| fast(t - delay);
        let run = Run {
            truth: &fast,
            estimate: &estimate,
            ..NOTHING
        };
        let found = measured(BESIDE, "delay = { max = '1 s' }", &run);
        assert!((found - delay).abs() < 2e-5, "{found} {delay}");
    }
}

#[test]
fn gaps_interrupt_the_correlation() {
    // Without the interruption the second part would be 30 ms late on the grid.
    let delayed = |t: f64| bump(t - 0.02);
    let run = Run {
        observed_ms: &|ms| !(2_000..2_030).contains(&ms),
        ..with_estimate(&delayed)
    };
    let found = measured(BESIDE, "delay = { max = '1 s' }", &run);
    assert!((found - 0.02).abs() < 2e-4, "{found}");
    // Every interval has the wrong length.
    let run = Run {
        observed_ms: &|ms| ms % 3 == 0,
        ..run
    };
    let found = judge(BESIDE, "delay = { max = '1 s' }", &run);
    assert!(found.detail.contains("evenly spaced"), "{found:?}");
}

#[test]
fn long_range_thins_out_the_lags() {
    // ±0.5 s at 1 ms: every fourth pair.
    let delayed = |t: f64| bump(t / 4.0 - 0.0721);
    let truth = |t: f64| bump(t / 4.0);
    let run = Run {
        truth: &truth,
        estimate: &delayed,
        lasts_ms: 10_000,
        ..NOTHING
    };
    let found = measured(
        BESIDE,
        "delay = { max = '1 s' }, delay_range = '500 ms'",
        &run,
    );
    // Incomplete periods of 2 s.
    assert!((found - 4.0 * 0.0721).abs() < 5e-3, "{found}");
}

#[test]
fn window_restricts_the_pairs() {
    let late_after = |t: f64| if t < 2.0 { bump(t) } else { bump(t - 0.02) };
    let run = with_estimate(&late_after);
    let within = |window: &str| {
        let expect = format!("error = {{ max = '1 mN' }} }}\n{window}\n#");
        judge(BESIDE, &expect, &run).verdict
    };
    assert_eq!(within("before = '1.999 s'"), Verdict::Pass);
    assert_eq!(within("after = '2 s'"), Verdict::Fail);
}

#[test]
fn optional_comparison_with_an_absent_signal_is_unobserved() {
    let text = common::text(
        "[[expect]]\noptional = true\ncompare = { signal = 'absent', with = 'leg/LF/foot/load', error = { max = '1 N' } }",
    );
    let scene = common::scene(&text).unwrap();
    let (outcomes, _) = common::run::judge_with(&scene, &common::run::Run::default(), None);
    assert_eq!(outcomes[0].verdict, Verdict::Unobserved);
    assert!(outcomes[0].holds() && outcomes[0].detail.contains("absent"));
}

#[test]
fn both_signals_are_required() {
    let text = common::text(
        "record = { signals = [] }\n[[expect]]\ncompare = { signal = 'leg/RH/foot/load', with = 'leg/LF/cable/tension', error = { max = '1 N' } }",
    );
    let text = text.replace("record = { signals = [] }\n", "");
    let text = format!("record = {{ signals = [], frames = '0 Hz' }}\n{text}");
    let wanted = common::scene(&text).unwrap().wanted;
    assert_eq!(wanted, ["leg/LF/cable/tension", "leg/RH/foot/load"]);
}
