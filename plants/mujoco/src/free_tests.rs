//! A leg without stops, against the reference without stops.

use std::fs;
use std::path::Path;

use serde_json::Value;
use twinrig_kernel::SimDuration;
use twinrig_legged::{Base, Drives, Setup, StartPose};
use twinrig_robot::{Robot, RobotFile};

use crate::engine::Engine;
use crate::flow::Flow;
use crate::mjcf::write_model;
use crate::model::Model;
use crate::options::{Coordinates, Integrator, Options};

fn flat(value: &Value) -> Vec<f64> {
    match value.as_array() {
        Some(items) => items.iter().flat_map(flat).collect(),
        None => vec![value.as_f64().unwrap()],
    }
}

fn robot() -> Robot {
    let near = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let file = RobotFile::find("cheetah-cub", near).unwrap();
    file.robot().unwrap()
}

/// Returns the root mean square error of the foot \[m\].
fn rms_error(
    golden: &Value,
    coordinates: Coordinates,
    integrator: Integrator,
    step_us: u64,
) -> f64 {
    let mut robot = robot();
    let parameter = |key: &str| golden["leg"][key].as_f64().unwrap();
    let leg = &mut robot.legs[0].leg;
    (leg.diagonal.stiffness, leg.parallel.stiffness) = (parameter("k_d"), parameter("k_p"));
    (leg.diagonal.preload, leg.parallel.preload) = (parameter("preload_d"), parameter("preload_p"));
    let friction = flat(&golden["leg"]["friction"]);
    let joints = &mut leg.joint_friction;
    (joints.hip, joints.knee, joints.ankle) = (friction[0], friction[1], friction[2]);
    let three = |key: &str| <[f64; 3]>::try_from(flat(&golden["start"][key])).unwrap();
    let start = StartPose {
        q: three("angles_deg").map(f64::to_radians),
        rates: three("rates"),
    };
    let setup = Setup {
        base: Base::Fixed,
        legs: vec!["LF".to_owned()],
        ground: None,
        step: SimDuration::from_micros(step_us),
        drives: Drives::None,
        start: start.into(),
    };
    let mut options = Options::new(setup, coordinates);
    options.numerics.integrator = integrator;
    let mut model = Model::new(&robot, &options).unwrap();
    model.without_stops = true;
    let engine = Engine::compile(&write_model(&robot, &model)).unwrap();
    let mut flow = Flow::of(model, engine).unwrap();
    let hip = robot.legs[0].hip;
    let interval = golden["step_s"].as_f64().unwrap();
    let steps = libm::round(interval * 1e6 / step_us as f64);
    let rows = golden["foot"].as_array().unwrap();
    let mut sum = 0.0;
    for (k, row) in rows.iter().enumerate() {
        let mut step = 0.0;
        while k > 0 && step < steps {
            flow.run(step_us as f64 * 1e-6).unwrap();
            step += 1.0;
        }
        let [foot, _] = flow.foot(0);
        for (axis, expected) in [0, 2].into_iter().zip(flat(row)) {
            let error = foot[axis] - flow.trunk.position[axis] - hip[axis] - expected;
            sum += error * error;
        }
    }
    libm::sqrt(sum / rows.len() as f64)
}

#[test]
fn leg_without_stops_agrees_with_the_reference() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../lcp/tests/reference/golden");
    let text = fs::read_to_string(folder.join("passive-free.json")).unwrap();
    let golden: Value = serde_json::from_str(&text).unwrap();
    // Measured values times 1.5.
    for (coordinates, integrator, step_us, bound) in [
        (Coordinates::Minimal, Integrator::Rk4, 2000, 2e-7),
        (Coordinates::Minimal, Integrator::Rk4, 100, 2e-12),
        (Coordinates::Minimal, Integrator::Euler, 2000, 2e-4),
        (Coordinates::Maximal, Integrator::ImplicitFast, 2000, 5e-4),
        (Coordinates::Maximal, Integrator::Euler, 2000, 5e-4),
        (Coordinates::Maximal, Integrator::Euler, 100, 3e-5),
    ] {
        let found = rms_error(&golden, coordinates, integrator, step_us);
        println!("{coordinates:?} {integrator:?} {step_us}: {found:e}");
        assert!(
            found < bound,
            "{coordinates:?} {integrator:?} {step_us}: {found:e}"
        );
    }
}
