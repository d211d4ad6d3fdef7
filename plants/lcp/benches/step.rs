//! Cost of a step of 2 ms. Each iteration resumes from the same snapshot, so that every machine and
//! version does the same work.

#[allow(dead_code, reason = "the tests use the other items")]
#[path = "../tests/plant/harness.rs"]
mod harness;
#[path = "../tests/plant/trot.rs"]
mod trot;

use divan::Bencher;
use harness::{
    Harness, Integration, build, passive_start, pose, robot, standing_setup, suspended, with_legs,
};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_lcp::Method;
use twinrig_legged::Setup;
use twinrig_robot::Robot;
use twinrig_runtime::Plant;

fn main() {
    divan::main();
}

/// Steps per iteration: enough to hide the clock resolution, few enough to stay in one phase of the
/// motion.
const STEPS: usize = 20;

/// Measures the mean cost of steps under `commands`, one per step, after a preparation under
/// `before`.
fn steps(
    bencher: Bencher,
    (robot, setup, method): (&Robot, &Setup, Method),
    before: &[Vec<f64>],
    commands: &[Vec<f64>],
) {
    let integration = Integration::new(method, 2000);
    let run = |harness: &mut Harness, from: usize, commands: &[Vec<f64>]| {
        for (tick, commands) in (from as u64 + 1..).zip(commands) {
            let at = SimTime::ZERO + SimDuration::from_millis(2 * tick);
            harness.plant.advance(at, commands).unwrap();
        }
    };
    let mut harness = Harness::new(robot, setup, integration);
    run(&mut harness, 0, before);
    let saved = harness.plant.save();
    bencher
        .counter(divan::counter::ItemsCount::new(commands.len()))
        .with_inputs(|| {
            let mut harness = Harness::new(robot, setup, integration);
            harness.plant.restore(&saved).unwrap();
            harness
        })
        .bench_local_refs(|harness| run(harness, before.len(), commands));
}

fn constant_commands(harness: &Harness, count: usize) -> Vec<Vec<f64>> {
    vec![harness.commands.clone(); count]
}

/// Legs suspended at their lower stops.
#[divan::bench]
fn passive_legs(bencher: Bencher) {
    let (robot, setup) = (robot(), suspended(passive_start()));
    let none = vec![Vec::new(); 150];
    steps(
        bencher,
        (&robot, &setup, Method::Rk4),
        &none,
        &none[..STEPS],
    );
}

/// Legs with springs that keep them off their stops.
#[divan::bench]
fn passive_legs_off_their_stops(bencher: Bencher) {
    let robot = with_legs(|leg| {
        leg.diagonal.preload = -4e-3;
        leg.parallel.preload = -4e-3;
    });
    let setup = suspended(pose([10.0, -26.0, 44.0], [0.0; 3]));
    let none = vec![Vec::new(); 150];
    steps(
        bencher,
        (&robot, &setup, Method::Rk4),
        &none,
        &none[..STEPS],
    );
}

/// Integrators used for gaits.
const GAITS: [&str; 2] = ["moreau", "rk4"];

fn method_of_name(name: &str) -> Method {
    let mut methods = Method::ALL.into_iter();
    methods.find(|method| method.name() == name).unwrap()
}

#[divan::bench(args = GAITS)]
fn trotting(bencher: Bencher, method: &str) {
    let robot = robot();
    let setup = trot::start_of_trot(&robot, standing_setup());
    let commands = trot::commands(&robot, &setup, 0, 1200);
    let (before, during) = commands.split_at(500);
    steps(
        bencher,
        (&robot, &setup, method_of_name(method)),
        before,
        during,
    );
}

#[divan::bench(args = GAITS)]
fn standing_still(bencher: Bencher, method: &str) {
    let robot = robot();
    let setup = trot::start_of_trot(&robot, standing_setup());
    let harness = Harness::new(
        &robot,
        &setup,
        Integration::new(method_of_name(method), 2000),
    );
    let commands = constant_commands(&harness, 250 + STEPS);
    let (before, during) = commands.split_at(250);
    steps(
        bencher,
        (&robot, &setup, method_of_name(method)),
        before,
        during,
    );
}

#[divan::bench(args = GAITS)]
fn in_flight(bencher: Bencher, method: &str) {
    let robot = robot();
    let mut setup = trot::start_of_trot(&robot, standing_setup());
    setup.ground = None;
    let harness = Harness::new(
        &robot,
        &setup,
        Integration::new(method_of_name(method), 2000),
    );
    let commands = constant_commands(&harness, 25 + STEPS);
    let (before, during) = commands.split_at(25);
    steps(
        bencher,
        (&robot, &setup, method_of_name(method)),
        before,
        during,
    );
}

/// Construction of the plant.
#[divan::bench]
fn building(bencher: Bencher) {
    let robot = robot();
    let setup = trot::start_of_trot(&robot, standing_setup());
    let integration = Integration::new(Method::Moreau, 2000);
    bencher.bench_local(|| build(&robot, &setup, integration).unwrap());
}
