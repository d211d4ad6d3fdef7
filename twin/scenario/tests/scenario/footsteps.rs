//! Detection and judgement of footsteps.

use crate::common::run::{
    CYCLE_MS, PERIOD_MS, Run, STANCE_MS, at, judge_run, judge_with, outcome, trot_load,
};
use proptest::prelude::*;
use twinrig_scenario::{Footstep, Verdict};

fn footsteps(run: &Run<'_>) -> Vec<Footstep> {
    let scene = crate::common::scene(&crate::common::text("")).unwrap();
    judge_with(&scene, run, None).1
}

fn of_leg(steps: &[Footstep], leg: usize) -> Vec<Footstep> {
    steps
        .iter()
        .copied()
        .filter(|step| step.leg == leg)
        .collect()
}

#[test]
fn periodic_trot_is_detected_with_the_resolution_of_the_observation() {
    let steps = footsteps(&Run::default());
    let first = of_leg(&steps, 0);
    assert_eq!(first.len(), 34);
    for (index, step) in first.iter().enumerate() {
        let begin = CYCLE_MS * index as u64;
        assert_eq!(step.touch_down, at(begin));
        let lift_off = (begin + STANCE_MS <= 10_000).then(|| at(begin + STANCE_MS));
        assert_eq!(step.lift_off, lift_off);
        assert_eq!(step.peak_load, 5.4);
        assert_eq!(step.slip, 0.0);
    }
    // 80 observations of 2 ms at 5.4 N.
    assert!((first[1].impulse - 5.4 * 0.16).abs() < 1e-12);
}

#[test]
fn measures_of_a_synthetic_trot_are_recovered() {
    let run = Run::default();
    let measured = |expect: &str| {
        outcome(&format!("footstep = {{ {expect} }}\nafter = '1 s'"), &run)
            .measured
            .unwrap()
    };
    let (cycle, stance) = (CYCLE_MS as f64 / 1000.0, STANCE_MS as f64 / 1000.0);
    let duty = measured("duty_factor = { max = 0.99 }, by = 'touch-down'");
    assert!((duty - stance / cycle).abs() < 1e-12);
    // By the loads to a thousandth: the observations of 2 ms are a 75th of half a cycle.
    assert!((measured("duty_factor = { max = 0.99 }") - stance / cycle).abs() < 1e-3);
    assert!((measured("contacts = { max = 9 }") - 1.0).abs() < 1e-3);
    assert!((measured("stance = { max = '1 s' }") - stance).abs() < 1e-12);
    assert!((measured("swing = { max = '1 s' }") - (cycle - stance)).abs() < 1e-12);
    assert!((measured("frequency = { max = '9 Hz' }") - 1.0 / cycle).abs() < 1e-12);
    assert!((measured("impulse = { max = '9 N s' }") - 5.4 * stance).abs() < 1e-12);
    assert!((measured("peak_load = { max = '9 N' }") - 5.4).abs() < 1e-12);
    assert_eq!(measured("count = { min = 1 }"), 30.0);
    for by in ["load", "touch-down"] {
        let measured = |expect: &str| measured(&format!("{expect}, by = '{by}'"));
        assert!(measured("phase = 'trot', tolerance = 0.1") < 1e-6);
        assert!((measured("phase = 'pace', tolerance = 0.1") - 0.5).abs() < 1e-6);
        assert!(measured("phase_spread = { max = 0.1 }") < 1e-5);
    }
    assert!(measured("phase = { LF = 0.2, RF = 0.7, LH = 0.7, RH = 0.2 }, tolerance = 0.1") < 1e-9);
    assert_eq!(measured("order = [['LF', 'RH'], ['RF', 'LH']]"), 0.0);
    assert!(measured("order = ['LF', 'RF', 'RH', 'LH']") > 10.0);
}

