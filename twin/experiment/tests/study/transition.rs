//! Classification of synthetic cycles with known gaits.

use std::f64::consts::TAU;

use proptest::prelude::*;
use twinrig_experiment::{
    FootContact, GaitPattern, GaitRun, MIXED, MeasuredCycle, MotionSample, PhaseSample,
    RampDirection, STANDING, TransitionCase, TransitionInput, TransitionPlan, TransitionResult,
    TransitionStudy, transition,
};
use twinrig_kernel::{SimDuration, SimTime, Stream, Unit, stream};

use crate::pages::{elements, machine};

/// Gaits with the phases of left fore, right fore, left hind and right hind leg.
const GAITS: [(&str, [f64; 4]); 8] = [
    ("trot", [0.0, 0.5, 0.5, 0.0]),
    ("pace", [0.0, 0.5, 0.0, 0.5]),
    ("walk", [0.0, 0.5, 0.75, 0.25]),
    ("diagonal walk", [0.0, 0.5, 0.25, 0.75]),
    ("bound", [0.0, 0.0, 0.5, 0.5]),
    ("diagonal gallop", [0.0, 0.1, 0.5, 0.6]),
    ("rotary gallop", [0.0, 0.1, 0.6, 0.5]),
    ("pronk", [0.0, 0.0, 0.0, 0.0]),
];

fn phases(gait: &str) -> [f64; 4] {
    GAITS.iter().find(|(name, _)| *name == gait).unwrap().1
}

/// Part of a run with one gait; without one the robot stands.
#[derive(Clone, Copy)]
struct Part {
    gait: Option<&'static str>,
    seconds: f64,
    period_s: f64,
}

fn part(gait: &'static str, seconds: f64, period_s: f64) -> Part {
    Part {
        gait: Some(gait),
        seconds,
        period_s,
    }
}

/// Cycles and footfalls of parts one after another, from `begin_s` on; each phase is up to `jitter`
/// of the cycle early or late. Oscillators have the phases of the gait.
fn footfalls(parts: &[Part], begin_s: f64, jitter: f64, random: &mut Stream) -> GaitRun {
    let mut run = GaitRun {
        legs: ["LF", "RF", "LH", "RH"].map(str::to_owned).into(),
        ..GaitRun::default()
    };
    let mut from_s = begin_s;
    for part in parts {
        let cycles = (0_u32..).map(|cycle| f64::from(cycle) * part.period_s);
        let cycles = cycles.take_while(|begin| begin + part.period_s <= part.seconds + 1e-9);
        let moves = part.gait.map(phases);
        for (begin, shares) in cycles.filter_map(|begin| moves.map(|shares| (begin, shares))) {
            let jittered = shares.map(|share| share + jitter * (2.0 * random.unit() - 1.0));
            run.cycles.push(MeasuredCycle {
                centre_s: from_s + begin + 0.5 * part.period_s,
                period_s: part.period_s,
                phases: jittered.map(|share| Some(share.rem_euclid(1.0))).into(),
                contacts: vec![1.0, 1.0, 2.0, 2.0],
            });
            run.oscillators.extend([0.3, 0.7].map(|share| PhaseSample {
                at_s: from_s + begin + share * part.period_s,
                phases_rad: shares.map(|phase| TAU * (share - phase)).into(),
            }));
            for (leg, share) in jittered.into_iter().enumerate() {
                let touch_down_s = from_s + begin + share * part.period_s;
                run.footsteps.push(FootContact {
                    leg,
                    touch_down_s,
                    lift_off_s: Some(touch_down_s + 0.4 * part.period_s),
                    position_m: [touch_down_s, 0.0, 0.0],
                    impulse_n_s: 1.0,
                    slip_m: 0.001,
                });
            }
        }
        from_s += part.seconds;
    }
    run.footsteps
        .sort_by(|a, b| a.touch_down_s.total_cmp(&b.touch_down_s));
    run.end_s = from_s;
    run.motion = motion(run.end_s, 0.0, |at_s| [2.0 * at_s, 0.008 * at_s]);
    run
}

