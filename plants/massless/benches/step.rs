//! Cost of one step of a millisecond. Every iteration starts from the same saved state, so that all
//! machines and versions do the same work.

use divan::Bencher;
use twinrig_legged::{Base, Setup};
use twinrig_massless::{Features, Force, Massless, Options};
use twinrig_runtime::Plant;
use twinrig_testing::plant_harness::{PlantHarness, at_ms};
use twinrig_testing::robots::{self, SERVOS, robot};
use twinrig_testing::trot::Trot;

type Harness = PlantHarness<Massless>;

fn main() {
    divan::main();
}

/// Methods for the force of a leg with rigid constraints, and compliant constraints, in the widest
/// registers of the processor and in those of every one.
const FORCES: [&str; 4] = ["solve", "lookup", "compliant", "compliant, portable"];

fn options_of(setup: Setup, force: &str) -> Options {
    match force {
        "solve" => Options::new(setup, Force::Solve),
        "lookup" => Options::new(setup, Force::Lookup { cells: 64 }),
        "compliant" => Options::compliant(setup, Options::TOLERANCE),
        _ => Options {
            features: Features::Portable,
            ..Options::compliant(setup, Options::TOLERANCE)
        },
    }
}

fn setup_on(base: Base) -> Setup {
    Setup {
        base,
        ..robots::standing(SERVOS, 1000)
    }
}

fn build(setup: &Setup, force: &str) -> Harness {
    let options = options_of(setup.clone(), force);
    Harness::new(Massless::new(&robot(), &options, &|_| true).unwrap())
}

/// Returns a harness after 480 ms of a trot.
fn trot(setup: Setup, force: &str) -> Harness {
    let robot = robot();
    let setup = Trot::START.started(&robot, setup);
    let mut harness = build(&setup, force);
    for ms in 1..=480 {
        harness.trot(&robot, &setup, Trot::START, ms);
    }
    harness
}

/// Mean over `steps` steps from the harness' state, which is restored in each iteration.
fn steps(bencher: Bencher, mut harness: Harness, from_ms: u64, steps: u64) {
    let saved = harness.plant.save();
    let commands = harness.commands.clone();
    bencher
        .counter(divan::counter::ItemsCount::new(steps))
        .bench_local(|| {
            harness.plant.restore(&saved).unwrap();
            let end = at_ms(from_ms + steps);
            harness.plant.advance(end, &commands).unwrap();
        });
}

/// Steps of an iteration: enough to hide the clock's resolution, few enough to stay in one phase of
/// the motion.
const STEPS: u64 = 20;

#[divan::bench(args = FORCES)]
fn standing(bencher: Bencher, force: &str) {
    let mut harness = build(&setup_on(Base::Free), force);
    harness.advance_to_ms(500);
    steps(bencher, harness, 500, STEPS);
}

#[divan::bench(args = FORCES)]
fn trotting(bencher: Bencher, force: &str) {
    let harness = trot(setup_on(Base::Free), force);
    steps(bencher, harness, 480, STEPS);
}

#[divan::bench(args = FORCES)]
fn trotting_in_the_plane(bencher: Bencher, force: &str) {
    let harness = trot(setup_on(Base::Planar), force);
    steps(bencher, harness, 480, STEPS);
}

#[divan::bench(args = FORCES)]
fn trotting_on_a_stand(bencher: Bencher, force: &str) {
    let mut setup = setup_on(Base::Fixed);
    setup.ground = None;
    let harness = trot(setup, force);
    steps(bencher, harness, 480, STEPS);
}

#[divan::bench(args = FORCES)]
fn in_flight(bencher: Bencher, force: &str) {
    let mut setup = setup_on(Base::Free);
    setup.ground = None;
    let mut harness = build(&setup, force);
    harness.advance_to_ms(50);
    steps(bencher, harness, 50, STEPS);
}

/// A second of trot with commands every two milliseconds, as in a run.
#[divan::bench(args = FORCES, sample_count = 20)]
fn a_second_of_trot(bencher: Bencher, force: &str) {
    let (robot, setup) = (robot(), setup_on(Base::Free));
    let mut harness = trot(setup.clone(), force);
    let saved = harness.plant.save();
    let commands = Trot::START.sampled(&robot, &setup, 480, 1480);
    bencher
        .counter(divan::counter::ItemsCount::new(1000_u32))
        .bench_local(|| {
            harness.plant.restore(&saved).unwrap();
            for (tick, commands) in (241..).zip(&commands) {
                harness.plant.advance(at_ms(2 * tick), commands).unwrap();
            }
        });
}

/// Construction of the plant, which includes filling the tables.
#[divan::bench(args = FORCES, sample_count = 10)]
fn building(bencher: Bencher, force: &str) {
    let options = options_of(setup_on(Base::Free), force);
    let robot = robot();
    bencher.bench_local(|| Massless::new(&robot, &options, &|_| true).unwrap());
}
