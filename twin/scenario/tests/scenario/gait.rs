//! Measures of a gait as a whole, against closed forms.

use std::f64::consts::{PI, TAU};

use crate::common::run::{CYCLE_MS, Run, STANCE_MS, judge_run, outcome, trot_load};
use proptest::prelude::*;
use twinrig_scenario::{Outcome, Verdict};

/// Speed of the trunk [m/s].
const SPEED: f64 = 0.8;

fn forward(ms: u64) -> [f64; 3] {
    [SPEED * ms as f64 / 1000.0, 0.0, 0.12]
}

/// Phase of a leg whose stance begins `late` ms after that of [`trot_load`], for the time up to the
/// next observation.
fn phase_of(leg: &str, ms: u64, late: u64) -> f64 {
    let begin = if matches!(leg, "LF" | "RH") {
        0
    } else {
        CYCLE_MS / 2
    };
    // A load observed at t is that of the time before t.
    let since = (ms + 2 + CYCLE_MS - begin - late) % CYCLE_MS;
    if since < STANCE_MS {
        PI + PI * (since as f64 + 0.5) / STANCE_MS as f64
    } else {
        PI * ((since - STANCE_MS) as f64 + 0.5) / (CYCLE_MS - STANCE_MS) as f64
    }
}

fn measured(expect: &str, run: &Run<'_>) -> f64 {
    let outcome = outcome(&format!("gait = {{ {expect} }}"), run);
    outcome.measured.unwrap_or_else(|| panic!("{outcome:?}"))
}

#[test]
fn mismatch_is_the_share_of_time_by_which_contacts_are_early_and_late() {
    for late in [0, 20, 60] {
        let phase = |leg: &str, ms| phase_of(leg, ms, late);
        let run = Run {
            phase: Some(&phase),
            ..Run::default()
        };
        // Each leg is mismatched for `late` at touch-down and at lift-off. The run has 33 1/3
        // cycles, whose rest decides the last digits.
        let expected = 2.0 * late as f64 / CYCLE_MS as f64;
        let found = measured("mismatch = { max = 0.9 }", &run);
        assert!(
            (found - expected).abs() < 0.01 * expected + 1e-3,
            "{found} for {expected}"
        );
    }
}

#[test]
fn flight_share_is_that_of_the_time_between_the_stances_of_a_trot() {
    // Stances of 160 ms overlap; of 120 ms they leave 60 ms of 300.
    let run = Run {
        load: &|leg, ms| {
            if trot_load(leg, ms + 40) > 0.0 {
                trot_load(leg, ms)
            } else {
                0.0
            }
        },
        ..Run::default()
    };
    let found = measured("flight_share = { max = 0.9 }", &run);
    // 33 cycles; the run ends 100 ms after them, in a stance.
    assert!((found - 33.0 * 60.0 / 10_000.0).abs() < 1e-9, "{found}");
    assert_eq!(
        measured("flight_share = { max = 0.9 }", &Run::default()),
        0.0
    );
}

#[test]
fn slip_is_the_sum_over_all_footsteps() {
    // Every foot moves 1 mm backwards in each stance; 34 begin at 0 and 33 half a cycle later.
    let foot = |leg: &str, ms: u64| {
        let late = if matches!(leg, "LF" | "RH") {
            0
        } else {
            CYCLE_MS / 2
        };
        let since = (ms + CYCLE_MS - late) % CYCLE_MS;
        [-0.001 * since.min(158) as f64 / 158.0, 0.0, 0.0]
    };
    let found = measured(
        "slip = { max = '9 m' }",
        &Run {
            foot: &foot,
            ..Run::default()
        },
    );
    let steps = 2.0 * (34.0 + 33.0);
    assert!((found - 0.001 * steps).abs() < 0.001, "{found}");
}

