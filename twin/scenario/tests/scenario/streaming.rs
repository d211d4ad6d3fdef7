//! The running statistics of the judge agree with a batch evaluation of all footsteps.

use std::f64::consts::TAU;

use crate::common::run::{Run, at, judge_run};
use crate::common::{scene, text};
use proptest::prelude::*;
use twinrig_scenario::{Footstep, Outcome, Verdict};

const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];
const AFTER_MS: u64 = 700;
const BEFORE_MS: u64 = 5200;

/// Expectations with limits in the middle of the range of the random gaits, so that both verdicts
/// occur, and these limits as numbers.
const EXPECTATIONS: [(&str, f64, f64); 14] = [
    ("slip = { max = '3 mm' }", UNBOUNDED, 3e-3),
    ("impulse = { max = '0.9 N s' }", UNBOUNDED, 0.9),
    ("peak_load = { min = '2 N' }", 2.0, -UNBOUNDED),
    ("stance = { max = '0.3 s' }", UNBOUNDED, 0.3),
    ("position = { max = '2.4 m' }", UNBOUNDED, 2.4),
    ("swing = { max = '0.35 s' }", UNBOUNDED, 0.35),
    ("stride = { max = '0.25 m' }", UNBOUNDED, 0.25),
    (
        "duty_factor = { max = 0.55 }, by = 'touch-down'",
        UNBOUNDED,
        0.55,
    ),
    ("frequency = { min = '2.5 Hz' }", 2.5, -UNBOUNDED),
    ("count = { min = 12, max = 14 }", 12.0, 14.0),
    (
        "phase = 'trot', tolerance = 0.2, by = 'touch-down'",
        UNBOUNDED,
        0.2,
    ),
    (
        "phase_spread = { max = 0.2 }, by = 'touch-down'",
        UNBOUNDED,
        0.2,
    ),
    ("order = [['LF', 'RH'], ['RF', 'LH']]", UNBOUNDED, 0.0),
    (
        "leg = ['RH', 'RF'], phase_spread = { max = 0.25 }, by = 'touch-down'",
        UNBOUNDED,
        0.25,
    ),
];

const UNBOUNDED: f64 = f64::NEG_INFINITY;

/// Steps of a leg: stance time \[ms\], load \[N\] and swing time \[ms\], including bounces and
/// scuffs.
type Steps = Vec<(u64, f64, u64)>;

fn steps() -> impl Strategy<Value = Steps> {
    let stance = prop_oneof![6 => 100..260_u64, 1 => 2..20_u64, 1 => 300..900_u64];
    let swing = prop_oneof![6 => 90..260_u64, 1 => 2..40_u64, 1 => 300..900_u64];
    proptest::collection::vec((stance, 0.1..9.0_f64, swing), 1..12)
}

/// Returns load and index of the step of a leg at a time.
fn state(steps: &Steps, ms: u64) -> (f64, u64) {
    let cycle: u64 = steps.iter().map(|(stance, _, swing)| stance + swing).sum();
    let mut rest = ms % cycle;
    let turns = ms / cycle * steps.len() as u64;
    for (number, (stance, load, swing)) in steps.iter().enumerate() {
        let number = turns + number as u64;
        if rest < *stance {
            return (*load, number);
        }
        rest -= stance;
        if rest < *swing {
            return (0.0, number);
        }
        rest -= swing;
    }
    (0.0, turns)
}

/// Returns the footsteps of a leg that touch down within the window.
fn of_leg(all: &[Footstep], leg: usize) -> Vec<Footstep> {
    let within = |step: &&Footstep| {
        step.leg == leg && step.touch_down >= at(AFTER_MS) && step.touch_down <= at(BEFORE_MS)
    };
    all.iter().filter(within).copied().collect()
}

fn s(nanos: u64) -> f64 {
    nanos as f64 * 1e-9
}

fn seconds(step: &Footstep) -> f64 {
    s(step.touch_down.as_nanos())
}

fn stance(step: &Footstep) -> Option<f64> {
    Some(s((step.lift_off? - step.touch_down).as_nanos()))
}