/// Samples of a straight way with a constant heading; distance and slip are those of `of` \[m\].
fn motion(end_s: f64, yaw_rad: f64, of: impl Fn(f64) -> [f64; 2]) -> Vec<MotionSample> {
    let times = (0_u32..).map(|n| f64::from(n) * 0.1);
    let samples = times.take_while(|at_s| *at_s <= end_s + 1e-9).map(|at_s| {
        let [way_m, slip_m] = of(at_s);
        MotionSample {
            at_s,
            trunk_m: [way_m * libm::cos(yaw_rad), way_m * libm::sin(yaw_rad)],
            yaw_rad,
            slip_m,
        }
    });
    samples.collect()
}

struct Recorded {
    input: TransitionInput,
    runs: Vec<Result<GaitRun, String>>,
}

impl Recorded {
    fn new(run: GaitRun, values: &[[f64; 2]]) -> Self {
        let patterns = GAITS.iter().map(|(name, phases)| GaitPattern {
            name: (*name).to_owned(),
            phases: phases.to_vec(),
        });
        let case = TransitionCase {
            plant: "a <plant>".to_owned(),
            plateau_s: 10.0,
            values: values.to_vec(),
            end: SimTime::ZERO + SimDuration::from_secs(60),
        };
        Self {
            input: TransitionInput {
                name: "a <staircase>".to_owned(),
                file: "stairs.toml".to_owned(),
                variable: "excitation".to_owned(),
                unit: Unit::RadianPerSecond,
                patterns: patterns.collect(),
                cases: vec![case],
                left_out: Vec::new(),
            },
            runs: vec![Ok(run)],
        }
    }

    fn study(&self) -> TransitionStudy {
        transition(&self.input, &TransitionPlan::default(), self.runs.clone()).unwrap()
    }
}

fn result(run: GaitRun) -> TransitionResult {
    Recorded::new(run, &[[0.0, 1.0]]).study().cases.remove(0)
}

fn classes(result: &TransitionResult) -> Vec<&str> {
    result.cycles.iter().map(|cycle| &*cycle.class).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// A gait is recognised under jitter, whenever it begins and whatever its period is. The
    /// nearest patterns are a twentieth of a cycle apart, so that half of it may be jitter.
    #[test]
    fn every_gait_is_recognised_at_any_origin_and_period(
        gait in 0..GAITS.len(),
        begin_s in 0.0..5.0_f64,
        period_s in 0.1..2.0_f64,
        seed in any::<u64>(),
    ) {
        let gait = GAITS[gait].0;
        let parts = [part(gait, 12.0 * period_s, period_s)];
        let random = || stream(seed, "footfalls");
        let here = result(footfalls(&parts, begin_s, 0.02, &mut random()));
        let found: Vec<&str> = classes(&here).into_iter().filter(|it| *it != STANDING).collect();
        let found: Vec<&str> = found.into_iter().filter(|it| *it != MIXED).collect();
        prop_assert_eq!(found.len(), 12);
        prop_assert!(found.iter().all(|class| *class == gait), "{:?}", found);
        // The phases themselves depend on neither.
        let parts = [part(gait, 12.0, 1.0)];
        let there = result(footfalls(&parts, 0.0, 0.02, &mut random()));
        let moving = |of: &TransitionResult| -> Vec<Vec<f64>> {
            let moving = of.cycles.iter().filter(|cycle| !cycle.phases.is_empty());
            moving.map(|cycle| cycle.phases.clone()).collect()
        };
        for (a, b) in moving(&here).iter().flatten().zip(moving(&there).iter().flatten()) {
            let apart = (a - b).abs();
            prop_assert!(apart.min(1.0 - apart) < 1e-9, "{} {}", a, b);
        }
    }
}

