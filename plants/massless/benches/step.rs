//! Cost of one step of a millisecond. Each iteration goes on from the same saved instant, so that every machine and every
//! version does the same work.

#[allow(dead_code, reason = "the tests use the rest")]
#[path = "../tests/plant/scene.rs"]
mod scene;

use divan::Bencher;
use scene::{Scene, at, robot, setup};
use twinrig_legged::{Base, Setup};
use twinrig_massless::{Force, Massless, Options};
use twinrig_runtime::Plant;

fn main() {
    divan::main();
}

/// How a leg's force is found.
const FORCES: [&str; 2] = ["solve", "lookup"];

fn found(force: &str) -> Force {
    match force {
        "solve" => Force::Solve,
        _ => Force::Lookup { cells: 64 },
    }
}

fn on(base: Base) -> Setup {
    Setup { base, ..setup() }
}

/// The mean over `steps` steps from where the scene is, restored each time.
fn steps(bencher: Bencher, scene: &Scene, from_ms: u64, steps: u64) {
    let saved = scene.plant.save();
    let commands = scene.commands.clone();
    bencher
        .counter(divan::counter::ItemsCount::new(steps))
        .with_inputs(|| {
            let mut plant = scene.plant.clone();
            plant.restore(&saved).unwrap();
            plant
        })
        .bench_local_refs(|plant| {
            plant.advance(at(from_ms + steps), &commands).unwrap();
        });
}

/// Steps of an iteration: enough to hide the clock, few enough to stay in the same phase of the motion.
const STEPS: u64 = 20;

#[divan::bench(args = FORCES)]
fn standing(bencher: Bencher, force: &str) {
    let mut scene = Scene::forced(&robot(), &on(Base::Free), found(force));
    scene.to(500);
    steps(bencher, &scene, 500, STEPS);
}

#[divan::bench(args = FORCES)]
fn trotting(bencher: Bencher, force: &str) {
    let scene = Scene::trotting(&robot(), &on(Base::Free), found(force), 480);
    steps(bencher, &scene, 480, STEPS);
}

#[divan::bench(args = FORCES)]
fn trotting_in_the_plane(bencher: Bencher, force: &str) {
    let scene = Scene::trotting(&robot(), &on(Base::Planar), found(force), 480);
    steps(bencher, &scene, 480, STEPS);
}

#[divan::bench(args = FORCES)]
fn trotting_on_a_stand(bencher: Bencher, force: &str) {
    let mut setup = on(Base::Fixed);
    setup.ground = None;
    let scene = Scene::trotting(&robot(), &setup, found(force), 480);
    steps(bencher, &scene, 480, STEPS);
}

#[divan::bench(args = FORCES)]
fn in_flight(bencher: Bencher, force: &str) {
    let mut setup = on(Base::Free);
    setup.ground = None;
    let mut scene = Scene::forced(&robot(), &setup, found(force));
    scene.to(50);
    steps(bencher, &scene, 50, STEPS);
}

/// A whole second of trot, commands every two milliseconds: what a run pays for.
#[divan::bench(sample_count = 20)]
fn a_second_of_trot(bencher: Bencher) {
    let (robot, setup) = (robot(), on(Base::Free));
    let scene = Scene::trotting(&robot, &setup, Force::Solve, 480);
    let commands: Vec<Vec<f64>> = (240..740)
        .map(|tick| {
            let time_s = f64::from(tick) * 2e-3;
            let commands = scene::Trot::START.commands(&robot, &setup, time_s);
            commands
                .iter()
                .flat_map(|(_, command)| [command.hip, command.knee])
                .collect()
        })
        .collect();
    bencher
        .counter(divan::counter::ItemsCount::new(1000_u32))
        .with_inputs(|| scene.plant.clone())
        .bench_local_refs(|plant| {
            for (tick, commands) in (241..).zip(&commands) {
                plant.advance(at(2 * tick), commands).unwrap();
            }
        });
}

/// Building the plant: tables are filled then.
#[divan::bench(args = FORCES, sample_count = 10)]
fn building(bencher: Bencher, force: &str) {
    let options = Options {
        setup: on(Base::Free),
        force: found(force),
    };
    let robot = robot();
    bencher.bench_local(|| Massless::new(&robot, &options, &|_| true).unwrap());
}
