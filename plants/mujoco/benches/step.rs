//! Cost of a step in each kind of coordinates.

use divan::{Bencher, black_box};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_legged::{Abduction, Base, Contacts, Drives, SetPoint, Setup, Start, StartPose};
use twinrig_mujoco::{Coordinates, Integrator, Mujoco, Options};
use twinrig_robot::RobotFile;
use twinrig_runtime::Plant;

fn main() {
    divan::main();
}

/// Measures consecutive steps of a robot.
fn step(bencher: Bencher<'_, '_>, setup: Setup, coordinates: Coordinates) {
    measure(bencher, &Options::new(setup, coordinates));
}

fn measure(bencher: Bencher<'_, '_>, options: &Options) {
    let text = include_str!("../../../robots/cheetah-cub.toml");
    let robot = RobotFile::parse("cheetah-cub.toml", text).unwrap();
    let robot = robot.robot().unwrap();
    let mut plant = Mujoco::new(&robot, options, &|_| false).unwrap();
    let mut inputs = [0.0; 8];
    let count = plant.ports().len();
    plant.initial_inputs(&mut inputs);
    let mut now = SimTime::ZERO;
    bencher.bench_local(|| {
        now += SimDuration::from_millis(2);
        plant.advance(now, black_box(&inputs[..count])).unwrap();
    });
}

fn hanging() -> Setup {
    let q = [10.0, -9.5, 9.5].map(f64::to_radians);
    Setup {
        base: Base::Fixed,
        legs: ["LF", "RF", "LH", "RH"].map(str::to_owned).to_vec(),
        ground: None,
        step: SimDuration::from_millis(2),
        drives: Drives::None,
        abduction: Abduction::Locked,
        contacts: Contacts::Feet,
        set_point: SetPoint::Held,
        start: StartPose { q, rates: [0.0; 3] }.into(),
    }
}

#[divan::bench(args = Coordinates::ALL)]
fn hanging_legs(bencher: Bencher<'_, '_>, coordinates: Coordinates) {
    step(bencher, hanging(), coordinates);
}

#[divan::bench(args = Coordinates::ALL)]
fn standing_robot(bencher: Bencher<'_, '_>, coordinates: Coordinates) {
    let ground = twinrig_contact::Ground::new(twinrig_contact::Terrain::Flat, 0.6, 0.0);
    let setup = Setup {
        base: Base::Free,
        ground: Some(ground.unwrap()),
        drives: Drives::Ideal { period: 2e-3 },
        start: Start::default(),
        ..hanging()
    };
    step(bencher, setup, coordinates);
}

/// The complete plant, and MuJoCo's step alone.
#[divan::bench(args = [false, true])]
fn hanging_legs_by_euler(bencher: Bencher<'_, '_>, step_only: bool) {
    let mut options = Options::new(hanging(), Coordinates::Minimal);
    options.numerics.integrator = Integrator::Euler;
    if step_only {
        options.step_only = true;
        (options.numerics.sparse, options.numerics.islands) = (false, false);
    }
    measure(bencher, &options);
}
