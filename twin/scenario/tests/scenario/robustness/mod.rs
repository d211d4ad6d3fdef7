//! Margins of expectations compared with an independent monitor of Signal Temporal Logic.

use std::path::Path;

use serde_json::{Value, json};
use twinrig_kernel::{Direction, Layout, Port, SimDuration, SimTime, Stream, Unit, stream};
use twinrig_runtime::{Group, Observer};
use twinrig_scenario::{Facts, Judge, Layouts, Outcome, RunEnd, Scenario, Scene, Verdict};
use twinrig_testing::python;

const TRACES: u64 = 1_000;

const KINDS: [&str; 8] = [
    "always",
    "eventually",
    "eventually within",
    "until",
    "settles",
    "response",
    "precedence within",
    "precedence",
];

/// Limits of an element.
struct Condition {
    min: Option<f64>,
    max: Option<f64>,
    absolute: bool,
}

/// A claim and a random run.
struct Case {
    kind: &'static str,
    p: Condition,
    q: Condition,
    /// Time window \[µs\].
    window_us: u64,
    /// Tolerance of `settles`.
    within: f64,
    /// Whether both conditions have one unit.
    one_unit: bool,
    /// Period of the first signal where it is sampled by the controller \[ms\], and its first
    /// sample; none where it is sampled by the plant.
    control: Option<(u64, u64)>,
    /// Duration \[ms\].
    length: u64,
    /// Samples of both signals: time \[ms\] and value.
    samples: [Vec<(u64, f64)>; 2],
    /// Whether the controller is observed before the plant at each instant.
    control_first: bool,
}

impl Condition {
    /// Returns limits that a standard normal number meets by a chance of about a half.
    fn random(random: &mut Stream) -> Self {
        let absolute = random.unit() < 0.2;
        let centre = if absolute { 0.7 } else { 0.0 };
        let bound = centre + 0.5 * random.normal();
        let (min, max) = match random.between(0, 2) {
            0 => (Some(bound), None),
            1 => (None, Some(bound)),
            _ => (Some(bound), Some(bound + 1.5 * random.unit())),
        };
        Condition { min, max, absolute }
    }

    fn toml(&self, name: &str, unit: &str) -> String {
        let end = |key: &str, end: Option<f64>| {
            end.map_or(String::new(), |end| format!(", {key} = '{end} {unit}'"))
        };
        let (min, max) = (end("min", self.min), end("max", self.max));
        format!("name = '{name}', absolute = {}{min}{max}", self.absolute)
    }

    fn json(&self) -> Value {
        json!({ "min": self.min, "max": self.max, "absolute": self.absolute })
    }
}

impl Case {
    fn random(index: u64) -> Self {
        let mut random = stream(index, "robustness");
        let kind = KINDS[usize::try_from(index).unwrap() % KINDS.len()];
        let of_one_signal = matches!(
            kind,
            "always" | "eventually" | "eventually within" | "settles"
        );
        let length = random.between(40, 90);
        let period = random.between(1, 5);
        let control = (!of_one_signal && kind != "until" && random.unit() < 0.5)
            .then(|| (period, random.between(0, period)));
        // Values that change slowly, so that conditions hold for several samples.
        let mut walk = |period: u64, first: u64, low_ms: u64| {
            let mut value = random.normal();
            let times = (first..length).step_by(usize::try_from(period).unwrap());
            let samples = times.map(|at| {
                value = 0.8 * value + 0.6 * random.normal();
                (at, if at < low_ms { -10.0 } else { value })
            });
            samples.collect::<Vec<_>>()
        };
        let (period, first) = control.unwrap_or((1, 0));
        let p = walk(period, first, 0);
        // The event of `until` is not before ten samples.
        let low_ms = if kind == "until" { 12 } else { 0 };
        let samples = [p, walk(1, 0, low_ms)];
        let mut conditions = [(); 2].map(|()| Condition::random(&mut random));
        if of_one_signal || kind == "until" {
            conditions = conditions.map(|it| Condition {
                absolute: false,
                ..it
            });
        }
        // Limits of all samples are met and violated in about half of the runs.
        let bound = match kind {
            "always" | "until" => 1.0 + 2.0 * random.unit(),
            _ => -1.0 - 2.0 * random.unit(),
        };
        if of_one_signal || kind == "until" {
            (conditions[0].min, conditions[0].max) = (None, Some(bound));
        }
        if kind == "until" {
            conditions[1].min = Some(2.0 * random.unit());
            conditions[1].max = None;
        }
        let [p, q] = conditions;
        let whole_ms = random.between(11, 20);
        Case {
            kind,
            p,
            q,
            window_us: 1000 * whole_ms
                + [0, random.between(1, 999)][usize::from(random.unit() < 0.5)],
            within: 3.0 * random.unit(),
            one_unit: of_one_signal || random.unit() < 0.5,
            control,
            length,
            samples,
            control_first: random.unit() < 0.5,
        }
    }

    fn expectation(&self) -> String {
        let unit = if self.one_unit { "N" } else { "m" };
        let Case {
            window_us, within, ..
        } = self;
        let [p, q] = [("p", &self.p, "N"), ("q", &self.q, unit)]
            .map(|(name, condition, unit)| condition.toml(name, unit));
        let of_signal = p.replace("name = 'p', absolute = false, ", "");
        match self.kind {
            "always" | "eventually" => {
                format!(
                    "signal = {{ name = 'p', {} = {{ {of_signal} }} }}",
                    self.kind
                )
            }
            "eventually within" => format!(
                "signal = {{ name = 'p', eventually = {{ {of_signal} }}, within = '{window_us} us' }}"
            ),
            "until" => {
                format!("signal = {{ name = 'p', always = {{ {of_signal} }}, until = {{ {q} }} }}")
            }
            "settles" => format!(
                "signal = {{ name = 'p', settles = {{ within = '{within} N', by = '{window_us} us' }} }}"
            ),
            "response" => format!(
                "response = {{ whenever = {{ {p} }}, then = {{ {q} }}, within = '{window_us} us' }}"
            ),
            "precedence within" => format!(
                "precedence = {{ whenever = {{ {p} }}, before = {{ {q} }}, within = '{window_us} us' }}"
            ),
            _ => format!("precedence = {{ whenever = {{ {p} }}, before = {{ {q} }} }}"),
        }
    }

