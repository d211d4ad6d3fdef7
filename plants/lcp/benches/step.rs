//! Cost of a step of two milliseconds. Each iteration goes on from the same saved instant, so that every machine and every
//! version does the same work.

#[allow(dead_code, reason = "the tests use the rest")]
#[path = "../tests/plant/scene.rs"]
mod scene;
#[path = "../tests/plant/trot.rs"]
mod trot;

use divan::Bencher;
use scene::{Scene, Way, built, changed, hanging, passive, pose, robot, standing};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_lcp::Method;
use twinrig_legged::Setup;
use twinrig_robot::Robot;
use twinrig_runtime::Plant;

fn main() {
    divan::main();
}

/// Steps of an iteration: enough to hide the clock, few enough to stay in the same phase of the motion.
const STEPS: usize = 20;

/// The mean over steps under these commands, one for each, from an instant to which the commands before have led.
fn steps(
    bencher: Bencher,
    (robot, setup, method): (&Robot, &Setup, Method),
    before: &[Vec<f64>],
    commands: &[Vec<f64>],
) {
    let way = Way::by(method, 2000);
    let run = |scene: &mut Scene, from: usize, commands: &[Vec<f64>]| {
        for (tick, commands) in (from as u64 + 1..).zip(commands) {
            let at = SimTime::ZERO + SimDuration::from_millis(2 * tick);
            scene.plant.advance(at, commands).unwrap();
        }
    };
    let mut scene = Scene::new(robot, setup, way);
    run(&mut scene, 0, before);
    let saved = scene.plant.save();
    bencher
        .counter(divan::counter::ItemsCount::new(commands.len()))
        .with_inputs(|| {
            let mut scene = Scene::new(robot, setup, way);
            scene.plant.restore(&saved).unwrap();
            scene
        })
        .bench_local_refs(|scene| run(scene, before.len(), commands));
}

fn still(scene: &Scene, count: usize) -> Vec<Vec<f64>> {
    vec![scene.commands.clone(); count]
}

/// Legs that hang on their lower stops.
#[divan::bench]
fn passive_legs(bencher: Bencher) {
    let (robot, setup) = (robot(), hanging(passive()));
    let none = vec![Vec::new(); 150];
    steps(
        bencher,
        (&robot, &setup, Method::Rk4),
        &none,
        &none[..STEPS],
    );
}

/// Legs whose springs keep them off their stops.
#[divan::bench]
fn passive_legs_off_their_stops(bencher: Bencher) {
    let robot = changed(|leg| {
        leg.diagonal.preload = -4e-3;
        leg.parallel.preload = -4e-3;
    });
    let setup = hanging(pose([10.0, -26.0, 44.0], [0.0; 3]));
    let none = vec![Vec::new(); 150];
    steps(
        bencher,
        (&robot, &setup, Method::Rk4),
        &none,
        &none[..STEPS],
    );
}

/// Integrators of gaits.
const GAITS: [&str; 2] = ["moreau", "rk4"];

fn named(name: &str) -> Method {
    let mut all = Method::ALL.into_iter();
    all.find(|method| method.name() == name).unwrap()
}

#[divan::bench(args = GAITS)]
fn trotting(bencher: Bencher, method: &str) {
    let robot = robot();
    let setup = trot::begun(&robot, standing());
    let commands = trot::commands(&robot, &setup, 0, 1200);
    let (before, during) = commands.split_at(500);
    steps(bencher, (&robot, &setup, named(method)), before, during);
}

#[divan::bench(args = GAITS)]
fn standing_still(bencher: Bencher, method: &str) {
    let robot = robot();
    let setup = trot::begun(&robot, standing());
    let scene = Scene::new(&robot, &setup, Way::by(named(method), 2000));
    let commands = still(&scene, 250 + STEPS);
    let (before, during) = commands.split_at(250);
    steps(bencher, (&robot, &setup, named(method)), before, during);
}

#[divan::bench(args = GAITS)]
fn in_flight(bencher: Bencher, method: &str) {
    let robot = robot();
    let mut setup = trot::begun(&robot, standing());
    setup.ground = None;
    let scene = Scene::new(&robot, &setup, Way::by(named(method), 2000));
    let commands = still(&scene, 25 + STEPS);
    let (before, during) = commands.split_at(25);
    steps(bencher, (&robot, &setup, named(method)), before, during);
}

/// Building the plant.
#[divan::bench]
fn building(bencher: Bencher) {
    let robot = robot();
    let setup = trot::begun(&robot, standing());
    let way = Way::by(Method::Moreau, 2000);
    bencher.bench_local(|| built(&robot, &setup, way).unwrap());
}
