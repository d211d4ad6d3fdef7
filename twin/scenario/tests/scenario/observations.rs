//! Too few observations give no pass.

use crate::common::run::{BEGIN, END, MISSED, Run, at, cycles, cycles_until, outcome};
use twinrig_runtime::RunEvent;
use twinrig_scenario::{Outcome, Verdict};

/// Expectations that the synthetic trot satisfies in any window.
const SATISFIED: [&str; 15] = [
    "body = { fall = false }",
    "body = { speed = { max = '1 m/s' } }",
    "body = { height = { min = '10 cm' } }",
    "body = { roll = { max = '1 deg' } }",
    "body = { pitch = { max = '1 deg' } }",
    "body = { roll_range = { max = '1 deg' } }",
    "body = { height_range = { max = '1 mm' } }",
    "body = { yaw_drift = { max = '1 deg' } }",
    "body = { settles = { within = '1 mm', by = '0 s' } }",
    "signal = { name = 'leg/*/cable/tension', always = { max = '2 N' } }",
    "signal = { name = 'leg/*/cable/tension', eventually = { max = '2 N' } }",
    "signal = { name = 'leg/LF/cable/tension', settles = { within = '1 N', by = '0 s' } }",
    "footstep = { count = { max = 99 } }",
    "signal = { name = 'leg/LF/cable/tension', always = { max = '2 N' }, until = { name = 'body/position', component = 'x', min = '1 m' } }",
    "compare = { signal = 'leg/LF/cable/tension', with = 'leg/RF/cable/tension', error = { max = '1 N' } }",
];

/// Judges the synthetic trot, whose trunk is 1 m ahead from `ahead_ms`.
fn judged(expect: &str, ahead_ms: u64) -> Outcome {
    let run = Run {
        body: &|ms| [if ms < ahead_ms { 0.0 } else { 1.0 }, 0.0, 0.12],
        ..Run::default()
    };
    outcome(expect, &run)
}

#[test]
fn verdict_requires_ten_samples() {
    for expect in SATISFIED {
        // The awaited event coincides with the eleventh sample of the window, which is not
        // evaluated.
        for (last, samples) in [(5016, 9), (5018, 10)] {
            let window = format!("{expect}\nafter = '5 s'\nbefore = '{last} ms'");
            let found = judged(&window, 5020);
            if expect.contains("until") {
                // The event does not occur within the window.
                let verdict = if samples < 10 {
                    Verdict::Unobserved
                } else {
                    Verdict::Fail
                };
                assert_eq!(found.verdict, verdict, "{window}");
                continue;
            }
            if samples < 10 {
                let detail = "9 samples, and 10 are needed";
                assert_eq!(
                    (found.verdict, found.detail.as_str()),
                    (Verdict::Unobserved, detail),
                    "{window}"
                );
                assert_eq!(found.margin, None, "{window}");
            } else {
                assert_eq!(found.verdict, Verdict::Pass, "{window}");
            }
        }
    }
}

#[test]
fn ignored_samples_do_not_count() {
    let until = SATISFIED[13];
    let judged = |ahead_ms| {
        let window = format!("{until}\nafter = '5 s'");
        judged(&window, ahead_ms).verdict
    };
    assert_eq!(judged(5018), Verdict::Unobserved);
    assert_eq!(judged(5020), Verdict::Pass);
    for settles in [
        "body = { settles = { within = '1 mm', by = 'BY' } }",
        "signal = { name = 'leg/LF/cable/tension', settles = { within = '1 N', by = 'BY' } }",
    ] {
        let judged = |by: &str| outcome(&settles.replace("BY", by), &Run::default()).verdict;
        assert_eq!(judged("9983 ms"), Verdict::Unobserved);
        assert_eq!(judged("9982 ms"), Verdict::Pass);
    }
    let within =
        "signal = { name = 'leg/LF/cable/tension', eventually = { max = '2 N' }, within = 'SPAN' }";
    let judged = |span: &str| outcome(&within.replace("SPAN", span), &Run::default()).verdict;
    assert_eq!(judged("17 ms"), Verdict::Unobserved);
    assert_eq!(judged("18 ms"), Verdict::Pass);
}

