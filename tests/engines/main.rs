//! Comparison of `lcp` with the external engines MuJoCo and Rapier, which share the robot file and
//! the scenario but not the numerical method.
#![cfg(any(feature = "mujoco", feature = "rapier"))]

#[cfg(feature = "mujoco")]
mod abduction;
mod branches;
mod contacts;
#[cfg(feature = "mujoco")]
mod identification;
mod pushes;
mod serial_servos;
mod steps;

use std::path::Path;

use twinrig::kernel::{SimDuration, SimTime};
use twinrig::runtime::{Group, Observer, RunEvent};
use twinrig::{Assembly, Execution, Report, execute};
use twinrig_tests::{TrotFixture, run, run_from, shipped};

/// Engines of this build.
const ENGINES: &[&str] = &[
    #[cfg(feature = "mujoco")]
    "mujoco",
    #[cfg(feature = "rapier")]
    "rapier",
];

/// Observer of the foot positions.
#[derive(Default)]
struct Feet {
    indices: Vec<usize>,
    samples: Vec<Vec<f64>>,
}

impl Observer for Feet {
    fn event(&mut self, _: SimTime, _: RunEvent) {}

    fn samples(&mut self, _: SimTime, group: Group, values: &[f64]) {
        if group == Group::Plant {
            self.samples
                .push(self.indices.iter().map(|&index| values[index]).collect());
        }
    }
}

/// Returns the foot positions during the first 300 ms of passive legs, the interval shown in the
/// thesis (figure 2.5).
fn feet(scenario: &str, settings: &[(&str, &str)]) -> Vec<Vec<f64>> {
    let registry = twinrig::registry();
    let assembly = shipped(&registry, scenario, settings).unwrap();
    feet_of(&assembly, SimDuration::from_millis(300))
}

/// Returns the foot positions of a run of a scenario up to `end`.
fn feet_of_text(text: &str, settings: &[(&str, &str)], end: SimDuration) -> Vec<Vec<f64>> {
    let registry = twinrig::registry();
    let assembly = Assembly::builder(&registry)
        .settings(&twinrig_tests::settings(settings))
        .text("hanging.toml", text, Path::new(""))
        .unwrap_or_else(|error| panic!("{error}"));
    feet_of(&assembly, end)
}

/// Runs a shipped scenario.
fn report_of(scenario: &str, settings: &[(&str, &str)]) -> Report {
    let registry = twinrig::registry();
    let assembly = shipped(&registry, scenario, settings).unwrap();
    execute(&assembly, &Execution::default()).unwrap()
}

/// Returns the foot positions of a run up to `end`.
fn feet_of(assembly: &Assembly<'_>, end: SimDuration) -> Vec<Vec<f64>> {
    let mut rig = assembly.rig().unwrap();
    let layout = rig.layout(Group::Plant);
    let mut feet = Feet::default();
    for field in layout.fields() {
        if field.port.name.ends_with("/foot/position") {
            feet.indices.extend(field.range());
        }
    }
    assert_eq!(feet.indices.len(), 12, "four feet");
    rig.run_until(SimTime::ZERO + end, &mut feet).unwrap();
    feet.samples
}

/// Root mean square distance of the feet \[m\].
fn rms(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    assert_eq!(a.len(), b.len());
    let squares = a.iter().flatten().zip(b.iter().flatten());
    let sum: f64 = squares.map(|(a, b)| (a - b) * (a - b)).sum();
    // Three components form one distance.
    libm::sqrt(3.0 * sum / (a.len() * a[0].len()) as f64)
}

/// `lcp` with its reference method, confirmed by `SciPy` to 1e-11 m
/// (`plants/lcp/tests/plant/trajectories.rs`).
fn reference(scenario: &str) -> Vec<Vec<f64>> {
    let exact = [
        ("plant.integrator", "rodas4"),
        ("plant.tolerance", "1e-12 m"),
    ];
    feet(scenario, &exact)
}

/// Scenario in which no joint stop is reached, so that the order of a method is visible.
const SMOOTH: &str = "passive-legs-free.toml";
/// The same legs between their joint stops.
const STOPS: &str = "passive-legs.toml";

/// Error of `plant` with a step of `step` and additional settings.
fn error_of(scenario: &str, plant: &str, step: &str, settings: &[(&str, &str)]) -> f64 {
    let mut all = vec![("plant.model", plant), ("plant.step", step)];
    all.extend_from_slice(settings);
    rms(&feet(scenario, &all), &reference(scenario))
}

/// The joint angles of MuJoCo are a linear transformation of the absolute angles of `lcp`, and both
/// methods are the classical Runge-Kutta method of order 4: even the errors agree. Design targets:
/// 2e-6 m and 1e-9 m; measured: 2.2e-8 m and 1.2e-13 m.
#[test]
#[cfg(feature = "mujoco")]
fn mujoco_in_joint_angles_agrees_to_rounding() {
    let minimal = [
        ("plant.coordinates", "minimal"),
        ("plant.integrator", "rk4"),
    ];
    for (step, bound) in [("2 ms", 5e-8), ("1 ms", 3e-9), ("0.1 ms", 1e-12)] {
        let error = error_of(SMOOTH, "mujoco", step, &minimal);
        assert!(error < bound, "{step}: {error:.3e} m");
    }
}

