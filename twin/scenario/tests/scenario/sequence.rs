//! Responses and precedences in runs with known results.

use std::path::Path;

use crate::common::run::{Run, at, outcome};
use proptest::prelude::*;
use twinrig_kernel::{Direction, Layout, Port, SimDuration, SimTime, Unit};
use twinrig_runtime::{Group, Observer};
use twinrig_scenario::{Facts, Judge, Layouts, Outcome, RunEnd, Scenario, Verdict};

/// A pulse of the tension of LF from 2 s to 2.1 s, followed by one of RF `delay` later.
fn pulses(expect: &str, delay_ms: u64) -> Outcome {
    let run = Run {
        tension: &|leg, ms| {
            let start = if leg == "RF" { 2_000 + delay_ms } else { 2_000 };
            if (start..start + 100).contains(&ms) {
                8.0
            } else {
                1.0
            }
        },
        ..Run::default()
    };
    outcome(expect, &run)
}

const LF: &str = "{ name = 'leg/LF/cable/tension', min = '5 N' }";
const RF: &str = "{ name = 'leg/RF/cable/tension', min = '6 N' }";

#[test]
fn response_reports_the_slowest_one() {
    let expect = format!("response = {{ whenever = {LF}, then = {RF}, within = '50 ms' }}");
    let prompt = pulses(&expect, 32);
    assert_eq!(
        (prompt.verdict, prompt.margin, prompt.detail.as_str()),
        (
            Verdict::Pass,
            Some(2.0),
            "slowest response: 32 ms from 2.000 s"
        )
    );
    assert_eq!(pulses(&expect, 50).verdict, Verdict::Pass);
    let late = pulses(&expect, 52);
    assert_eq!(
        (late.verdict, late.first_violation),
        (Verdict::Fail, Some(at(2_000)))
    );
    // `whenever` is off by 3 N, the response by 5 N.
    assert_eq!(
        (late.measured, late.bound, late.margin),
        (Some(8.0), Some(5.0), Some(-3.0))
    );
    assert_eq!(
        late.detail,
        "no response within 50 ms, margin of `whenever`"
    );
}

#[test]
fn precedence_looks_back() {
    let expect = |within| format!("precedence = {{ whenever = {RF}, before = {LF}{within} }}");
    let preceded = pulses(&expect(""), 500);
    assert_eq!(
        (preceded.verdict, preceded.detail.as_str()),
        (Verdict::Pass, "preceded by 500 ms at most, at 2.598 s")
    );
    assert_eq!(
        pulses(&expect(", within = '502 ms'"), 500).verdict,
        Verdict::Pass
    );
    let early = pulses(&expect(", within = '400 ms'"), 500);
    assert_eq!(
        (early.verdict, early.first_violation),
        (Verdict::Fail, Some(at(2_500)))
    );
    assert_eq!(
        early.detail,
        "not preceded within 400 ms, margin of `whenever`"
    );
    // At 2 s the other one has not been yet.
    let swapped = format!("precedence = {{ whenever = {LF}, before = {RF} }}");
    assert_eq!(pulses(&swapped, 500).verdict, Verdict::Fail);
}

#[test]
fn condition_in_another_unit_selects() {
    let expect = "response = { whenever = { name = 'leg/LF/cable/tension', min = '5 N' }, \
                  then = { name = 'body/rpy', component = 'x', absolute = true, min = '0.1 rad' }, \
                  within = '10 ms' }";
    let run = |roll: f64| Run {
        tension: &|_, ms| {
            if (2_000..2_100).contains(&ms) {
                8.0
            } else {
                1.0
            }
        },
        rpy: Box::leak(Box::new(move |ms| {
            [if ms < 2_050 { 0.3 } else { roll }, 0.0, 0.0]
        })),
        ..Run::default()
    };
    for roll in [-0.12, 0.07] {
        let outcome = outcome(expect, &run(roll));
        assert!((outcome.margin.unwrap() - (roll.abs() - 0.1)).abs() < 1e-12);
        assert_eq!(outcome.unit, Unit::Radian);
        assert_eq!(outcome.verdict == Verdict::Pass, roll.abs() > 0.1);
    }
}

#[test]
fn response_without_occasion_or_complete_window_is_unobserved() {
    let never = "response = { whenever = { name = 'leg/LF/cable/tension', min = '50 N' }, \
                 then = { name = 'leg/RF/cable/tension', min = '1 N' }, within = '50 ms' }";
    let outcome = pulses(never, 0);
    assert_eq!(
        (outcome.verdict, outcome.detail.as_str()),
        (Verdict::Unobserved, "the `whenever` condition never held")
    );
    let long = format!("response = {{ whenever = {LF}, then = {RF}, within = '9 s' }}");
    let outcome = pulses(&long, 500);
    assert_eq!(outcome.detail, "the `whenever` condition never held");
    let short = format!("{long}\nafter = '2 s'\nbefore = '4 s'");
    let outcome = pulses(&short, 500);
    assert_eq!(
        (outcome.verdict, outcome.detail.as_str()),
        (
            Verdict::Unobserved,
            "no time window of it was observed completely"
        )
    );
}

