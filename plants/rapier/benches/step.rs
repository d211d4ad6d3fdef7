//! Cost of a step of two milliseconds for each kind of joints: a standing robot, and hanging legs.
//! Each iteration continues from the same snapshot.

use divan::Bencher;
use divan::counter::ItemsCount;
use twinrig_legged::{Drives, Setup, StartPose};
use twinrig_rapier::{Joints, Options, Rapier};
use twinrig_runtime::Plant;
use twinrig_testing::plant_harness::PlantHarness;
use twinrig_testing::robots::{LEGS, robot, standing, suspended};

fn main() {
    divan::main();
}

/// Steps of an iteration: enough to hide the resolution of the clock, few enough to stay in one
/// phase of the motion.
const STEPS: u64 = 20;

/// Measures the mean over steps from 0.3 s on.
fn steps(bencher: Bencher, setup: &Setup, joints: Joints) {
    let robot = robot();
    let fixture = || {
        let options = Options::new(setup.clone(), joints);
        PlantHarness::new(Rapier::new(&robot, &options, &|_| true).unwrap())
    };
    let mut prepared = fixture();
    prepared.advance_to_us(300_000);
    let saved = prepared.plant.save();
    bencher
        .counter(ItemsCount::new(STEPS))
        .with_inputs(|| {
            let mut fixture = fixture();
            fixture.plant.restore(&saved).unwrap();
            fixture.now_us = 300_000;
            fixture
        })
        .bench_local_refs(|fixture| fixture.advance_to_us(300_000 + 2000 * STEPS));
}

#[divan::bench(args = Joints::ALL)]
fn standing_robot(bencher: Bencher, joints: Joints) {
    steps(
        bencher,
        &standing(Drives::Ideal { period: 2e-3 }, 2000),
        joints,
    );
}

#[divan::bench(args = Joints::ALL)]
fn passive_legs(bencher: Bencher, joints: Joints) {
    let q = [10.0_f64, -9.5, 9.5].map(f64::to_radians);
    let start = StartPose { q, rates: [0.0; 3] };
    let setup = suspended(&LEGS, start, 2000);
    steps(bencher, &setup, joints);
}