#[test]
fn failed_run_is_a_case_with_its_reason() {
    let mut random = stream(1, "footfalls");
    let run = footfalls(&[part("trot", 6.0, 0.5)], 0.0, 0.0, &mut random);
    let mut recorded = Recorded::new(run, &[[0.0, 1.0]]);
    let alone = recorded.study();
    recorded.input.cases.push(recorded.input.cases[0].clone());
    recorded.runs.insert(0, Err("refused".to_owned()));
    let study = recorded.study();
    assert_eq!(study.cases[0].why.as_deref(), Some("refused"));
    assert_eq!(study.cases[1], alone.cases[0]);
}

#[test]
fn mixed_steps_and_times_without_steps_are_no_gait() {
    let mut random = stream(1, "footfalls");
    // A leg that lags by an eighth of a cycle more than the tolerance allows.
    let mut run = footfalls(&[part("trot", 6.0, 0.5)], 0.0, 0.0, &mut random);
    for cycle in &mut run.cycles {
        cycle.phases[3] = Some(0.25);
    }
    let lagging = result(run.clone());
    assert!(classes(&lagging).iter().all(|class| *class == MIXED));
    assert_eq!(lagging.cycles[3].deviation, Some(0.125));
    // A leg without a phase.
    for cycle in &mut run.cycles {
        cycle.phases[3] = None;
    }
    let lame = result(run.clone());
    assert!(lame.cycles.iter().all(|cycle| cycle.deviation.is_none()));
    assert!(classes(&lame).iter().all(|class| *class == MIXED));
    // Steps that do not repeat.
    run.cycles.drain(3..6);
    let found = result(run);
    let gap = &found.cycles[3];
    assert_eq!((gap.begin_s, gap.end_s, gap.contacts), (1.5, 3.0, None));
    let stands = Part {
        gait: None,
        ..part("trot", 4.0, 0.5)
    };
    let parts = [part("trot", 3.0, 0.5), stands, part("pace", 3.0, 0.5)];
    let found = result(footfalls(&parts, 0.0, 0.0, &mut random));
    let mut seen = classes(&found);
    seen.dedup();
    assert_eq!(seen, ["trot", STANDING, "pace"]);
}

#[test]
fn agreement_is_that_outside_of_transitions() {
    let parts = [part("walk", 10.0, 0.5), part("trot", 10.0, 0.5)];
    let mut run = footfalls(&parts, 0.0, 0.0, &mut stream(1, "footfalls"));
    let agreement = result(run.clone()).agreement();
    assert_eq!((agreement.cycles, agreement.agreeing), (40, 40));
    assert_eq!(result(run.clone()).contacts(), Some(1.5));
    // Oscillators that keep the walk for 5 s.
    for sample in &mut run.oscillators {
        if (10.0..15.0).contains(&sample.at_s) {
            sample.phases_rad = phases("walk").map(|phase| -TAU * phase).into();
        }
    }
    let agreement = result(run.clone()).agreement();
    assert_eq!((agreement.cycles, agreement.agreeing), (40, 30));
    assert_eq!(agreement.share(), Some(0.75));
    // The same while neither gait lasts by the loads is a part of the transition.
    for cycle in &mut run.cycles {
        if (10.0..15.0).contains(&cycle.centre_s) {
            cycle.phases[0] = None;
        }
    }
    let agreement = result(run.clone()).agreement();
    assert_eq!((agreement.cycles, agreement.agreeing), (30, 30));
    run.oscillators.clear();
    assert_eq!(result(run).agreement().share(), None);
}