#[test]
fn slip_share_is_slip_over_the_travel_in_stance() {
    // Strides of 120 mm, in whose stance of 160 of 300 ms the foot slides 30 mm.
    let slide = |ms: u64| 0.03 * ms.min(STANCE_MS) as f64 / STANCE_MS as f64;
    let run = Run {
        foot: &|_, ms| {
            [
                0.12 * (ms / CYCLE_MS) as f64 + slide(ms % CYCLE_MS),
                0.0,
                0.0,
            ]
        },
        ..Run::default()
    };
    let found = outcome("footstep = { leg = 'LF', slip_share = { max = 1 } }", &run);
    // In contact up to the observation before the lift-off.
    let slip = slide(STANCE_MS - PERIOD_MS);
    let travel = 0.12 * STANCE_MS as f64 / CYCLE_MS as f64;
    assert!(
        (found.measured.unwrap() - slip / travel).abs() < 1e-9,
        "{found:?}"
    );
}

/// Load of a leg that touches down at its share of the cycle.
fn shares(leg: &str, ms: u64, shares: [u64; 4]) -> f64 {
    let index = ["LF", "RF", "LH", "RH"]
        .iter()
        .position(|name| *name == leg)
        .unwrap();
    let phase = (ms + 1000 - shares[index]) % 1000;
    if phase < 700 { 3.0 } else { 0.0 }
}

#[test]
fn walk_is_a_lateral_sequence() {
    let walk = Run {
        load: &|leg, ms| shares(leg, ms, [0, 500, 750, 250]),
        ..Run::default()
    };
    let pass = outcome(
        "footstep = { phase = 'walk', tolerance = 0.01 }\nafter = '1 s'",
        &walk,
    );
    assert_eq!(pass.verdict, Verdict::Pass, "{pass:?}");
    let order = "footstep = { order = ['LH', 'LF', 'RH', 'RF'] }\nafter = '1 s'";
    assert_eq!(outcome(order, &walk).verdict, Verdict::Pass);
    let diagonal = Run {
        load: &|leg, ms| shares(leg, ms, [0, 500, 250, 750]),
        ..Run::default()
    };
    assert_eq!(
        outcome("footstep = { phase = 'walk', tolerance = 0.1 }", &diagonal).verdict,
        Verdict::Fail
    );
    assert_eq!(outcome(order, &diagonal).verdict, Verdict::Fail);
    let bound = Run {
        load: &|leg, ms| shares(leg, ms, [0, 0, 500, 500]),
        ..Run::default()
    };
    assert_eq!(
        outcome("footstep = { phase = 'bound', tolerance = 0.01 }", &bound).verdict,
        Verdict::Pass
    );
}

#[test]
fn leg_with_few_touch_downs_has_no_phase() {
    let lame = Run {
        load: &|leg, ms| {
            if leg == "RH" && ms > 4000 {
                0.0
            } else {
                trot_load(leg, ms)
            }
        },
        ..Run::default()
    };
    for expect in [
        "phase = 'trot', tolerance = 0.49",
        "phase_spread = { max = 1 }",
        "phase_spread = { max = 1 }, by = 'touch-down'",
    ] {
        let phase = outcome(&format!("footstep = {{ {expect} }}"), &lame);
        assert_eq!(
            (phase.verdict, phase.detail.as_str()),
            (Verdict::Unobserved, "RH touched down 14 times")
        );
    }
}

#[test]
fn phase_deviation_wraps_around() {
    for by in ["load", "touch-down"] {
        deviation_wraps_around(by);
    }
}

fn deviation_wraps_around(by: &str) {
    // RH touches down 4 ms before or after LF in turn: its phase is close to 0 from both sides.
    let jittery = Run {
        load: &|leg, ms| {
            let early = leg == "RH" && (ms / CYCLE_MS) % 2 == 1 && ms % CYCLE_MS > 290;
            if early { 5.4 } else { trot_load(leg, ms) }
        },
        ..Run::default()
    };
    let expect = format!("footstep = {{ phase = 'trot', tolerance = 0.05, by = '{by}' }}");
    let phase = outcome(&expect, &jittery);
    assert_eq!(phase.verdict, Verdict::Pass, "{phase:?}");
}