    fn json(&self) -> Value {
        json!({
            "kind": self.kind,
            "p": self.p.json(),
            "q": self.q.json(),
            "window": self.window_us as f64 / 1e3,
            "within": self.within,
            "one_unit": self.one_unit,
            "length": self.length,
            "samples": self.samples,
        })
    }

    /// Returns ports of the plant and of the controller.
    fn ports(&self) -> [Vec<Port>; 2] {
        let p = Port::output("p", Unit::Newton, 1);
        let unit = if self.one_unit {
            Unit::Newton
        } else {
            Unit::Meter
        };
        let q = Port::output("q", unit, 1);
        match self.control {
            None => [vec![p, q], vec![]],
            Some(_) => [vec![q], vec![p]],
        }
    }

    fn scene(&self) -> Scene {
        let text = format!(
            "robot = 'cheetah-cub'\nduration = '{} ms'\nplant = {{ model = 'massless' }}\n\
             controller = {{ kind = 'cpg', period = '{} ms' }}\nobserve = {{ period = '1 ms' }}\n\
             [[expect]]\n{}\n",
            self.length - 1,
            self.control.map_or(1, |(period, _)| period),
            self.expectation()
        );
        let catalogue = crate::common::catalogue();
        let scenario = Scenario::parse("run.toml", &text, Path::new("."), &[], &catalogue);
        let [plant_outputs, process_ports] = self.ports();
        let facts = Facts {
            weight: 10.8,
            plant_outputs,
            process_ports,
            ..Facts::default()
        };
        let scene = scenario.and_then(|scenario| scenario.scene(&facts));
        scene.unwrap_or_else(|error| panic!("{text}\n{error}"))
    }

    fn judged(&self) -> Outcome {
        let scene = self.scene();
        let [plant, process] = self
            .ports()
            .map(|ports| Layout::of(&ports, Direction::Output));
        let none = Layout::default();
        let layouts = Layouts {
            plant: &plant,
            process_inputs: &none,
            process_outputs: &process,
            diagnostics: &none,
            tasks: &[],
        };
        let mut judge = Judge::new(&scene, layouts);
        let [p, q] = &self.samples;
        let mut control = p.iter().filter(|_| self.control.is_some()).peekable();
        for ((ms, q), index) in q.iter().zip(0..) {
            let now = SimTime::ZERO + SimDuration::from_millis(*ms);
            let of_control = control.next_if(|(at, _)| at == ms);
            let of_plant = match self.control {
                None => vec![p[index].1, *q],
                Some(_) => vec![*q],
            };
            let mut groups = vec![(Group::Plant, of_plant)];
            groups.extend(of_control.map(|(_, p)| (Group::ProcessOutputs, vec![*p])));
            if self.control_first {
                groups.reverse();
            }
            for (group, values) in groups {
                judge.samples(now, group, &values);
            }
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
}

#[test]
fn margins_are_the_robustness_of_an_independent_monitor() {
    let Some(python) = python::python_of_peers("rtamt") else {
        return;
    };
    let cases: Vec<Case> = (0..TRACES).map(Case::random).collect();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scenario/robustness/stl.py");
    let input = cases.iter().map(Case::json).collect();
    let peer = python::run(&python, &script, &[], &input);
    let mut compared = [0; KINDS.len()];
    let mut failed = [0; KINDS.len()];
    // Cases in which a window of one sample less or more would be noticed.
    let mut sensitive = [0; 2];
    for (case, robustness) in cases.iter().zip(peer.as_array().unwrap()) {
        let [exact, shorter, longer] = [0, 1, 2].map(|index| robustness[index].as_f64().unwrap());
        let outcome = case.judged();
        let text = || format!("{}\n{outcome:?}\n{exact}", case.expectation());
        let kind = KINDS.iter().position(|kind| *kind == case.kind).unwrap();
        if outcome.verdict == Verdict::Unobserved {
            assert!(
                outcome.detail.contains("never held") || outcome.detail.contains("needed"),
                "{}",
                text()
            );
            continue;
        }
        assert_eq!(outcome.verdict == Verdict::Pass, exact >= 0.0, "{}", text());
        match outcome.margin {
            Some(margin) => assert!((margin - exact).abs() < 1e-9, "{}", text()),
            // An `until` in two units whose condition never held.
            None => assert!(exact < -1e200, "{}", text()),
        }
        compared[kind] += 1;
        failed[kind] += u32::from(outcome.verdict == Verdict::Fail);
        for (count, other) in sensitive.iter_mut().zip([shorter, longer]) {
            *count += u32::from((other - exact).abs() > 1e-6);
        }
    }
    for ((kind, compared), failed) in KINDS.iter().zip(compared).zip(failed) {
        assert!(compared >= 60, "{kind}: {compared} compared");
        assert!(
            (5..compared - 5).contains(&failed),
            "{kind}: {failed} of {compared} fail"
        );
    }
    assert!(sensitive.iter().all(|count| *count >= 50), "{sensitive:?}");
}