#[test]
fn similarity_numbers_are_those_of_speed_height_and_stride_frequency() {
    let run = Run {
        body: &forward,
        ..Run::default()
    };
    let height = forward(0)[2];
    let froude = measured("froude = { max = 9 }", &run);
    let expected = SPEED * SPEED / (9.81 * height);
    assert!((froude / expected - 1.0).abs() < 1e-9, "{froude}");
    let strouhal = measured("strouhal = { max = 9 }", &run);
    let expected = 1000.0 / CYCLE_MS as f64 * height / SPEED;
    assert!((strouhal / expected - 1.0).abs() < 1e-9, "{strouhal}");
    // The product of the first and the square of the second knows no speed (section 4.1.1).
    let f = 1000.0 / CYCLE_MS as f64;
    let product = froude * strouhal * strouhal;
    assert!((product / (f * f * height / 9.81) - 1.0).abs() < 1e-9);
}

#[test]
fn robot_that_stands_has_no_strouhal_number() {
    let stands = |_| [0.0, 0.0, 0.12];
    let run = Run {
        body: &stands,
        ..Run::default()
    };
    let found = outcome("gait = { strouhal = { max = 9 } }", &run);
    assert_eq!(found.verdict, Verdict::Unobserved, "{found:?}");
    assert_eq!(measured("froude = { max = 9 }", &run), 0.0);
}

#[test]
fn cost_of_transport_is_positive_work_over_weight_and_distance() {
    // Each of the eight drives has the torque A cos ωt and the angle B sin ωt: the power
    // A B ω cos² ωt is never negative, its mean A B ω/2.
    let (a, b, omega) = (0.2, 0.3, TAU * 2.0);
    let drive = |ms: u64| {
        let t = ms as f64 / 1000.0;
        [b * libm::sin(omega * t), a * libm::cos(omega * t)]
    };
    let run = Run {
        body: &forward,
        drive: &drive,
        ..Run::default()
    };
    let expected = 8.0 * a * b * omega / 2.0 / (10.8 * SPEED);
    let found = measured("cost_of_transport = { max = 9 }", &run);
    // The trapezoidal rule errs by (ω h)²/12.
    assert!(
        (found / expected - 1.0).abs() < 1e-3,
        "{found} for {expected}"
    );
    // Torques a quarter of a period later work as much against the motion as with it: 2/π of the
    // amplitude A B ω/2 of the power, half of the time.
    let reactive = |ms: u64| {
        let t = ms as f64 / 1000.0;
        [b * libm::sin(omega * t), a * libm::sin(omega * t)]
    };
    let found = measured(
        "cost_of_transport = { max = 9 }",
        &Run {
            drive: &reactive,
            ..run
        },
    );
    assert!((found / expected - 1.0 / PI).abs() < 1e-3, "{found}");
    let standing = outcome(
        "gait = { cost_of_transport = { max = 1 } }",
        &Run {
            drive: &drive,
            ..Run::default()
        },
    );
    assert_eq!(standing.verdict, Verdict::Unobserved);
}

/// Cycle residual without the first touch-down, before which there is no load.
fn residual(run: &Run<'_>) -> f64 {
    let outcome = outcome(
        "gait = { cycle_residual = { max = 1 } }\nafter = '0.1 s'",
        run,
    );
    outcome.measured.unwrap()
}

#[test]
fn cycle_residual_is_the_change_from_touch_down_to_touch_down() {
    let limit_cycle = |ms: u64| {
        let turn = TAU * (ms % CYCLE_MS) as f64 / CYCLE_MS as f64;
        [
            SPEED * ms as f64 / 1000.0,
            0.0,
            0.12 + 0.01 * libm::sin(turn),
        ]
    };
    let found = residual(&Run {
        body: &limit_cycle,
        ..Run::default()
    });
    assert!(found < 1e-9, "{found}");
    // A roll that alternates by 0.02 rad from cycle to cycle.
    let rpy = |ms: u64| {
        [
            if (ms / CYCLE_MS).is_multiple_of(2) {
                0.02
            } else {
                0.0
            },
            0.0,
            0.0,
        ]
    };
    let found = residual(&Run {
        body: &limit_cycle,
        rpy: &rpy,
        ..Run::default()
    });
    assert!((found - 0.02).abs() < 1e-9, "{found}");
}

