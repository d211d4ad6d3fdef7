//! Claims about an upright robot do not pass after a fall.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::common::run::{JudgedRun, Run, at, judge_run, outcome};
use crate::common::{facts, legs, parse, text};
use twinrig_scenario::{GroundBelow, Outcome, Verdict};

const FALL_MS: u64 = 5000;

/// The synthetic trot at 0.4 m/s, which rolls over at 5 s.
fn rolls_over<'r>() -> Run<'r> {
    Run {
        body: &|ms| [4e-4 * ms as f64, 0.0, 0.12],
        rpy: &|ms| [if ms < FALL_MS { 0.0 } else { -1.1 }, 0.0, 0.0],
        ..Run::default()
    }
}

/// Claims about an upright robot that the synthetic trot satisfies.
const SATISFIED: [&str; 20] = [
    "footstep = { slip = { max = '1 mm' } }",
    "footstep = { stance = { near = '160 ms', within = '1 ms' } }",
    "footstep = { swing = { near = '140 ms', within = '1 ms' } }",
    "footstep = { stride = { max = '1 m' } }",
    "footstep = { impulse = { max = '9 N s' } }",
    "footstep = { peak_load = { max = '6 N' } }",
    "footstep = { position = { max = '9 m' } }",
    "footstep = { duty_factor = { max = 0.6 } }",
    "footstep = { frequency = { min = '3 Hz' } }",
    "footstep = { count = { max = 99 } }",
    "footstep = { phase = 'trot', tolerance = 0.05 }",
    "footstep = { phase_spread = { max = 0.05 } }",
    "footstep = { order = [['LF', 'RH'], ['RF', 'LH']] }",
    "body = { speed = { near = '0.4 m/s', within = '1 %' } }",
    "body = { speed = { near = '0.4 m/s', within = '1 %' }, along = 'path' }",
    "body = { yaw_drift = { max = '1 deg' } }",
    "body = { roll_range = { max = '1 deg' } }",
    "body = { pitch_range = { max = '1 deg' } }",
    "body = { height_range = { max = '1 mm' } }",
    "footstep = { leg = 'LF', count = { min = 10 } }",
];

/// Returns the outcomes of all of them in one run, each in this window.
fn outcomes_of(window: &str, run: &Run<'_>) -> Vec<Outcome> {
    let expectation = |expect: &&str| format!("[[expect]]\n{expect}\n{window}\n");
    let expectations: String = SATISFIED.iter().map(expectation).collect();
    let scene =
        crate::common::scene(&text(&expectations)).unwrap_or_else(|error| panic!("{error}"));
    judge_run(&scene, run, None).outcomes
}

#[test]
fn upright_claims_are_unobserved_after_a_fall() {
    for window in [
        "",
        "after = '1 s'",
        "after = '1 s'\nbefore = '9 s'",
        "before = '5 s'",
        "after = '6 s'",
    ] {
        for (found, expect) in outcomes_of(window, &rolls_over()).iter().zip(SATISFIED) {
            assert_eq!(
                (found.verdict, found.detail.as_str()),
                (Verdict::Unobserved, "fell at 5 s"),
                "{expect} {window}"
            );
            assert_eq!((found.measured, found.margin), (None, None));
        }
    }
    // Windows that end before the fall pass, and all windows pass without a fall.
    let stays = Run {
        rpy: &|_| [0.0; 3],
        ..rolls_over()
    };
    for (window, run) in [("before = '4.999 s'", rolls_over()), ("", stays)] {
        for (found, expect) in outcomes_of(window, &run).iter().zip(SATISFIED) {
            assert_eq!(found.verdict, Verdict::Pass, "{expect}: {found:?}");
        }
    }
}

