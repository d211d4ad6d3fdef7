//! Cost of a step of two milliseconds for each kind of joints: a standing robot, and hanging legs.
//! Each iteration continues from the same snapshot.

#[allow(dead_code, reason = "the rest is used by the tests")]
#[path = "../tests/plant/fixture.rs"]
mod fixture;

use divan::Bencher;
use divan::counter::ItemsCount;
use fixture::{Fixture, hanging, robot, standing};
use twinrig_legged::{Setup, StartPose};
use twinrig_rapier::Joints;
use twinrig_runtime::Plant;

fn main() {
    divan::main();
}

/// Steps of an iteration: enough to hide the resolution of the clock, few enough to stay in one
/// phase of the motion.
const STEPS: u64 = 20;

/// Measures the mean over steps from 0.3 s on.
fn steps(bencher: Bencher, setup: &Setup, joints: Joints) {
    let robot = robot();
    let mut fixture = Fixture::of(&robot, setup.clone(), joints);
    fixture.run_to_us(300_000);
    let saved = fixture.plant.save();
    bencher
        .counter(ItemsCount::new(STEPS))
        .with_inputs(|| {
            let mut fixture = Fixture::of(&robot, setup.clone(), joints);
            fixture.plant.restore(&saved).unwrap();
            fixture.now_us = 300_000;
            fixture
        })
        .bench_local_refs(|fixture| fixture.run_to_us(300_000 + 2000 * STEPS));
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
