//! One model, several engines, one answer: `lcp`, which is ours, against MuJoCo and Rapier, which are others'. What they have
//! in common is the robot file and the scenario, and nothing of how motion is found.
#![cfg(any(feature = "mujoco", feature = "rapier"))]

use std::path::Path;

use twinrig::kernel::{SimDuration, SimTime};
use twinrig::runtime::{Group, Observer, RunEvent};
use twinrig::scenario::Setting;
use twinrig::{Assembly, Registry};
use twinrig_tests::{Scene, run, run_from};

/// The engines that this build has.
const ENGINES: &[&str] = &[
    #[cfg(feature = "mujoco")]
    "mujoco",
    #[cfg(feature = "rapier")]
    "rapier",
];

/// Where the feet are at every look.
#[derive(Default)]
struct Feet {
    wanted: Vec<usize>,
    seen: Vec<Vec<f64>>,
}

impl Observer for Feet {
    fn event(&mut self, _: SimTime, _: RunEvent) {}

    fn samples(&mut self, _: SimTime, group: Group, values: &[f64]) {
        if group == Group::Plant {
            self.seen
                .push(self.wanted.iter().map(|&place| values[place]).collect());
        }
    }
}

/// The feet of the first 300 ms of passive legs, which is what the thesis shows of its models (figure 2.5).
fn feet(scenario: &str, settings: &[(&str, &str)]) -> Vec<Vec<f64>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../scenarios")
        .join(scenario);
    let settings: Vec<Setting> = settings
        .iter()
        .map(|(key, value)| Setting {
            origin: "--set".to_owned(),
            key: (*key).to_owned(),
            value: (*value).to_owned(),
        })
        .collect();
    let registry = Registry::standard();
    let assembly = Assembly::of_file(&registry, &path, &settings).unwrap();
    let mut rig = assembly.rig().unwrap();
    let layout = rig.layout(Group::Plant);
    let mut feet = Feet::default();
    for field in layout.fields() {
        if field.port.name.ends_with("/foot/position") {
            feet.wanted.extend(field.range());
        }
    }
    assert_eq!(feet.wanted.len(), 12, "four feet");
    rig.run_until(SimTime::ZERO + SimDuration::from_millis(300), &mut feet)
        .unwrap();
    feet.seen
}

/// Root of the mean square distance of the feet \[m\].
fn rms(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    assert_eq!(a.len(), b.len());
    let squares = a.iter().flatten().zip(b.iter().flatten());
    let sum: f64 = squares.map(|(a, b)| (a - b) * (a - b)).sum();
    // Three numbers are one distance.
    libm::sqrt(3.0 * sum / (a.len() * a[0].len()) as f64)
}

/// `lcp` by its own reference method, which `SciPy` confirms to 1e-11 m (`plants/lcp/tests/trajectories.rs`).
fn reference(scenario: &str) -> Vec<Vec<f64>> {
    let exact = [
        ("plant.integrator", "rodas4"),
        ("plant.tolerance", "1e-12 m"),
    ];
    feet(scenario, &exact)
}

/// A scene in which no stop acts, so that nothing hides the order of a method.
const SMOOTH: &str = "passive-legs-free.toml";
/// The same legs between their stops.
const STOPS: &str = "passive-legs.toml";

/// `plant` in steps of `step`, with other settings on top.
fn error_of(scenario: &str, plant: &str, step: &str, settings: &[(&str, &str)]) -> f64 {
    let mut all = vec![("plant.model", plant), ("plant.step", step)];
    all.extend_from_slice(settings);
    rms(&feet(scenario, &all), &reference(scenario))
}

/// MuJoCo's joint angles are other coordinates than the absolute angles of `lcp`, but linear ones, and both methods are the
/// classical one of fourth order: even their errors agree. 2e-6 m and 1e-9 m are what was hoped for; measured are 2.2e-8 m and
/// 1.2e-13 m.
#[test]
#[cfg(feature = "mujoco")]
fn mujoco_in_joint_angles_gives_the_same_answer_to_rounding() {
    let minimal = [
        ("plant.coordinates", "minimal"),
        ("plant.integrator", "rk4"),
    ];
    for (step, bound) in [("2 ms", 5e-8), ("1 ms", 3e-9), ("0.1 ms", 1e-12)] {
        let error = error_of(SMOOTH, "mujoco", step, &minimal);
        assert!(error < bound, "{step}: {error:.3e} m");
    }
}

/// Pins as stiff as two steps allow, and first order in the step: 2.6e-4 m where stops are hit, 9.7e-5 m where none is.
#[test]
#[cfg(feature = "mujoco")]
fn mujoco_in_maximal_coordinates_is_within_half_a_millimetre_and_converges() {
    for scenario in [SMOOTH, STOPS] {
        let [coarse, fine] = ["2 ms", "0.2 ms"].map(|step| error_of(scenario, "mujoco", step, &[]));
        assert!(coarse < 5e-4, "{scenario}: {coarse:.3e} m");
        // A tenth of the step is a tenth of the error; where an impact falls within a step moves that by a factor of two.
        assert!(
            fine < 0.2 * coarse,
            "{scenario}: {coarse:.3e} m, {fine:.3e} m"
        );
    }
}

/// The same of Rapier: measured are 4.6e-5 m and 2.8e-5 m.
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

/// A robot that walks gives the same run again, on another thread and after other runs.
#[test]
fn a_run_of_another_engine_is_the_same_run_every_time() {
    for model in ENGINES {
        let once = || {
            let registry = Registry::standard();
            let scene = Scene {
                model,
                duration_ms: 400,
                ..Scene::default()
            };
            run(&scene.assembly(&registry)).to_string()
        };
        let first = once();
        let elsewhere = std::thread::Builder::new().spawn(once).unwrap();
        assert_eq!(elsewhere.join().unwrap(), first, "{model}");
        assert_eq!(once(), first, "{model}");
    }
}

/// Saved in the middle of a step of the gait, feet on the ground, warm starts and all.
#[test]
fn a_rig_on_another_engine_goes_on_where_it_was_saved() {
    for model in ENGINES {
        let registry = Registry::standard();
        let scene = Scene {
            model,
            duration_ms: 400,
            ..Scene::default()
        };
        let assembly = scene.assembly(&registry);
        let mut rig = assembly.rig().unwrap();
        // Between two looks, and away from the plant's own steps.
        let at = SimTime::ZERO + SimDuration::from_micros(251_300);
        rig.run_until(at, &mut ()).unwrap();
        let saved = rig.save();
        let went = run_from(&mut rig, assembly.end());
        let mut other = assembly.rig().unwrap();
        other.restore(&saved).unwrap();
        assert_eq!(run_from(&mut other, assembly.end()), went, "{model}");
        rig.restore(&saved).unwrap();
        assert_eq!(run_from(&mut rig, assembly.end()), went, "{model}");
    }
}