#[test]
fn bounces_and_scuffs_are_no_footsteps() {
    let bounces = Run {
        load: &|leg, ms| match ms % CYCLE_MS {
            // From 20 ms to 40 ms after touch-down the foot is off the ground.
            20..40 if leg == "LF" => 0.0,
            // In mid-swing it touches the ground with a small load.
            220..226 if leg == "LF" => 0.6,
            _ => trot_load(leg, ms),
        },
        foot: &|_, ms| [if ms % CYCLE_MS < 30 { 0.0 } else { 0.01 }, 0.0, 0.0],
        ..Run::default()
    };
    let steps = of_leg(&footsteps(&bounces), 0);
    assert_eq!(steps.len(), 34);
    assert_eq!(steps[3].touch_down, at(3 * CYCLE_MS));
    assert_eq!(steps[3].lift_off, Some(at(3 * CYCLE_MS + STANCE_MS)));
    // The position is that of the contact with the larger impulse, and motion off the ground is no
    // slip.
    assert_eq!(steps[3].position[0], 0.01);
    assert_eq!(steps[3].slip, 0.0);
    assert!((steps[3].impulse - 5.4 * 0.14).abs() < 1e-9);
}

#[test]
fn slip_is_the_greatest_distance_in_contact() {
    let slides = Run {
        // 3 mm forward and 4 mm to the side during the stance; a swing of half a metre.
        foot: &|_, ms| {
            let share = (ms % CYCLE_MS) as f64 / STANCE_MS as f64;
            let share = if share < 1.0 { share } else { 100.0 };
            [3e-3 * share, 4e-3 * share, 0.0]
        },
        load: &|_, ms| if ms % CYCLE_MS < STANCE_MS { 5.4 } else { 0.0 },
        ..Run::default()
    };
    let slip = outcome("footstep = { slip = { max = '4.9 mm' } }", &slides);
    assert_eq!(slip.verdict, Verdict::Fail);
    assert!(
        (slip.measured.unwrap() - 5e-3 * 158.0 / 160.0).abs() < 1e-9,
        "{slip:?}"
    );
    assert_eq!(slip.first_violation, Some(at(0)));
}

#[test]
fn thresholds_have_hysteresis() {
    // 0.05 and 0.02 of 10.8 N are 0.54 N and 0.216 N. The load stays between them without a
    // touch-down.
    let hovers = Run {
        load: &|_, ms| if ms % 4 == 0 { 0.5 } else { 0.3 },
        ..Run::default()
    };
    assert!(footsteps(&hovers).is_empty());
    let lands = Run {
        load: &|_, ms| if ms == 1000 { 0.6 } else { 0.3 },
        ..Run::default()
    };
    let steps = footsteps(&lands);
    assert_eq!(steps.len(), 4);
    assert_eq!((steps[0].touch_down, steps[0].lift_off), (at(1000), None));
}

/// Foot positions of the synthetic trot at 0.4 m/s, with steps that are `by` longer in each cycle
/// from 5 s.
fn walker(by: f64) -> impl Fn(&str, u64) -> [f64; 3] {
    move |leg, ms| {
        let late = if matches!(leg, "LF" | "RH") {
            0
        } else {
            CYCLE_MS / 2
        };
        let cycle = (ms + CYCLE_MS - late) / CYCLE_MS;
        let changed = cycle.saturating_sub(5000 / CYCLE_MS + 1);
        [0.12 * cycle as f64 + by * changed as f64, 0.0, 0.0]
    }
}

