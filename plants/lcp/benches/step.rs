//! Cost of a step of 2 ms. Each iteration resumes from the same snapshot, so that every machine and
//! version does the same work.

use divan::Bencher;
use twinrig_kernel::SimDuration;
use twinrig_lcp::{Constraints, Features, Lcp, Method, Options};
use twinrig_legged::{SetPoint, Setup};
use twinrig_robot::Robot;
use twinrig_runtime::Plant;
use twinrig_testing::plant_harness::{PlantHarness, at_ms};
use twinrig_testing::robots::{LEGS, SERVOS, pose, robot, standing, suspended, with_legs};
use twinrig_testing::trot::Trot;

fn main() {
    divan::main();
}

/// Steps per iteration: enough to hide the clock resolution, few enough to stay in one phase of the
/// motion.
const STEPS: usize = 20;

/// Returns options with rigid constraints.
fn rigid(setup: &Setup, method: Method) -> Options {
    Options {
        constraints: Constraints::Rigid,
        setup: setup.clone(),
        method,
        tolerance: Options::TOLERANCE,
        toe: false,
        features: Features::Detected,
    }
}

fn build(robot: &Robot, options: &Options) -> PlantHarness<Lcp> {
    PlantHarness::new(Lcp::new(robot, options, &|_| true).unwrap())
}

/// Returns the setup of a trot.
fn setup_of_trot(robot: &Robot) -> Setup {
    Trot::START.started(robot, standing(SERVOS, 2000))
}

/// Measures the mean cost of steps under `commands`, one per step, after a preparation under
/// `before`.
fn steps(
    bencher: Bencher,
    (robot, options): (&Robot, &Options),
    before: &[Vec<f64>],
    commands: &[Vec<f64>],
) {
    let run = |harness: &mut PlantHarness<Lcp>, from: usize, commands: &[Vec<f64>]| {
        for (tick, commands) in (from as u64 + 1..).zip(commands) {
            harness.plant.advance(at_ms(2 * tick), commands).unwrap();
        }
    };
    let mut harness = build(robot, options);
    run(&mut harness, 0, before);
    let saved = harness.plant.save();
    bencher
        .counter(divan::counter::ItemsCount::new(commands.len()))
        .with_inputs(|| {
            let mut harness = build(robot, options);
            harness.plant.restore(&saved).unwrap();
            harness
        })
        .bench_local_refs(|harness| run(harness, before.len(), commands));
}

fn constant_commands(harness: &PlantHarness<Lcp>, count: usize) -> Vec<Vec<f64>> {
    vec![harness.commands.clone(); count]
}

/// Legs suspended at their lower stops.
#[divan::bench]
fn passive_legs(bencher: Bencher) {
    let (robot, setup) = (
        robot(),
        suspended(&LEGS, pose([10.0, -9.5, 9.5], [0.0; 3]), 2000),
    );
    let none = vec![Vec::new(); 150];
    steps(
        bencher,
        (&robot, &rigid(&setup, Method::Rk4)),
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
    let setup = suspended(&LEGS, pose([10.0, -26.0, 44.0], [0.0; 3]), 2000);
    let none = vec![Vec::new(); 150];
    steps(
        bencher,
        (&robot, &rigid(&setup, Method::Rk4)),
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
    let setup = setup_of_trot(&robot);
    let commands = Trot::START.sampled(&robot, &setup, 0, 1200);
    let (before, during) = commands.split_at(500);
    steps(
        bencher,
        (&robot, &rigid(&setup, method_of_name(method))),
        before,
        during,
    );
}

/// The same with compliant constraints, in the widest registers of the processor and in those of
/// every one.
#[divan::bench(args = [Features::Detected, Features::Portable])]
fn trotting_on_compliant_constraints(bencher: Bencher, features: Features) {
    let robot = robot();
    let mut setup = setup_of_trot(&robot);
    setup.set_point = SetPoint::Linear {
        period: SimDuration::from_millis(2),
    };
    let commands = Trot::START.sampled(&robot, &setup, 0, 1200);
    let (before, during) = commands.split_at(500);
    let options = Options {
        constraints: Constraints::Compliant,
        tolerance: Options::COMPLIANT_TOLERANCE,
        features,
        ..rigid(&setup, Method::Rk4)
    };
    steps(bencher, (&robot, &options), before, during);
}

#[divan::bench(args = GAITS)]
fn standing_still(bencher: Bencher, method: &str) {
    let robot = robot();
    let setup = setup_of_trot(&robot);
    let harness = build(&robot, &rigid(&setup, method_of_name(method)));
    let commands = constant_commands(&harness, 250 + STEPS);
    let (before, during) = commands.split_at(250);
    steps(
        bencher,
        (&robot, &rigid(&setup, method_of_name(method))),
        before,
        during,
    );
}

#[divan::bench(args = GAITS)]
fn in_flight(bencher: Bencher, method: &str) {
    let robot = robot();
    let mut setup = setup_of_trot(&robot);
    setup.ground = None;
    let harness = build(&robot, &rigid(&setup, method_of_name(method)));
    let commands = constant_commands(&harness, 25 + STEPS);
    let (before, during) = commands.split_at(25);
    steps(
        bencher,
        (&robot, &rigid(&setup, method_of_name(method))),
        before,
        during,
    );
}

/// Observation of all signals.
#[divan::bench]
fn observation(bencher: Bencher) {
    let robot = robot();
    let mut harness = build(&robot, &rigid(&setup_of_trot(&robot), Method::Moreau));
    bencher.bench_local(|| harness.observe()[0]);
}

/// Construction of the plant.
#[divan::bench]
fn building(bencher: Bencher) {
    let robot = robot();
    let setup = setup_of_trot(&robot);
    bencher.bench_local(|| build(&robot, &rigid(&setup, Method::Moreau)));
}