#[test]
fn violation_before_a_fall_fails() {
    // The foot slips at 2 s, or after the fall.
    let slips = |from: u64| {
        move |_: &str, ms: u64| {
            [
                if (from..from + 100).contains(&ms) {
                    0.01
                } else {
                    0.0
                },
                0.0,
                0.0,
            ]
        }
    };
    let slip = "footstep = { leg = 'LF', slip = { max = '1 mm' } }";
    let found = outcome(
        slip,
        &Run {
            foot: &slips(2150),
            ..rolls_over()
        },
    );
    assert_eq!(
        (found.verdict, found.first_violation),
        (Verdict::Fail, Some(at(2100)))
    );
    let found = outcome(
        slip,
        &Run {
            foot: &slips(6350),
            ..rolls_over()
        },
    );
    assert_eq!(
        (found.verdict, found.detail.as_str()),
        (Verdict::Unobserved, "fell at 5 s")
    );
    // Cycles of the loads up to the fall count, though they are found later.
    for gait in [
        "phase = 'pace', tolerance = 0.1",
        "phase_spread = { min = 0.1 }",
        "duty_factor = { min = 0.8 }",
        "contacts = { min = 2 }",
    ] {
        let found = outcome(&format!("footstep = {{ {gait} }}"), &rolls_over());
        assert_eq!(found.verdict, Verdict::Fail, "{gait}: {found:?}");
    }
    // A mean up to the fall counts; motion after the fall does not affect the speed.
    let slow = "body = { speed = { min = '0.5 m/s' } }";
    let found = outcome(slow, &rolls_over());
    assert_eq!(found.verdict, Verdict::Fail);
    assert!((found.measured.unwrap() - 0.4).abs() < 1e-9, "{found:?}");
    let flung = Run {
        body: &|ms| {
            [
                if ms < FALL_MS { 4e-4 * ms as f64 } else { 99.0 },
                0.0,
                0.12,
            ]
        },
        ..rolls_over()
    };
    let fast = outcome("body = { speed = { max = '1 m/s' } }", &flung);
    assert_eq!(fast.verdict, Verdict::Unobserved);
    let turned = Run {
        rpy: &|ms| {
            [
                if ms < FALL_MS { 0.0 } else { 2.0 },
                0.0,
                if ms == 3000 { 0.1 } else { 0.0 },
            ]
        },
        ..rolls_over()
    };
    let drift = outcome("body = { yaw_drift = { max = '1 deg' } }", &turned);
    assert_eq!(
        (drift.verdict, drift.first_violation),
        (Verdict::Fail, Some(at(3000)))
    );
}

#[test]
fn minimum_count_cut_off_by_a_fall_is_unobserved() {
    // Five seconds hold 17 of its 34 footsteps.
    let count = |limits: &str| {
        let expect = format!("footstep = {{ leg = 'LF', count = {{ {limits} }} }}");
        outcome(&expect, &rolls_over()).verdict
    };
    assert_eq!(count("min = 30"), Verdict::Unobserved);
    assert_eq!(count("min = 10"), Verdict::Unobserved);
    assert_eq!(count("max = 17"), Verdict::Unobserved);
    assert_eq!(count("max = 16"), Verdict::Fail);
    assert_eq!(count("near = 30, within = 2"), Verdict::Unobserved);
}

#[test]
fn footstep_interrupted_by_a_fall_counts_up_to_the_fall() {
    // LF is in contact from 4.8 s to 4.96 s, RF from 4.95 s: the open footstep of RF has slipped.
    let slips = Run {
        foot: &|leg, ms| [if leg == "RF" && ms > 4980 { 0.01 } else { 0.0 }, 0.0, 0.0],
        ..rolls_over()
    };
    let slip = outcome("footstep = { slip = { max = '1 mm' } }", &slips);
    assert_eq!(
        (slip.verdict, slip.first_violation),
        (Verdict::Fail, Some(at(4950)))
    );
    let stance = outcome("footstep = { stance = { min = '159 ms' } }", &slips);
    assert_eq!(
        stance.verdict,
        Verdict::Unobserved,
        "its stance is not over: {stance:?}"
    );
}

#[test]
fn claims_about_the_fall_are_judged_after_it() {
    let body = |expect: &str| outcome(&format!("body = {{ {expect} }}"), &rolls_over());
    assert_eq!(body("fall = false").verdict, Verdict::Fail);
    assert_eq!(body("roll = { max = '30 deg' }").verdict, Verdict::Fail);
    assert_eq!(body("height = { min = '10 cm' }").verdict, Verdict::Pass);
}