/// Pins are as stiff as two steps permit, and errors of first order in the step: 2.6e-4 m with
/// joint stops, 9.7e-5 m without.
#[test]
#[cfg(feature = "mujoco")]
fn mujoco_in_maximal_coordinates_is_within_half_a_millimetre_and_converges() {
    for scenario in [SMOOTH, STOPS] {
        let [coarse, fine] = ["2 ms", "0.2 ms"].map(|step| error_of(scenario, "mujoco", step, &[]));
        assert!(coarse < 5e-4, "{scenario}: {coarse:.3e} m");
        // A tenth of the step gives a tenth of the error; the position of an impact within the step
        // changes that by a factor of two.
        assert!(
            fine < 0.2 * coarse,
            "{scenario}: {coarse:.3e} m, {fine:.3e} m"
        );
    }
}

/// The same for Rapier: measured are 4.6e-5 m and 2.8e-5 m.
#[test]
#[cfg(feature = "rapier")]
fn rapier_is_within_a_tenth_of_a_millimetre_and_converges() {
    for scenario in [SMOOTH, STOPS] {
        let [coarse, fine] = ["2 ms", "0.2 ms"].map(|step| error_of(scenario, "rapier", step, &[]));
        assert!(coarse < 1e-4, "{scenario}: {coarse:.3e} m");
        assert!(
            fine < 0.2 * coarse,
            "{scenario}: {coarse:.3e} m, {fine:.3e} m"
        );
    }
}

/// Measured values of rows of the trot on MuJoCo with a step: speed \[m/s\], pitch and roll \[rad\]
/// from peak to peak, and the share of slip of the fore feet.
#[cfg(feature = "mujoco")]
fn trot_on_mujoco(step: &str) -> [f64; 4] {
    let settings = [
        ("plant.model", "mujoco"),
        ("plant.step", step),
        ("duration", "8 s"),
    ];
    let report = report_of("trot.toml", &settings);
    [
        "forward speed",
        "pitch, peak to peak",
        "roll, peak to peak",
        "slip per step, fore feet",
    ]
    .map(|name| {
        let mut rows = report.expectations.iter().map(|line| &line.outcome);
        rows.find(|row| row.name == name).unwrap().measured.unwrap()
    })
}

/// At 0.5 ms the trot differs from that at half of the step by less than plants differ from each
/// other, at 2 ms by more: peers are compared at 0.5 ms.
#[test]
#[cfg(feature = "mujoco")]
fn trot_on_mujoco_is_converged_at_half_a_millisecond() {
    let [coarse, half, fine] = ["2 ms", "0.5 ms", "0.25 ms"].map(trot_on_mujoco);
    let within = |values: &[f64; 4]| {
        let [speed, pitch, roll, slip] = std::array::from_fn(|i| (values[i] - fine[i]).abs());
        speed < 0.01 && pitch < 3e-3 && roll < 5e-3 && slip < 0.01
    };
    assert!(within(&half), "{half:?}, {fine:?}");
    assert!(!within(&coarse), "{coarse:?}, {fine:?}");
}

/// A walking robot: the run is reproduced on another thread and after other runs.
#[test]
fn runs_of_external_engines_are_reproducible() {
    for model in ENGINES {
        let once = || {
            let registry = twinrig::registry();
            let fixture = TrotFixture {
                model,
                duration_ms: 400,
                ..TrotFixture::default()
            };
            run(&fixture.assembly(&registry)).to_string()
        };
        let first = once();
        let other_thread = std::thread::Builder::new().spawn(once).unwrap();
        assert_eq!(other_thread.join().unwrap(), first, "{model}");
        assert_eq!(once(), first, "{model}");
    }
}

/// Snapshot in the middle of a gait step, with feet on the ground, including warm starts.
#[test]
fn restored_rig_with_an_external_engine_continues_bit_for_bit() {
    for model in ENGINES {
        let registry = twinrig::registry();
        let fixture = TrotFixture {
            model,
            duration_ms: 400,
            ..TrotFixture::default()
        };
        let assembly = fixture.assembly(&registry);
        let mut rig = assembly.rig().unwrap();
        // Between two observations, and not at a step of the plant.
        let at = SimTime::ZERO + SimDuration::from_micros(251_300);
        rig.run_until(at, &mut ()).unwrap();
        let snapshot = rig.save();
        let expected = run_from(&mut rig, assembly.end());
        let mut other = assembly.rig().unwrap();
        other.restore(&snapshot).unwrap();
        assert_eq!(run_from(&mut other, assembly.end()), expected, "{model}");
        rig.restore(&snapshot).unwrap();
        assert_eq!(run_from(&mut rig, assembly.end()), expected, "{model}");
    }
}
