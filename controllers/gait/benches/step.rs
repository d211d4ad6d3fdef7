//! Cost of one step of the controller for four legs.

use divan::Bencher;
use twinrig_gait::{Cpg, Gait, Oscillators, Tegotae};
use twinrig_kernel::SimDuration;
use twinrig_robot::Robot;
use twinrig_runtime::Process;

fn main() {
    divan::main();
}

const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];

#[divan::bench]
fn step_of_four_legs(bencher: Bencher) {
    let mut cpg =
        Cpg::new(&Robot::example(), &LEGS, Gait::Trot).expect("the example robot is valid");
    let mut outputs = [0.0; 8];
    bencher.bench_local(|| {
        cpg.step(
            SimDuration::from_millis(2),
            &[],
            divan::black_box(&mut outputs),
        );
    });
}

/// Two legs of four are loaded, as in a trot.
#[divan::bench]
fn tegotae_of_four_legs(bencher: Bencher) {
    let mut tegotae =
        Tegotae::new(&Robot::example(), &LEGS, Gait::Trot, 1).expect("the example robot is valid");
    let mut outputs = [0.0; 8];
    bencher.bench_local(|| {
        tegotae.step(
            SimDuration::from_millis(2),
            divan::black_box(&[5.0, 0.0, 0.0, 5.0]),
            divan::black_box(&mut outputs),
        );
    });
}

#[divan::bench]
fn oscillators_locked(bencher: Bencher) {
    let mut network = Oscillators::locked(&[0.0; 4]);
    bencher.bench_local(|| network.advance(divan::black_box(0.002), 3.0, 2.5));
}

#[divan::bench]
fn oscillators_locking(bencher: Bencher) {
    let mut network = Oscillators::locked(&[0.0; 4]);
    network.push(0, 0.1);
    bencher
        .with_inputs(|| network.clone())
        .bench_local_refs(|network| network.advance(0.002, 3.0, 2.5));
}