/// Returns the values of a leg's footsteps for a measure: one for each footstep or pair, or a mean;
/// none if there is no value.
fn numbers(measure: &str, steps: &[Footstep]) -> Vec<f64> {
    let each = |number: fn(&Footstep) -> Option<f64>| steps.iter().filter_map(number).collect();
    let pairs = |number: fn(&Footstep, &Footstep) -> Option<f64>| {
        let pairs = steps.windows(2);
        pairs
            .filter_map(|pair| number(&pair[0], &pair[1]))
            .collect()
    };
    let mean = |number: Option<f64>| number.into_iter().collect();
    match measure {
        "slip" => each(|step| Some(step.slip)),
        "impulse" => each(|step| step.lift_off.map(|_| step.impulse)),
        "peak_load" => each(|step| Some(step.peak_load)),
        "stance" => each(stance),
        "position" => each(|step| Some(step.position[0])),
        "swing" => pairs(|step, next| Some(seconds(next) - s(step.lift_off?.as_nanos()))),
        "stride" => pairs(|step, next| {
            let [x, y] = [0, 1].map(|axis| next.position[axis] - step.position[axis]);
            Some(libm::hypot(x, y))
        }),
        "count" => vec![steps.len() as f64],
        "frequency" if steps.len() > 1 => {
            let time = seconds(&steps[steps.len() - 1]) - seconds(&steps[0]);
            vec![(steps.len() - 1) as f64 / time]
        }
        "duty_factor" if steps.len() > 1 => {
            let shares = steps
                .windows(2)
                .map(|pair| Some(stance(&pair[0])? / (seconds(&pair[1]) - seconds(&pair[0]))));
            let sum: Option<f64> = shares.sum();
            mean(sum.map(|sum| sum / (steps.len() - 1) as f64))
        }
        _ => Vec::new(),
    }
}

/// Returns mean and spread of the phase of `leg` in the cycle of `first`; none with too few
/// touch-downs.
fn phase(all: &[Footstep], first: usize, leg: usize) -> Option<(f64, f64)> {
    let begins: Vec<f64> = of_leg(all, first).iter().map(seconds).collect();
    if begins.len() < 3 {
        return None;
    }
    let mut shares = Vec::new();
    for step in of_leg(all, leg) {
        let time = seconds(&step);
        let cycle = begins
            .windows(2)
            .find(|cycle| (cycle[0]..cycle[1]).contains(&time));
        shares.extend(cycle.map(|cycle| (time - cycle[0]) / (cycle[1] - cycle[0])));
    }
    if 2 * shares.len() < begins.len() - 1 {
        return None;
    }
    let sum = |of: fn(f64) -> f64| shares.iter().map(|share| of(TAU * share)).sum::<f64>();
    let (x, y) = (sum(libm::cos), sum(libm::sin));
    let length = (libm::hypot(x, y) / shares.len() as f64).min(1.0);
    Some((
        libm::atan2(y, x) / TAU,
        (-2.0 * libm::log(length)).max(0.0).sqrt() / TAU,
    ))
}

/// Counts touch-downs, and those that belong neither to the present group nor to the next one.
fn out_of_order(all: &[Footstep]) -> (usize, usize) {
    let mut group_legs: Vec<usize> = Vec::new();
    let (mut total, mut wrong) = (0, 0);
    let mut steps: Vec<Footstep> = (0..4).flat_map(|leg| of_leg(all, leg)).collect();
    steps.sort_by_key(|step| (step.touch_down, step.leg));
    let group = |leg: usize| usize::from(leg == 1 || leg == 2);
    for step in steps {
        total += 1;
        let same = group_legs
            .first()
            .is_some_and(|leg| group(*leg) == group(step.leg));
        if same && !group_legs.contains(&step.leg) {
            group_legs.push(step.leg);
            continue;
        }
        let next = group_legs.is_empty() || (!same && group_legs.len() == 2);
        wrong += usize::from(!next && total > 2);
        group_legs = vec![step.leg];
    }
    (total, wrong)
}

fn margin(number: f64, least: f64, most: f64) -> f64 {
    (number - least).min(most - number)
}

/// Returns the value with the least margin; none if one is missing and no other violates the
/// limits.
fn nearest(numbers: Vec<f64>, missing: bool, least: f64, most: f64) -> Option<f64> {
    let margin = |number: f64| margin(number, least, most);
    let numbers = numbers.into_iter();
    let worst = numbers.min_by(|a, b| margin(*a).total_cmp(&margin(*b)))?;
    (!missing || margin(worst) < 0.0).then_some(worst)
}

