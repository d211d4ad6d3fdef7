//! Cost of one step of a millisecond. Every iteration starts from the same saved state, so that all
//! machines and versions do the same work.

#[allow(dead_code, reason = "used by the tests only")]
#[path = "../tests/plant/harness.rs"]
mod harness;

use divan::Bencher;
use harness::{Harness, at, robot, setup};
use twinrig_legged::{Base, Setup};
use twinrig_massless::{Force, Massless, Options};
use twinrig_runtime::Plant;

fn main() {
    divan::main();
}

/// Methods for the force of a leg.
const FORCES: [&str; 2] = ["solve", "lookup"];

fn force_of(force: &str) -> Force {
    match force {
        "solve" => Force::Solve,
        _ => Force::Lookup { cells: 64 },
    }
}

fn setup_on(base: Base) -> Setup {
    Setup { base, ..setup() }
}

/// Mean over `steps` steps from the harness' state, which is restored before each iteration.
fn steps(bencher: Bencher, harness: &Harness, from_ms: u64, steps: u64) {
    let saved = harness.plant.save();
    let commands = harness.commands.clone();
    bencher
        .counter(divan::counter::ItemsCount::new(steps))
        .with_inputs(|| {
            let mut plant = harness.plant.clone();
            plant.restore(&saved).unwrap();
            plant
        })
        .bench_local_refs(|plant| {
            plant.advance(at(from_ms + steps), &commands).unwrap();
        });
}

/// Steps of an iteration: enough to hide the clock's resolution, few enough to stay in one phase of
/// the motion.
const STEPS: u64 = 20;

#[divan::bench(args = FORCES)]
fn standing(bencher: Bencher, force: &str) {
    let mut harness = Harness::with_force(&robot(), &setup_on(Base::Free), force_of(force));
    harness.advance_to(500);
    steps(bencher, &harness, 500, STEPS);
}

#[divan::bench(args = FORCES)]
fn trotting(bencher: Bencher, force: &str) {
    let harness = Harness::trotting(&robot(), &setup_on(Base::Free), force_of(force), 480);
    steps(bencher, &harness, 480, STEPS);
}

#[divan::bench(args = FORCES)]
fn trotting_in_the_plane(bencher: Bencher, force: &str) {
    let harness = Harness::trotting(&robot(), &setup_on(Base::Planar), force_of(force), 480);
    steps(bencher, &harness, 480, STEPS);
}

#[divan::bench(args = FORCES)]
fn trotting_on_a_stand(bencher: Bencher, force: &str) {
    let mut setup = setup_on(Base::Fixed);
    setup.ground = None;
    let harness = Harness::trotting(&robot(), &setup, force_of(force), 480);
    steps(bencher, &harness, 480, STEPS);
}

#[divan::bench(args = FORCES)]
fn in_flight(bencher: Bencher, force: &str) {
    let mut setup = setup_on(Base::Free);
    setup.ground = None;
    let mut harness = Harness::with_force(&robot(), &setup, force_of(force));
    harness.advance_to(50);
    steps(bencher, &harness, 50, STEPS);
}

/// A second of trot with commands every two milliseconds, as in a run.
#[divan::bench(sample_count = 20)]
fn a_second_of_trot(bencher: Bencher) {
    let (robot, setup) = (robot(), setup_on(Base::Free));
    let harness = Harness::trotting(&robot, &setup, Force::Solve, 480);
    let commands: Vec<Vec<f64>> = (240..740)
        .map(|tick| {
            let time_s = f64::from(tick) * 2e-3;
            let commands = harness::Trot::START.commands(&robot, &setup, time_s);
            commands
                .iter()
                .flat_map(|(_, command)| [command.hip, command.knee])
                .collect()
        })
        .collect();
    bencher
        .counter(divan::counter::ItemsCount::new(1000_u32))
        .with_inputs(|| harness.plant.clone())
        .bench_local_refs(|plant| {
            for (tick, commands) in (241..).zip(&commands) {
                plant.advance(at(2 * tick), commands).unwrap();
            }
        });
}

/// Construction of the plant, which includes filling the tables.
#[divan::bench(args = FORCES, sample_count = 10)]
fn building(bencher: Bencher, force: &str) {
    let options = Options {
        setup: setup_on(Base::Free),
        force: force_of(force),
    };
    let robot = robot();
    bencher.bench_local(|| Massless::new(&robot, &options, &|_| true).unwrap());
}
