//! Saved, restored, repeated and resumed runs.

use twinrig_kernel::{SimTime, Snapshot};
use twinrig_legged::{Base, Setup};
use twinrig_mujoco::{Coordinates, Integrator, Options};
use twinrig_runtime::{Plant, PlantState};
use twinrig_testing::robots::{pose, robot};

use super::fixture::{Fixture, hanging, standing, with_coordinates, with_options};

/// Runs the robot with oscillating commands. Returns the bits of all outputs.
fn run_oscillating(fixture: &mut Fixture, from: u32, steps: u32) -> Vec<u64> {
    let first = fixture.commands.clone();
    let mut bits = Vec::new();
    for step in from..from + steps {
        for (i, input) in fixture.commands.iter_mut().enumerate() {
            *input = first[i] + 0.02 * libm::sin(0.05 * f64::from(step) + i as f64);
        }
        fixture.advance_us(2000);
        bits.extend(fixture.observe().iter().map(|x| x.to_bits()));
        if step % 7 == 0 {
            fixture.plant.begin_window();
        }
    }
    fixture.commands = first;
    bits
}

fn all_options() -> impl Iterator<Item = Options> {
    Coordinates::ALL.into_iter().flat_map(|coordinates| {
        Integrator::ALL.into_iter().map(move |integrator| {
            let mut options = Options::new(standing(), coordinates);
            options.numerics.integrator = integrator;
            options
        })
    })
}

#[test]
fn runs_are_repeatable_and_restorable_on_another_thread() {
    for options in all_options() {
        let mut fixture = with_options(&robot(), &options);
        let before = run_oscillating(&mut fixture, 0, 60);
        let saved: Snapshot = fixture.plant.save();
        let after = run_oscillating(&mut fixture, 60, 60);
        fixture.plant.restore(&saved).unwrap();
        let restored = fixture.plant.save();
        assert_eq!(restored, saved);

        let thread_options = options.clone();
        let other = std::thread::Builder::new().spawn(move || {
            let mut twice = with_options(&robot(), &thread_options);
            let before = run_oscillating(&mut twice, 0, 60);
            let mut fresh = with_options(&robot(), &thread_options);
            fresh.plant.restore(&saved).unwrap();
            fresh.now_us = 60 * 2000;
            (before, run_oscillating(&mut fresh, 60, 60))
        });
        let (twice, on) = other.unwrap().join().unwrap();
        assert!(twice == before, "{:?}", options.numerics.integrator);
        assert!(on == after, "{:?}", options.numerics.integrator);
    }
}

#[test]
fn posture_is_preserved_between_kinds_of_coordinates() {
    for base in [Base::Free, Base::Planar, Base::Fixed] {
        let setup = || Setup {
            base,
            ..hanging(pose([10.0, -25.0, 37.0], [6.0, -4.0, 3.0]))
        };
        let mut from = with_coordinates(setup(), Coordinates::Minimal);
        for _ in 0..20 {
            from.advance_us(1000);
        }
        let state = from.plant.state().unwrap();
        let mut to = with_coordinates(setup(), Coordinates::Maximal);
        let lines = to.plant.resume_from(&state).unwrap();
        assert_eq!(lines, Vec::<String>::new());
        let (expected, found) = (state, to.plant.state().unwrap());
        assert_eq!(expected.time, found.time);
        for (name, values) in expected.iter() {
            for (a, b) in values.iter().zip(found.get(name).unwrap()) {
                // A few roundings of coordinates.
                assert!((a - b).abs() < 1e-12, "{base:?} {name}: {a} {b}");
            }
        }
        // Spring and kinetic energies are those of the other plant.
        let (there, here) = (from.plant.energy(), to.plant.energy());
        for (a, b) in [(there.kinetic, here.kinetic), (there.spring, here.spring)] {
            assert!((a - b).abs() < 1e-12, "{base:?}: {a} {b}");
        }
        assert_eq!(here.impact + here.actuator + here.dissipated, 0.0);
    }
}

#[test]
fn incompatible_state_is_refused_without_change() {
    let mut fixture = with_coordinates(
        hanging(pose([10.0, -25.0, 37.0], [0.0; 3])),
        Coordinates::Minimal,
    );
    let before = fixture.plant.save();
    for state in [
        PlantState::at(SimTime::ZERO).with("leg/LF/angles", &[f64::NAN, 0.0, 0.0]),
        PlantState::at(SimTime::ZERO).with("body/position", &[1.0, 0.0, 0.0]),
        PlantState::at(SimTime::ZERO).with("body/orientation", &[2.0, 0.0, 0.0, 0.0]),
    ] {
        assert!(fixture.plant.resume_from(&state).is_err());
    }
    assert_eq!(fixture.plant.save(), before);
    let lines = fixture
        .plant
        .resume_from(&PlantState::at(SimTime::ZERO).with("mood", &[1.0]));
    let lines = lines.unwrap();
    assert!(lines.iter().any(|line| line.contains("mood")), "{lines:?}");
}

#[test]
fn snapshot_of_another_robot_is_refused() {
    let mut fixture = with_coordinates(standing(), Coordinates::Minimal);
    let other = with_coordinates(standing(), Coordinates::Maximal);
    assert!(fixture.plant.restore(&other.plant.save()).is_err());
}