/// Returns the displacements of the footsteps of cycle `cycle` from the run without changes, and
/// whether that of a leg is missing.
fn displacements(
    changed_steps: &[Footstep],
    reference_steps: &[Footstep],
    cycle: usize,
) -> (Vec<f64>, bool) {
    let displacement = |leg: usize| {
        let of_leg = |all: &[Footstep]| -> Vec<Footstep> {
            all.iter().filter(|step| step.leg == leg).copied().collect()
        };
        let reference_steps = of_leg(reference_steps);
        let after = reference_steps
            .iter()
            .filter(|step| step.touch_down > at(AFTER_MS));
        let after: Vec<&Footstep> = after.collect();
        let step = *after.get(cycle - 1)?;
        let beside = after
            .get(cycle)
            .or_else(|| after.get(cycle.checked_sub(2)?));
        let nanos = |step: &Footstep| step.touch_down.as_nanos();
        let stride = nanos(beside?).abs_diff(nanos(step));
        let off = |other: &Footstep| nanos(other).abs_diff(nanos(step));
        let changed_steps = of_leg(changed_steps).into_iter().min_by_key(off)?;
        let within = step.touch_down <= at(BEFORE_MS) && 2 * off(&changed_steps) < stride;
        within.then(|| changed_steps.position[0] - step.position[0])
    };
    let values: Vec<f64> = (0..4).filter_map(displacement).collect();
    let missing = values.len() < 4;
    (values, missing)
}

/// Checks that the outcome has the value, within `slack`.
fn agrees(
    outcome: &Outcome,
    number: Option<f64>,
    (least, most): (f64, f64),
    slack: f64,
) -> Result<(), TestCaseError> {
    let Some(number) = number else {
        prop_assert_eq!(outcome.verdict, Verdict::Unobserved, "{:?}", outcome);
        return Ok(());
    };
    let measured = outcome.measured;
    prop_assert!(
        measured.is_some_and(|measured| (measured - number).abs() < slack),
        "{} {:?}",
        number,
        outcome
    );
    let margin = margin(number, least, most);
    if margin == 0.0 || margin.abs() > slack {
        let verdict = if margin < 0.0 {
            Verdict::Fail
        } else {
            Verdict::Pass
        };
        prop_assert_eq!(outcome.verdict, verdict, "{} {:?}", number, outcome);
    }
    Ok(())
}

/// Batch evaluation: returns the value with the least margin; none if a leg has none and no other
/// violates the limits.
fn batch_value(expect: &str, least: f64, most: f64, all: &[Footstep]) -> Option<f64> {
    let nearest = |numbers, missing| nearest(numbers, missing, least, most);
    let phases = |first: usize, legs: &[usize]| {
        let values: Vec<_> = legs
            .iter()
            .filter_map(|leg| Some((*leg, phase(all, first, *leg)?)))
            .collect();
        let missing = values.len() < legs.len();
        (values, missing)
    };
    match expect.split(' ').next().unwrap() {
        "phase" => {
            let (values, missing) = phases(0, &[1, 2, 3]);
            let off = values.into_iter().map(|(leg, (mean, _))| {
                let off = mean - if leg == 3 { 0.0 } else { 0.5 };
                (off - off.round()).abs()
            });
            nearest(off.collect(), missing)
        }
        "phase_spread" => {
            let (values, missing) = phases(0, &[1, 2, 3]);
            nearest(
                values.into_iter().map(|(_, (_, spread))| spread).collect(),
                missing,
            )
        }
        "leg" => Some(phase(all, 1, 3)?.1),
        "order" => {
            let (total, wrong) = out_of_order(all);
            (total >= 8 || wrong > 0).then_some(wrong as f64)
        }
        measure => {
            let numbers = (0..4).map(|leg| numbers(measure, &of_leg(all, leg)));
            let numbers: Vec<Vec<f64>> = numbers.collect();
            let missing = numbers.iter().any(Vec::is_empty);
            nearest(numbers.concat(), missing)
        }
    }
}

