//! Cost of the judge for one observation of a trotting quadruped, every 2 ms of simulated time,
//! with ten expectations. The target is 0.3 µs.

use std::path::Path;

use twinrig_kernel::{Direction, Layout, Port, SimDuration, SimTime, Unit};
use twinrig_runtime::{Group, Observer};
use twinrig_scenario::{Catalogue, Facts, Judge, Kind, Layouts, LegFact, Scenario, Scene};

fn main() {
    divan::main();
}

const SCENARIO: &str = r#"
robot = "cheetah-cub"
duration = "200 s"
plant = { model = "massless", ground = {} }
expect = [
    { body = { fall = false } },
    { body = { speed = { min = "0.8 m/s" } }, after = "2 s" },
    { body = { pitch_range = { max = "4 deg" } }, after = "2 s" },
    { body = { roll_range = { max = "8 deg" } }, after = "2 s" },
    { body = { yaw_drift = { max = "90 deg" } } },
    { footstep = { slip = { max = "5 mm" } } },
    { footstep = { duty_factor = { min = 0.4 } } },
    { footstep = { phase = "trot", tolerance = 0.05 } },
    { footstep = { frequency = { near = "3.5 Hz", within = "2 %" } } },
    { signal = { name = "leg/*/cable/tension", always = { min = "0 N" } } },
]
"#;

/// A comparison with delays up to ±100 ms, at the observation period of 1 ms of the tactile bench.
const DELAY: &str = r#"
robot = "cheetah-cub"
duration = "200 s"
plant = { model = "massless", ground = {} }
observe = { period = "1 ms" }
expect = [
    { compare = { signal = "leg/LF/foot/load", with = "leg/RF/foot/load", delay = { max = "10 ms" } } },
]
"#;

fn scene(text: &str) -> Scene {
    let catalogue = Catalogue {
        plants: vec![Kind::new("massless", "")],
        ..Catalogue::default()
    };
    let scenario = Scenario::parse("bench.toml", text, Path::new("."), &[], &catalogue);
    let legs: Vec<LegFact> = ["LF", "RF", "LH", "RH"]
        .into_iter()
        .map(|name| LegFact {
            name: name.into(),
            fore: name.ends_with('F'),
            left: name.starts_with('L'),
        })
        .collect();
    let mut plant_outputs = vec![
        Port::output("body/position", Unit::Meter, 3),
        Port::output("body/rpy", Unit::Radian, 3),
        Port::output("body/velocity", Unit::MeterPerSecond, 3),
    ];
    for leg in &legs {
        let name = |what: &str| format!("leg/{}/{what}", leg.name);
        plant_outputs.push(Port::output(name("foot/position"), Unit::Meter, 3));
        plant_outputs.push(Port::output(name("foot/load"), Unit::Newton, 1));
        plant_outputs.push(Port::output(name("cable/tension"), Unit::Newton, 1));
        plant_outputs.push(Port::output(name("foot/force"), Unit::Newton, 3));
    }
    let facts = Facts {
        legs,
        weight: 10.8,
        plant_outputs,
        frame_signals: Vec::new(),
        ..Facts::default()
    };
    scenario
        .and_then(|scenario| scenario.scene(&facts))
        .expect("valid scenario")
}

/// One second of observations.
#[divan::bench]
fn five_hundred_observations(bencher: divan::Bencher) {
    observe(bencher, SCENARIO, 500, SimDuration::from_millis(2));
}

/// Ten seconds of observations. The target is 0.2 µs each.
#[divan::bench]
fn ten_thousand_observations_of_a_delay(bencher: divan::Bencher) {
    observe(bencher, DELAY, 10_000, SimDuration::from_millis(1));
}

/// One second of observations with 1000 bounds on one signal, which share their statistics. The
/// target is twice the time of one bound.
#[divan::bench(args = [1, 1_000])]
fn five_hundred_observations_of_bounds(bencher: divan::Bencher, bounds: usize) {
    let bound = |n| {
        format!(
            "{{ signal = {{ name = 'leg/LF/foot/load', always = {{ max = '{}.5 N' }} }} }},\n",
            n + 5
        )
    };
    let bounds: String = (0..bounds).map(bound).collect();
    let start = SCENARIO.find("expect").unwrap_or(SCENARIO.len());
    let text = format!("{}expect = [\n{bounds}]\n", &SCENARIO[..start]);
    observe(bencher, &text, 500, SimDuration::from_millis(2));
}

fn observe(bencher: divan::Bencher, text: &str, count: usize, period: SimDuration) {
    let scene = scene(text);
    let ports: Vec<Port> = required_ports(&scene);
    let layout = Layout::of(&ports, Direction::Output);
    let none = Layout::default();
    let layouts = Layouts {
        plant: &layout,
        process_inputs: &none,
        process_outputs: &none,
        diagnostics: &none,
        tasks: &[],
    };
    let samples: Vec<Vec<f64>> = (0..count).map(|index| sample(&layout, index)).collect();
    bencher
        .counter(divan::counter::ItemsCount::new(count))
        .with_inputs(|| Judge::new(&scene, layouts))
        .bench_local_refs(|judge| {
            let mut now = SimTime::ZERO;
            for values in &samples {
                judge.samples(now, Group::Plant, values);
                now += period;
            }
        });
}

fn required_ports(scene: &Scene) -> Vec<Port> {
    let port = |name: &String| match name.rsplit('/').next() {
        Some("load" | "tension") => Port::output(name, Unit::Newton, 1),
        _ => Port::output(name, Unit::Meter, 3),
    };
    scene.wanted.iter().map(port).collect()
}

/// Foot loads of legs in stance and swing at 3.5 Hz.
fn sample(layout: &Layout, index: usize) -> Vec<f64> {
    let mut values = vec![0.1; layout.len()];
    for (leg, name) in ["LF", "RF", "LH", "RH"].into_iter().enumerate() {
        if let Some(range) = layout.find(&format!("leg/{name}/foot/load")) {
            let in_stance = (index + 71 * leg) % 143 < 70;
            values[range.start] = if in_stance { 5.0 } else { 0.0 };
        }
    }
    values
}