#[test]
fn transitions_are_dated_with_the_value_on_each_way() {
    // Walk, two cycles of pace that do not last, trot; back to walk at a lower value.
    let parts = [
        part("walk", 10.0, 0.5),
        part("pace", 1.0, 0.5),
        part("trot", 19.0, 0.5),
        part("walk", 10.0, 0.5),
    ];
    let run = footfalls(&parts, 0.0, 0.0, &mut stream(1, "footfalls"));
    let values = [[0.0, 1.0], [10.0, 2.0], [20.0, 1.5], [29.0, 0.5]];
    let study = Recorded::new(run, &values).study();
    let result = &study.cases[0];
    let [up, down] = &result.transitions[..] else {
        panic!("{:?}", result.transitions);
    };
    assert_eq!(
        (&*up.from, &*up.to, up.way),
        ("walk", "trot", RampDirection::Up)
    );
    assert_eq!(
        (&*down.from, &*down.to, down.way),
        ("trot", "walk", RampDirection::Down)
    );
    // Cycles across a change of gait belong to neither.
    assert!((up.begin_s - 9.5).abs() <= 0.5 && (down.begin_s - 29.5).abs() <= 0.5);
    assert_eq!(up.established_s, Some(11.0));
    let lasts_s = 11.0 - up.begin_s;
    assert!((up.slip_m - 0.008 * lasts_s).abs() < 1e-12, "{}", up.slip_m);
    let [pair] = &result.hysteresis[..] else {
        panic!("{:?}", result.hysteresis);
    };
    assert_eq!((&pair.up[..], &pair.down[..]), (&[2.0][..], &[0.5][..]));
    assert!(
        result
            .speeds
            .iter()
            .all(|[_, speed]| (speed - 2.0).abs() < 1e-9)
    );
    let headline = study.headline();
    assert!(
        headline.contains("walk → trot at 10.0 to 11.0 s (2 rad/s)"),
        "{headline}"
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Speed is along the heading, so that a robot that moves backwards is below zero; slip counts
    /// in the second in which a foot slips, not in that of the touch-down of its footstep.
    #[test]
    fn speed_has_a_sign_and_slip_a_time(
        yaw_rad in -3.2..3.2_f64,
        speed in -0.5..0.5_f64,
        slips_in in 4..9_u32,
    ) {
        let mut run = footfalls(&[part("trot", 10.0, 0.5)], 0.0, 0.0, &mut stream(1, "footfalls"));
        // All of its way from 3 s on is one footstep.
        run.footsteps.retain(|step| step.touch_down_s < 3.0);
        let last = run.footsteps.last_mut().unwrap();
        (last.lift_off_s, last.slip_m) = (None, 0.7);
        let from_s = f64::from(slips_in);
        run.motion = motion(10.0, yaw_rad, |at_s| {
            [speed * at_s, 0.7 * (at_s - from_s).clamp(0.0, 1.0)]
        });
        let found = result(run);
        prop_assert_eq!(found.speeds.len(), 10);
        prop_assert!(found.speeds.iter().all(|[_, own]| (own - speed).abs() < 1e-12));
        let [at_s, slip] = found.worst_slip().unwrap();
        prop_assert!((at_s - from_s - 0.5).abs() < 1e-9 && (slip - 0.7).abs() < 1e-9);
        let before = found.cycles.iter().filter(|cycle| cycle.end_s <= 3.0);
        prop_assert!(before.map(|cycle| cycle.slip_m).sum::<f64>().abs() < 1e-12);
    }
}

#[test]
fn page_and_data_have_every_run_and_cycle() {
    let parts = [part("walk", 10.0, 0.5), part("trot", 10.0, 0.5)];
    let run = footfalls(&parts, 0.0, 0.0, &mut stream(1, "footfalls"));
    let mut recorded = Recorded::new(run, &[[0.0, 1.0], [10.0, 2.0]]);
    recorded.input.cases.push(recorded.input.cases[0].clone());
    recorded.runs.push(Err("it was refused".to_owned()));
    let study = recorded.study();
    let page = study.page(&machine(), "twin study <transition>").html();
    let elements = elements(&page);
    // The whole run, and the transition.
    assert_eq!(elements.iter().filter(|it| *it == "figure").count(), 2);
    assert!(page.contains("it was refused"));
    assert_eq!(study.csv().lines().count(), 1 + study.cases[0].cycles.len());
    let json = study.json(&machine(), "twin study transition");
    assert_eq!(json["cases"][0]["transitions"][0]["to"], "trot");
    assert_eq!(json["cases"][1]["why"], "it was refused");
    recorded.runs[0] = Err("this, too".to_owned());
    let error = transition(&recorded.input, &TransitionPlan::default(), recorded.runs).unwrap_err();
    assert_eq!(error.to_string(), "this, too");
}