#[test]
fn displacement_refers_to_the_same_cycle_without_the_change() {
    let change = "[[change]]\nat = '5 s'\nset = 'step_length'\nby = '-1 cm'\n";
    let reference = Run {
        foot: &walker(0.0),
        ..Run::default()
    };
    let judged = |expect: &str, run: &Run<'_>| {
        let text = crate::common::text(&format!(
            "{change}\n[[expect]]\nfootstep = {{ {expect}, against = 'without changes' }}"
        ));
        let scene = crate::common::scene(&text).unwrap();
        assert!(scene.scenario.needs_reference());
        let without = judge_run(&scene, &reference, None).judge.reference();
        let (mut with, _) = judge_with(&scene, run, Some(&without));
        let (none, _) = judge_with(&scene, run, None);
        assert_eq!(none[0].verdict, Verdict::Unobserved);
        with.remove(0)
    };
    let shorter = Run {
        foot: &walker(-0.01),
        ..Run::default()
    };
    for cycle in 1..=4_u32 {
        let outcome = judged(
            &format!("leg = 'LF', displacement = {{ max = '-1 mm' }}, cycle = {cycle}"),
            &shorter,
        );
        assert_eq!(outcome.verdict, Verdict::Pass);
        assert!(
            (outcome.measured.unwrap() + 0.01 * f64::from(cycle)).abs() < 1e-9,
            "{outcome:?}"
        );
    }
    // A stumble splits one stance into two; counting touch-downs would compare cycle 3 with cycle
    // 2.
    let stumbles = Run {
        load: &|leg, ms| {
            if (5450..5520).contains(&ms) {
                0.0
            } else {
                trot_load(leg, ms)
            }
        },
        ..shorter
    };
    let outcome = judged(
        "leg = 'LF', displacement = { max = '-1 mm' }, cycle = 3",
        &stumbles,
    );
    assert!(
        (outcome.measured.unwrap() + 0.03).abs() < 1e-9,
        "{outcome:?}"
    );
    // Without the third cycle, the adjacent footsteps belong to other cycles.
    let misses = Run {
        load: &|leg, ms| {
            if (5500..6100).contains(&ms) {
                0.0
            } else {
                trot_load(leg, ms)
            }
        },
        foot: &walker(-0.01),
        ..Run::default()
    };
    let missed = judged(
        "leg = 'LF', displacement = { max = '9 m' }, cycle = 3",
        &misses,
    );
    assert_eq!(missed.verdict, Verdict::Unobserved);
    let beyond = judged("displacement = { max = '0 mm' }, cycle = 99", &shorter);
    assert_eq!(beyond.verdict, Verdict::Unobserved);
}

proptest! {
    // A case is a run of 5000 observations.
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Footsteps of any load are ordered, separated, and within the run.
    #[test]
    fn footsteps_of_any_load_are_ordered_and_separated(
        loads in proptest::collection::vec(prop_oneof![Just(0.0), 0.0..1.0_f64, 0.0..10.0_f64], 1..400),
    ) {
        let run = Run {
            load: &|_, ms| loads[usize::try_from(ms / 2).unwrap() % loads.len()],
            ..Run::default()
        };
        let steps = of_leg(&footsteps(&run), 2);
        for step in &steps {
            prop_assert!(step.impulse >= 5e-3 * 10.8);
            prop_assert!(step.peak_load >= 0.05 * 10.8);
            prop_assert!(step.lift_off.is_none_or(|lift_off| lift_off > step.touch_down));
        }
        for pair in steps.windows(2) {
            let lift_off = pair[0].lift_off.unwrap();
            prop_assert!((pair[1].touch_down - lift_off).as_nanos() >= 40_000_000);
        }
        // The impulse of the footsteps is at most that of the load; the difference is that of
        // rejected contacts.
        let found: f64 = steps.iter().map(|step| step.impulse).sum();
        let all: f64 = (1..=5000).map(|k| loads[k % loads.len()] * 2e-3).sum();
        prop_assert!(found <= all + 1e-9, "{} {}", found, all);
    }

    /// Cycle and stance are recovered with the resolution of the observation.
    #[test]
    fn cycle_and_stance_are_recovered(cycle in 100..600_u64, percent in 30..70_u64) {
        let cycle = 2 * cycle;
        let stance = cycle * percent / 100 / 2 * 2;
        prop_assume!(cycle - stance >= 40);
        let run = Run {
            load: &|_, ms| if ms % cycle < stance { 5.0 } else { 0.0 },
            ..Run::default()
        };
        let measured = |expect: &str| outcome(&format!("footstep = {{ {expect} }}"), &run).measured.unwrap();
        let frequency = measured("frequency = { max = '99 Hz' }");
        prop_assert!((frequency - 1000.0 / cycle as f64).abs() < 1e-9);
        let duty = measured("duty_factor = { max = 0.99 }, by = 'touch-down'");
        prop_assert!((duty - stance as f64 / cycle as f64).abs() < 1e-9);
    }
}
