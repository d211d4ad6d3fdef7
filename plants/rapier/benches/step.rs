//! Cost of a step of two milliseconds with each kind of joints: a robot that stands, and legs that hang. Each iteration goes
//! on from the same saved instant.

#[allow(dead_code, reason = "the tests use the rest")]
#[path = "../tests/plant/scene.rs"]
mod scene;

use divan::Bencher;
use divan::counter::ItemsCount;
use scene::{Scene, hanging, robot, standing};
use twinrig_legged::{Setup, StartPose};
use twinrig_rapier::Joints;
use twinrig_runtime::Plant;

fn main() {
    divan::main();
}

/// Steps of an iteration: enough to hide the clock, few enough to stay in the same phase of the motion.
const STEPS: u64 = 20;

/// The mean over steps from 0.3 s on.
fn steps(bencher: Bencher, setup: &Setup, joints: Joints) {
    let robot = robot();
    let mut scene = Scene::of(&robot, setup.clone(), joints);
    scene.run_to_us(300_000);
    let saved = scene.plant.save();
    bencher
        .counter(ItemsCount::new(STEPS))
        .with_inputs(|| {
            let mut scene = Scene::of(&robot, setup.clone(), joints);
            scene.plant.restore(&saved).unwrap();
            scene.now_us = 300_000;
            scene
        })
        .bench_local_refs(|scene| scene.run_to_us(300_000 + 2000 * STEPS));
}

#[divan::bench(args = Joints::ALL)]
fn standing_robot(bencher: Bencher, joints: Joints) {
    steps(bencher, &standing(2000), joints);
}

#[divan::bench(args = Joints::ALL)]
fn passive_legs(bencher: Bencher, joints: Joints) {
    let q = [10.0_f64, -9.5, 9.5].map(f64::to_radians);
    let start = StartPose { q, rates: [0.0; 3] };
    let setup = hanging(&["LF", "RF", "LH", "RH"], start, 2000);
    steps(bencher, &setup, joints);
}