#[test]
fn observed_violation_fails_with_few_samples() {
    let tilted = Run {
        rpy: &|ms| [if ms == 5004 { 1.0 } else { 0.0 }, 0.0, 0.0],
        ..Run::default()
    };
    for expect in [
        "body = { roll = { max = '1 deg' } }",
        "body = { fall = false }",
    ] {
        let window = format!("{expect}\nafter = '5 s'\nbefore = '5.01 s'\noptional = true");
        let found = outcome(&window, &tilted);
        assert_eq!(
            (found.verdict, found.first_violation),
            (Verdict::Fail, Some(at(5004)))
        );
        assert!(!found.holds());
    }
    // A mean has no instant of violation.
    let slow = "body = { speed = { min = '1 m/s' } }\nafter = '5 s'\nbefore = '5.01 s'";
    assert_eq!(outcome(slow, &tilted).verdict, Verdict::Unobserved);
}

#[test]
fn energy_balance_and_costs_require_no_samples() {
    let blind = Run {
        load: &|_, _| 0.0,
        ..Run::default()
    };
    for expect in [
        "energy = { residual = { max = 1e-6 } }",
        "cost = { steps = { max = 10000 } }",
    ] {
        let window = format!("{expect}\nafter = '9.999 s'");
        assert_eq!(outcome(&window, &blind).verdict, Verdict::Pass, "{expect}");
    }
}

const TIMINGS: [&str; 6] = [
    "deadline_misses = { max = 0 }",
    "cycle_rate = { near = '500 Hz', within = '1 %' }",
    "jitter = { max = '1 us' }",
    "latency = { max = '300 us' }",
    "longest_cycle = { max = '2 ms' }",
    "half_range = { max = '1 us' }",
];

fn steady(cycles: u64) -> Vec<(u64, RunEvent)> {
    (0..cycles)
        .flat_map(|cycle| [(2000 * cycle, BEGIN), (2000 * cycle + 300, END)])
        .collect()
}

fn timing(measure: &str) -> String {
    format!("timing = {{ of = 'control', {measure} }}")
}

#[test]
fn timing_requires_three_cycles() {
    for measure in TIMINGS {
        let two = cycles(&timing(measure), &steady(2));
        assert_eq!(two.verdict, Verdict::Unobserved, "{measure}");
        assert_eq!(two.detail, "2 cycles began, and 3 are needed", "{measure}");
        let three = cycles(&timing(measure), &steady(3));
        assert_eq!(three.verdict, Verdict::Pass, "{measure}: {three:?}");
    }
}

#[test]
fn stopped_cycle_fails_timing_measures() {
    // A hundred cycles, then none for as long, without events for missed cycles.
    for measure in TIMINGS {
        let stopped = cycles_until(&timing(measure), &steady(100), 400_000);
        let unaffected = measure.starts_with("deadline") || measure.starts_with("latency");
        let verdict = if unaffected {
            Verdict::Pass
        } else {
            Verdict::Fail
        };
        assert_eq!(stopped.verdict, verdict, "{measure}: {stopped:?}");
    }
    // The last cycle does not end.
    let mut hung = steady(100);
    hung.push((200_000, BEGIN));
    for measure in &TIMINGS[1..] {
        let found = cycles_until(&timing(measure), &hung, 400_000);
        assert_eq!(found.verdict, Verdict::Fail, "{measure}: {found:?}");
    }
    // A cycle that is pending but not late at the end has no effect.
    for measure in TIMINGS {
        let found = cycles_until(&timing(measure), &steady(100), 199_999);
        assert_eq!(found.verdict, Verdict::Pass, "{measure}: {found:?}");
    }
}

#[test]
fn hung_controller_fails_despite_optional() {
    let mut hung = steady(1);
    hung.push((2000, BEGIN));
    hung.extend((2..100).map(|cycle| (2000 * cycle, MISSED)));
    for measure in TIMINGS {
        let expect = format!("{}\noptional = true", timing(measure));
        let found = cycles(&expect, &hung);
        assert_eq!(found.verdict, Verdict::Fail, "{measure}: {found:?}");
        assert!(!found.holds());
    }
}