#[test]
fn cycle_residual_does_not_depend_on_the_impulse_that_confirms_a_touch_down() {
    let limit_cycle = |ms: u64| {
        let turn = TAU * (ms % CYCLE_MS) as f64 / CYCLE_MS as f64;
        [
            SPEED * ms as f64 / 1000.0,
            0.0,
            0.12 + 0.01 * libm::sin(turn),
        ]
    };
    // Weak loads at the begin of a stance, of another duration in each, delay its confirmation by
    // up to 40 ms.
    let load = |leg: &str, ms: u64| {
        let weak_ms = 10 * (ms / CYCLE_MS % 5);
        match trot_load(leg, ms) {
            load if load > 0.0 && ms % CYCLE_MS < weak_ms => 0.6,
            load => load,
        }
    };
    let run = Run {
        body: &limit_cycle,
        load: &load,
        ..Run::default()
    };
    let found = residual(&run);
    assert!(found < 1e-9, "{found}");
    // A touch-down belongs to the window that it is in, wherever its confirmation is: from 1.2 s
    // to 1.5 s inclusive there is one whole cycle, later by an observation none.
    let within = |after: &str| {
        let window = format!("after = '{after}'\nbefore = '1.5 s'");
        outcome(
            &format!("gait = {{ cycle_residual = {{ max = 1 }} }}\n{window}"),
            &run,
        )
    };
    assert_eq!(within("1.198 s").detail, "1 cycle");
    assert_eq!(within("1.202 s").verdict, Verdict::Unobserved);
}

fn fitness(run: &Run<'_>, more: &str, head: &str) -> Outcome {
    let expect = format!("{head}[[expect]]\ngait = {{ fitness = {{ min = 0.1 }}{more} }}");
    let scene = crate::common::scene(&crate::common::text(&expect)).unwrap();
    judge_run(&scene, run, None).outcomes.remove(0)
}

/// Value of the stage out of the number: the inverse of v/(1 + |v|).
fn value(fitness: f64) -> f64 {
    let share = 2.0 * fitness.fract() - 1.0;
    share / (1.0 - share.abs())
}

#[test]
fn fitness_of_a_trot_is_that_of_stage_3() {
    let phase = |leg: &str, ms| phase_of(leg, ms, 0);
    let rpy = |ms: u64| {
        let swing = libm::sin(TAU * ms as f64 / CYCLE_MS as f64);
        [0.03 * swing, 0.015 * swing, 0.0]
    };
    let run = Run {
        body: &forward,
        rpy: &rpy,
        phase: Some(&phase),
        ..Run::default()
    };
    let outcome = fitness(&run, "", "");
    let found = outcome.measured.unwrap();
    // The value, not the speed of 0.8 m/s.
    assert_eq!(outcome.detail, "stage 3, weighted speed 0.593 m/s");
    // Peak to peak 0.06 + 0.03 rad: V e^(−0.3). Sampling misses the peaks by 2e-4.
    let expected = SPEED * libm::exp(-0.3);
    assert!(
        (value(found) / expected - 1.0).abs() < 2e-3,
        "{} for {expected}",
        value(found)
    );
    let degrees = fitness(&run, ", angle_unit = '0.5 rad'", "")
        .measured
        .unwrap();
    assert!((value(degrees) / (SPEED * libm::exp(-0.6)) - 1.0).abs() < 3e-3);
    let regular = fitness(&run, ", residual_scale = 0.1", "")
        .measured
        .unwrap();
    assert!((value(regular) / value(found) - 1.0).abs() < 2e-2);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// Whether a fall ends the run or the robot lies until its end: the fitness is the same, to
    /// the bit.
    #[test]
    fn fitness_of_a_fall_does_not_depend_on_the_time_after_it(fall_ms in 1_000..9_900_u64, pace in 0.1..1.5_f64) {
        let body = |ms: u64| {
            let x = pace * ms.min(fall_ms) as f64 / 1000.0 - 0.3 * (ms.saturating_sub(fall_ms)) as f64 / 1000.0;
            [x, 0.0, if ms < fall_ms { 0.12 } else { 0.02 }]
        };
        let phase = |leg: &str, ms| phase_of(leg, ms, 0);
        let run = Run { body: &body, phase: Some(&phase), ..Run::default() };
        let ended = fitness(&run, "", "[fall]\nend = true\n\n");
        let whole = fitness(&run, "", "");
        prop_assert_eq!(ended.measured, whole.measured);
        prop_assert_eq!(ended.verdict, whole.verdict);
        let fell = fall_ms.div_ceil(2) * 2;
        let survived = fell as f64 / 10_000.0;
        let found = value(ended.measured.unwrap());
        let expected = if survived > 0.5 { pace } else { pace * libm::exp(survived - 1.0) };
        prop_assert!((found / expected - 1.0).abs() < 0.02, "{} for {}", found, expected);
        prop_assert_eq!(ended.detail.starts_with("stage 0"), survived <= 0.5);
    }
}

