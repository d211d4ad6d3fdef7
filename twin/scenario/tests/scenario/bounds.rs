//! Bounds on the same samples, which share statistics, are judged as each by itself.

use twinrig_kernel::{Direction, Layout, SimDuration, SimTime, Stream, stream};
use twinrig_runtime::{Group, Observer};
use twinrig_scenario::{Judge, Layouts, Outcome, RunEnd, Scene};

use crate::common::{facts, legs, scene, text};

const SUBJECTS: [&str; 5] = [
    "signal = { name = 'body/rpy', always = LIMITS }",
    "signal = { name = 'body/rpy', component = 'y', always = LIMITS }",
    "signal = { name = 'leg/*/hip/position', always = LIMITS }",
    "body = { pitch = LIMITS }",
    "body = { roll = LIMITS }",
];
const WINDOWS: [&str; 3] = ["", "after = '20 ms'", "before = '60 ms'"];
const SAMPLES: u64 = 100;

fn pick<'a>(random: &mut Stream, from: &[&'a str]) -> &'a str {
    let index = random.between(0, from.len() as u64 - 1);
    from[usize::try_from(index).unwrap()]
}

/// Returns an expectation of a random subject and window, with random limits.
fn expectation(random: &mut Stream) -> String {
    let bound = 2.0 * random.normal().abs();
    let limits = match random.between(0, 2) {
        _ if random.unit() < 0.1 => "{ max = '1 rad' }".to_owned(),
        0 => format!("{{ max = '{bound} rad' }}"),
        1 => format!(
            "{{ min = '{} rad', max = '{bound} rad' }}",
            -2.0 * random.unit()
        ),
        _ => format!("{{ min = '{} rad' }}", -bound),
    };
    let of_body = format!("{{ max = '{} rad' }}", bound.clamp(0.01, 1.5));
    let subject = pick(random, &SUBJECTS);
    let window = pick(random, &WINDOWS);
    let limits = if subject.starts_with("body") {
        of_body
    } else {
        limits
    };
    format!(
        "[[expect]]\n{}\n{window}\n",
        subject.replace("LIMITS", &limits)
    )
}

/// Returns samples that grow, some of which are not finite in some runs.
fn samples(random: &mut Stream, layout: &Layout) -> Vec<Vec<f64>> {
    let odd = random.unit() < 0.3;
    (0..SAMPLES)
        .map(|index| {
            let mut value = || match random.between(0, 400) {
                0 if odd => f64::NAN,
                1 if odd => f64::INFINITY,
                2 if odd => f64::NEG_INFINITY,
                _ => 0.01 * index as f64 * random.normal(),
            };
            (0..layout.len()).map(|_| value()).collect()
        })
        .collect()
}

fn judged(scene: &Scene, layout: &Layout, samples: &[Vec<f64>]) -> Vec<Outcome> {
    let none = Layout::default();
    let layouts = Layouts {
        plant: layout,
        process_inputs: &none,
        process_outputs: &none,
        diagnostics: &none,
        tasks: &[],
    };
    let mut judge = Judge::new(scene, layouts);
    let mut now = SimTime::ZERO;
    for values in samples {
        judge.samples(now, Group::Plant, values);
        now += SimDuration::from_millis(1);
    }
    judge.finish(&RunEnd {
        at: scene.scenario.end(),
        energy: None,
        work: None,
        real_time_factor: None,
        buses: &[],
    })
}

#[test]
fn bounds_on_the_same_samples_are_judged_as_each_alone() {
    let layout = Layout::of(&facts(legs()).plant_outputs, Direction::Output);
    let mut verdicts = Vec::new();
    for seed in 0..12 {
        let random = &mut stream(seed, "bounds");
        let expectations: Vec<String> = (0..60).map(|_| expectation(random)).collect();
        let samples = samples(random, &layout);
        let short = |text: String| text.replace("\"10 s\"", "\"100 ms\"");
        let all = scene(&short(text(&expectations.concat()))).unwrap();
        let together = judged(&all, &layout, &samples);
        for (one, expectation) in together.into_iter().zip(&expectations) {
            let scene = scene(&short(text(expectation))).unwrap();
            let alone = judged(&scene, &layout, &samples).remove(0);
            verdicts.push(one.verdict);
            let expected = Outcome {
                name: one.name.clone(),
                place: one.place.clone(),
                ..alone
            };
            // Text, in which numbers have all their digits and NaN equals itself.
            assert_eq!(format!("{one:?}"), format!("{expected:?}"), "{expectation}");
        }
    }
    for verdict in ["Pass", "Fail"] {
        let count = verdicts
            .iter()
            .filter(|one| format!("{one:?}") == verdict)
            .count();
        assert!(count > 30, "{verdict}: {count}");
    }
}