/// Judges samples of `p` by the plant and of `q` by the controller at irregular times \[ms\].
fn judged(expect: &str, p: &[(u64, f64)], q: &[(u64, f64)]) -> Outcome {
    let text = format!(
        "robot = 'cheetah-cub'\nduration = '200 ms'\nplant = {{ model = 'massless' }}\n\
         controller = {{ kind = 'cpg', period = '2 ms' }}\n[[expect]]\n{expect}\n"
    );
    let catalogue = crate::common::catalogue();
    let (of_plant, of_process) = (
        vec![Port::output("p", Unit::Newton, 1)],
        vec![Port::input("q", Unit::Newton, 1)],
    );
    let scenario = Scenario::parse("run.toml", &text, Path::new("."), &[], &catalogue);
    let facts = Facts {
        weight: 10.8,
        plant_outputs: of_plant.clone(),
        process_ports: of_process.clone(),
        ..Facts::default()
    };
    let scene = scenario.and_then(|it| it.scene(&facts)).unwrap();
    let layouts = [
        Layout::of(&of_plant, Direction::Output),
        Layout::of(&of_process, Direction::Input),
        Layout::default(),
    ];
    let layouts = Layouts {
        plant: &layouts[0],
        process_inputs: &layouts[1],
        process_outputs: &layouts[2],
        diagnostics: &layouts[2],
        tasks: &[],
    };
    let mut judge = Judge::new(&scene, layouts);
    let mut samples: Vec<_> = p.iter().map(|sample| (*sample, Group::Plant)).collect();
    samples.extend(q.iter().map(|sample| (*sample, Group::ProcessInputs)));
    samples.sort_by_key(|((ms, _), _)| *ms);
    for ((ms, value), group) in samples {
        let now = SimTime::ZERO + SimDuration::from_millis(ms);
        judge.samples(now, group, &[value]);
    }
    let end = RunEnd {
        at: scene.scenario.end(),
        energy: None,
        work: None,
        real_time_factor: None,
        buses: &[],
    };
    judge.finish(&end).remove(0)
}

/// Samples at irregular times, none of them twice.
fn samples() -> impl Strategy<Value = Vec<(u64, f64)>> {
    let sample = (1..9_u64, -1.0..1.0_f64);
    proptest::collection::vec(sample, 20..40).prop_map(|steps| {
        let mut ms = 0;
        let times = steps.into_iter().map(|(step, value)| {
            ms += step;
            (ms, value)
        });
        times.filter(|(ms, _)| *ms <= 200).collect()
    })
}

/// Returns time and both held values at each instant from the first one at which both are known.
fn instants(p: &[(u64, f64)], q: &[(u64, f64)]) -> Vec<(u64, f64, f64)> {
    let held = |samples: &[(u64, f64)], ms| {
        let before = samples.iter().rev().find(|(at, _)| *at <= ms);
        before.map(|(_, value)| *value)
    };
    let mut times: Vec<u64> = p.iter().chain(q).map(|(ms, _)| *ms).collect();
    times.sort_unstable();
    times.dedup();
    times
        .into_iter()
        .filter_map(|ms| Some((ms, held(p, ms)?, held(q, ms)?)))
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    /// The definition, evaluated over all pairs of instants, where samples are irregular.
    #[test]
    fn sequences_agree_with_their_definition(
        p in samples(),
        q in samples(),
        within in 1..40_u64,
        bound in -0.5..0.9_f64,
        is_response in any::<bool>(),
    ) {
        let (claim, key) = if is_response { ("response", "then") } else { ("precedence", "before") };
        let outcome = judged(
            &format!(
                "{claim} = {{ whenever = {{ name = 'p', min = '{bound} N' }}, \
                 {key} = {{ name = 'q', min = '0.6 N' }}, within = '{within} ms' }}"
            ),
            &p,
            &q,
        );
        let instants = instants(&p, &q);
        let (Some(first), Some(last)) = (instants.first(), instants.last()) else {
            return Ok(());
        };
        let judged: Vec<_> = instants
            .iter()
            .filter(|(at, ..)| if is_response { at + within <= last.0 } else { at - first.0 >= within })
            .collect();
        let robustness = judged.iter().map(|(at, p, _)| {
            let window = instants.iter().filter(|(other, ..)| if is_response {
                (*at..=at + within).contains(other)
            } else {
                (at - within..=*at).contains(other)
            });
            let best = window.map(|(_, _, q)| q - 0.6).fold(f64::NEG_INFINITY, f64::max);
            best.max(bound - p)
        });
        let robustness = robustness.fold(f64::INFINITY, f64::min);
        if judged.iter().all(|(_, p, _)| *p < bound) {
            prop_assert_eq!(outcome.verdict, Verdict::Unobserved);
        } else if judged.len() >= 10 || robustness < 0.0 {
            prop_assert!((outcome.margin.unwrap() - robustness).abs() < 1e-12, "{outcome:?} {robustness}");
            prop_assert_eq!(outcome.verdict == Verdict::Pass, robustness >= 0.0);
        } else {
            prop_assert_eq!(outcome.verdict, Verdict::Unobserved);
        }
    }
}