#[test]
fn fitness_of_a_fall_does_not_depend_on_the_time_after_the_window() {
    let body = |ms: u64| {
        [
            SPEED * ms as f64 / 1000.0,
            0.0,
            if ms < 2_400 { 0.12 } else { 0.02 },
        ]
    };
    let phase = |leg: &str, ms| phase_of(leg, ms, 0);
    let run = Run {
        body: &body,
        phase: Some(&phase),
        ..Run::default()
    };
    let judged = |more: &str, duration: &str| {
        let expect = format!("[[expect]]\ngait = {{ fitness = {{ min = 0.1 }} }}\n{more}");
        let text = crate::common::text(&expect).replace("\"10 s\"", duration);
        let end_ms = if duration == "\"4 s\"" { 4_000 } else { 10_000 };
        let scene = crate::common::scene(&text).unwrap();
        judge_run(&scene, &Run { end_ms, ..run }, None)
            .outcomes
            .remove(0)
    };
    let [window, run] = [("before = '4 s'", "\"10 s\""), ("", "\"4 s\"")];
    let (window, run) = (judged(window.0, window.1), judged(run.0, run.1));
    assert!(window.detail.starts_with("stage 3"), "{window:?}");
    assert_eq!(window.measured, run.measured);
}

#[test]
fn other_measures_of_a_robot_that_fell_are_unobserved() {
    let body = |ms: u64| [0.0, 0.0, if ms < 5_000 { 0.12 } else { 0.02 }];
    let run = Run {
        body: &body,
        ..Run::default()
    };
    for measure in [
        "flight_share = { max = 0.5 }",
        "slip = { max = '1 m' }",
        "cycle_residual = { max = 1 }",
    ] {
        let outcome = outcome(&format!("gait = {{ {measure} }}"), &run);
        assert_eq!(
            (outcome.verdict, outcome.detail.as_str()),
            (Verdict::Unobserved, "fell at 5 s")
        );
    }
}

#[test]
fn controller_without_phases_is_refused_with_the_remedy() {
    let scenario = crate::common::parse(&crate::common::text(
        "[[expect]]\ngait = { mismatch = { max = 0.2 } }",
    ))
    .unwrap();
    let mut facts = crate::common::facts(crate::common::legs());
    facts
        .process_ports
        .retain(|port| !port.name.ends_with("/phase"));
    let error = scenario.scene(&facts).unwrap_err().to_string();
    assert!(
        error.contains("leg/LF/phase") && error.contains("phase_output = true"),
        "{error}"
    );
}
