//! Synthetic runs of two signals.

use std::path::Path;

use twinrig_kernel::{Direction, Layout, Port, SimDuration, SimTime, Unit};
use twinrig_runtime::{Group, Observer};
use twinrig_scenario::{Facts, Judge, Layouts, Outcome, RunEnd, Scenario, Scene};

use crate::common;

pub const TRUTH: &str = "bench/force";
/// An estimate that is observed with the truth.
pub const BESIDE: &str = "bench/force/beside";
/// An estimate in the inputs of the controller.
pub const ESTIMATE: &str = "bench/force/estimate";

/// Observation period \[s\]: that of the scenarios here.
pub const STEP: f64 = 1e-3;

pub fn scene(signal: &str, expect: &str, control_ms: u64) -> Scene {
    let text = format!(
        "robot = 'cheetah-cub'\nduration = '100 s'\nplant = {{ model = 'massless' }}\n\
         controller = {{ kind = 'cpg', period = '{control_ms} ms' }}\nobserve = {{ period = '1 ms' }}\n\
         [[expect]]\ncompare = {{ signal = '{signal}', with = '{TRUTH}', {expect} }}\n"
    );
    let catalogue = common::catalogue();
    let scenario = Scenario::parse("run.toml", &text, Path::new("."), &[], &catalogue);
    let facts = Facts {
        weight: 10.8,
        plant_outputs: [TRUTH, BESIDE]
            .map(|name| Port::output(name, Unit::Newton, 1))
            .into(),
        process_ports: vec![Port::input(ESTIMATE, Unit::Newton, 1)],
        ..Facts::default()
    };
    let scene = scenario.and_then(|scenario| scenario.scene(&facts));
    scene.unwrap_or_else(|error| panic!("{error}"))
}

/// A run of two signals, as functions of the time \[s\].
pub struct Run<'r> {
    pub truth: &'r dyn Fn(f64) -> f64,
    pub estimate: &'r dyn Fn(f64) -> f64,
    /// Times of the observations \[ms\].
    pub observed_ms: &'r dyn Fn(u64) -> bool,
    pub lasts_ms: u64,
    /// Period of the control cycle \[ms\] and its offset \[µs\].
    pub control: (u64, u64),
}

pub const NOTHING: Run<'static> = Run {
    truth: &|_| 0.0,
    estimate: &|_| 0.0,
    observed_ms: &|_| true,
    lasts_ms: 5_000,
    control: (1, 0),
};

/// Judges a run whose plant has the truth and an estimate, and whose controller reads the estimate.
pub fn judge(signal: &str, expect: &str, run: &Run<'_>) -> Outcome {
    let scene = scene(signal, expect, run.control.0);
    let ports: Vec<Port> = scene
        .wanted
        .iter()
        .map(|name| Port::output(name, Unit::Newton, 1))
        .collect();
    let plant = Layout::of(&ports, Direction::Output);
    let inputs = Layout::of(&[Port::input(ESTIMATE, Unit::Newton, 1)], Direction::Input);
    let none = Layout::default();
    let layouts = Layouts {
        plant: &plant,
        process_inputs: &inputs,
        process_outputs: &none,
        diagnostics: &none,
        tasks: &[],
    };
    let mut judge = Judge::new(&scene, layouts);
    let place = |name: &str| plant.find(name).unwrap().start;
    let (truth, beside) = (place(TRUTH), place(BESIDE));
    let mut values = vec![0.0; plant.len()];
    let period = SimDuration::from_millis(run.control.0);
    let mut control = SimTime::ZERO + SimDuration::from_micros(run.control.1);
    for ms in 0..run.lasts_ms {
        let now = SimTime::ZERO + SimDuration::from_millis(ms);
        if (run.observed_ms)(ms) {
            let seconds = STEP * ms as f64;
            values[truth] = (run.truth)(seconds);
            values[beside] = (run.estimate)(seconds);
            judge.samples(now, Group::Plant, &values);
        }
        while control < now + SimDuration::from_millis(1) {
            let seconds = control.since_start().as_secs_f64();
            judge.samples(control, Group::ProcessInputs, &[(run.estimate)(seconds)]);
            control += period;
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

pub fn measured(signal: &str, expect: &str, run: &Run<'_>) -> f64 {
    let found = judge(signal, expect, run);
    found
        .measured
        .unwrap_or_else(|| panic!("{expect}: {found:?}"))
}