/// Returns the outcome of the footstep frequency, which is satisfied without a fall, with `more` in
/// the scenario.
fn frequency(more: &str, ground: GroundBelow, run: &Run<'_>) -> (Outcome, JudgedRun) {
    let text = text(more) + "\n[[expect]]\nfootstep = { frequency = { min = '3 Hz' } }\n";
    let scenario = parse(&text).unwrap_or_else(|error| panic!("{error}"));
    let legs = scenario.legs(&legs()).unwrap();
    let facts = twinrig_scenario::Facts {
        ground,
        ..facts(legs)
    };
    let scene = scenario.scene(&facts).unwrap();
    let judged = judge_run(&scene, run, None);
    (judged.outcomes.last().unwrap().clone(), judged)
}

/// Returns the time at which the synthetic trot falls with the trunk at `body` and rotated by
/// `rpy`.
fn falls(
    more: &str,
    ground: GroundBelow,
    body: &dyn Fn(u64) -> [f64; 3],
    rpy: &dyn Fn(u64) -> [f64; 3],
) -> Option<u64> {
    let run = Run {
        body,
        rpy,
        ..Run::default()
    };
    let (outcome, judged) = frequency(more, ground, &run);
    let fell_at = judged.judge.fell_at();
    let verdict = if fell_at.is_some() {
        Verdict::Unobserved
    } else {
        Verdict::Pass
    };
    assert_eq!(outcome.verdict, verdict, "{outcome:?}");
    fell_at.map(|at| at.as_nanos() / 1_000_000)
}

#[test]
fn roll_or_pitch_beyond_sixty_degrees_is_a_fall() {
    let tilted = |more: &str, degrees: f64, element: usize| {
        let rpy = move |ms| {
            let mut rpy = [0.0; 3];
            rpy[element] = if ms == FALL_MS {
                degrees * PI / 180.0
            } else {
                0.0
            };
            rpy
        };
        falls(more, GroundBelow::Level, &|_| [0.0, 0.0, 0.12], &rpy)
    };
    for element in [0, 1] {
        for sign in [-1.0, 1.0] {
            assert_eq!(tilted("", sign * 59.9, element), None);
            assert_eq!(tilted("", sign * 60.1, element), Some(FALL_MS));
            assert_eq!(
                tilted("[fall]\ntilt = '70 deg'", sign * 69.9, element),
                None
            );
            assert_eq!(
                tilted("[fall]\ntilt = '70 deg'", sign * 70.1, element),
                Some(FALL_MS)
            );
            assert_eq!(
                tilted("[fall]\ntilt = '10 deg'", sign * 10.1, element),
                Some(FALL_MS)
            );
        }
    }
    assert_eq!(tilted("", 170.0, 2), None, "yaw is none");
    // Wider thresholds of an expectation extend those of the scenario; an expectation with narrower
    // thresholds fails independently.
    let expect = |tilt: &str| {
        format!("[[expect]]\nbody = {{ fall = {{ height = 0.1, tilt = '{tilt}' }} }}\n")
    };
    assert_eq!(tilted(&expect("80 deg"), 79.0, 0), None);
    assert_eq!(tilted(&expect("80 deg"), 81.0, 0), Some(FALL_MS));
    assert_eq!(tilted(&expect("20 deg"), 59.0, 0), None);
    let both = format!("[fall]\ntilt = '70 deg'\n{}", expect("80 deg"));
    assert_eq!(tilted(&both, 71.0, 0), Some(FALL_MS));
}

#[test]
fn low_height_above_local_ground_is_a_fall() {
    let low = |more: &str, ground: GroundBelow, first: f64, later: f64| {
        let body = move |ms| {
            [
                4e-4 * ms as f64,
                0.0,
                if ms < FALL_MS { first } else { later },
            ]
        };
        falls(more, ground, &body, &|_| [0.0; 3])
    };
    let level = || GroundBelow::Level;
    assert_eq!(low("", level(), 0.2, 0.0601), None);
    assert_eq!(low("", level(), 0.2, 0.0599), Some(FALL_MS));
    assert_eq!(
        low("[fall]\nheight = 0.5", level(), 0.2, 0.099),
        Some(FALL_MS)
    );
    assert_eq!(low("[fall]\nheight = 0.1", level(), 0.2, 0.021), None);
    // A step down by more than the height of the trunk: below the step it is upright, above the
    // edge it has fallen.
    let step = || GroundBelow::Heights(Arc::new(|x: f64, _| if x < 1.0 { 0.0 } else { -0.3 }));
    assert_eq!(low("", step(), 0.2, -0.1), None);
    assert_eq!(low("", step(), 0.2, -0.25), Some(FALL_MS));
    // The start is on elevated ground.
    let high = || GroundBelow::Heights(Arc::new(|_, _| 1.0));
    assert_eq!(low("", high(), 1.2, 1.061), None);
    assert_eq!(low("", high(), 1.2, 1.059), Some(FALL_MS));
    // Without ground there is no fall, nor if the trunk starts below ground level.
    assert_eq!(low("", GroundBelow::Nothing, 0.2, -9.0), None);
    assert_eq!(low("", level(), -0.2, -9.0), None);
}