proptest! {
    // A case is a run of 3000 observations and 14 expectations.
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn running_statistics_agree_with_batch_evaluation(
        gait in proptest::array::uniform4(steps()),
        regular in any::<bool>(),
        slide in 0.0..0.01_f64,
    ) {
        // Half of the runs are approximate trots, with phases and an order.
        let delay = |leg: usize| if regular && (leg == 1 || leg == 2) { 150 } else { 0 };
        let of = |leg: usize, ms: u64| {
            if regular && ms % 2000 > 900 {
                let phase = (ms + 300 - delay(leg)) % 300;
                return (if phase < 160 { 5.0 } else { 0.0 }, (ms + 300 - delay(leg)) / 300);
            }
            state(&gait[leg], ms)
        };
        let index = |leg: &str| LEGS.iter().position(|name| *name == leg).unwrap();
        let run = Run {
            load: &|leg, ms| of(index(leg), ms).0,
            foot: &|leg, ms| {
                let (load, number) = of(index(leg), ms);
                let creep = if load > 0.0 { slide * ms as f64 / 1000.0 } else { 0.0 };
                [0.12 * number as f64 + creep, 0.01 * (number % 3) as f64, 0.0]
            },
            end_ms: 6000,
            ..Run::default()
        };
        let expectation = |(expect, ..): &(&str, f64, f64)| format!(
            "[[expect]]\nfootstep = {{ {expect} }}\nafter = '{AFTER_MS} ms'\nbefore = '{BEFORE_MS} ms'\n"
        );
        let expectations: String = EXPECTATIONS.iter().map(expectation).collect();
        let text = text(&expectations).replace("\"10 s\"", "\"6 s\"");
        let judged = judge_run(&scene(&text).unwrap(), &run, None);
        for ((expect, least, most), outcome) in EXPECTATIONS.iter().zip(&judged.outcomes) {
            let number = batch_value(expect, *least, *most, &judged.footsteps);
            // The mean of a widely spread phase is ill-conditioned.
            let slack = if expect.starts_with("phase =") { 1e-6 } else { 1e-9 };
            agrees(outcome, number, (*least, *most), slack)?;
        }
    }

    #[test]
    fn displacements_agree_with_batch_evaluation_of_both_runs(
        gait in proptest::array::uniform4(steps()),
        cycle in 1..9_usize,
        delay in proptest::array::uniform4(0..120_u64),
        lengthening in -0.01..0.01_f64,
        most in -0.05..0.1_f64,
    ) {
        let index = |leg: &str| LEGS.iter().position(|name| *name == leg).unwrap();
        // The change lengthens the steps and delays those of each leg.
        let changed = |leg: usize, ms: u64| if ms < AFTER_MS { ms } else { ms - delay[leg] };
        let without = Run {
            load: &|leg, ms| state(&gait[index(leg)], ms).0,
            foot: &|leg, ms| [0.12 * state(&gait[index(leg)], ms).1 as f64, 0.0, 0.0],
            end_ms: 6000,
            ..Run::default()
        };
        let with = Run {
            load: &|leg, ms| state(&gait[index(leg)], changed(index(leg), ms)).0,
            foot: &|leg, ms| {
                let number = state(&gait[index(leg)], changed(index(leg), ms)).1;
                [(0.12 + lengthening) * number as f64, 0.0, 0.0]
            },
            ..without
        };
        let text = text(&format!(
            "[[change]]\nat = '{AFTER_MS} ms'\nset = 'step_length'\nby = '-1 cm'\n\
             [[expect]]\nfootstep = {{ displacement = {{ max = '{most} m' }}, axis = 'x', \
             cycle = {cycle}, against = 'without changes' }}\n\
             after = '{AFTER_MS} ms'\nbefore = '{BEFORE_MS} ms'\n"
        ));
        let scene = scene(&text.replace("\"10 s\"", "\"6 s\"")).unwrap();
        let reference = judge_run(&scene, &without, None);
        let judged = judge_run(&scene, &with, Some(&reference.judge.reference()));
        let (values, missing) = displacements(&judged.footsteps, &reference.footsteps, cycle);
        let number = nearest(values, missing, UNBOUNDED, most);
        agrees(&judged.outcomes[0], number, (UNBOUNDED, most), 1e-9)?;
    }
}