#[test]
fn fall_requires_observation_of_the_trunk() {
    // As on hardware: foot force sensors, and no position in the world.
    let scenario = parse(&text(
        "[[expect]]\nfootstep = { frequency = { min = '3 Hz' } }",
    ))
    .unwrap();
    let legs = scenario.legs(&legs()).unwrap();
    let mut facts = facts(legs);
    facts
        .plant_outputs
        .retain(|port| !port.name.starts_with("body/"));
    let scene = scenario.scene(&facts).unwrap();
    let judged = judge_run(&scene, &rolls_over(), None);
    assert_eq!(judged.judge.fell_at(), None);
    assert_eq!(judged.outcomes[0].verdict, Verdict::Pass);
}

#[test]
fn fall_ends_the_run_if_configured() {
    let expect = "
        [[expect]]
        footstep = { frequency = { min = '3 Hz' } }
        before = '4 s'
        [[expect]]
        footstep = { frequency = { min = '3 Hz' } }
        [[expect]]
        body = { height = { min = '10 cm' } }
        [[expect]]
        cost = { steps = { min = 1 } }
        [[expect]]
        body = { roll = { max = '10 deg' } }
    ";
    let judged = |more: &str| {
        let text = text(&format!("{more}\n{expect}"));
        let scene = crate::common::scene(&text).unwrap_or_else(|error| panic!("{error}"));
        assert!(scene.scenario.ends_with_a_fall());
        judge_run(&scene, &rolls_over(), None)
    };
    for (more, skip) in [
        ("[fall]\nend = true", 0),
        ("[[expect]]\nbody = { fall = { end = true } }", 1),
    ] {
        let judged = judged(more);
        assert_eq!(judged.judge.ended_at(), Some(at(FALL_MS)), "{more}");
        let found = judged.outcomes.iter().skip(skip);
        let found: Vec<_> = found
            .map(|one| (one.verdict, one.detail.as_str()))
            .collect();
        let fell = (Verdict::Unobserved, "fell at 5 s");
        assert_eq!(found[0].0, Verdict::Pass, "its time was over: {more}");
        assert_eq!(found[1..4], [fell; 3], "{more}");
        assert_eq!(found[4].0, Verdict::Fail, "{more}");
        if skip == 1 {
            assert_eq!(judged.outcomes[0].verdict, Verdict::Fail);
        }
    }
    // Thresholds and window of an expectation are independent of the others.
    let strict = "[[expect]]\nbody = { fall = { tilt = '10 deg', end = true } }\nbefore = '3 s'";
    assert_eq!(judged(strict).judge.ended_at(), None);
    let tilts = Run {
        rpy: &|ms| [if ms < 2000 { 0.0 } else { 0.3 }, 0.0, 0.0],
        ..Run::default()
    };
    let scene = crate::common::scene(&text(strict)).unwrap();
    assert_eq!(
        judge_run(&scene, &tilts, None).judge.ended_at(),
        Some(at(2000))
    );
}

#[test]
fn footsteps_are_detected_after_a_fall() {
    let scene =
        crate::common::scene(&text("[[expect]]\nfootstep = { slip = { max = '1 mm' } }")).unwrap();
    let found = judge_run(&scene, &rolls_over(), None).footsteps;
    let stands = Run {
        rpy: &|_| [0.0; 3],
        ..rolls_over()
    };
    assert_eq!(found, judge_run(&scene, &stands, None).footsteps);
    assert_eq!(found.iter().filter(|step| step.leg == 0).count(), 34);
}
