//! Saved, restored, run twice, handed over.

use twinrig_kernel::{SimTime, Snapshot};
use twinrig_legged::{Base, Setup};
use twinrig_mujoco::{Coordinates, Integrator, Options};
use twinrig_runtime::{Plant, PlantState};

use crate::scene::{Scene, hanging, pose, robot, standing};

/// A robot that is pulled about: its commands go up and down.
fn pulled(scene: &mut Scene, from: u32, steps: u32) -> Vec<u64> {
    let first = scene.inputs.clone();
    let mut bits = Vec::new();
    for step in from..from + steps {
        for (i, input) in scene.inputs.iter_mut().enumerate() {
            *input = first[i] + 0.02 * libm::sin(0.05 * f64::from(step) + i as f64);
        }
        scene.go(2000);
        bits.extend(scene.all().iter().map(|x| x.to_bits()));
        if step % 7 == 0 {
            scene.plant.begin_window();
        }
    }
    scene.inputs = first;
    bits
}

fn every() -> impl Iterator<Item = Options> {
    Coordinates::ALL.into_iter().flat_map(|coordinates| {
        Integrator::ALL.into_iter().map(move |integrator| {
            let mut options = Options::new(standing(), coordinates);
            options.numerics.integrator = integrator;
            options
        })
    })
}

#[test]
fn a_run_is_the_same_twice_and_from_its_middle_on_another_thread() {
    for options in every() {
        let mut scene = Scene::new(&robot(), &options);
        let before = pulled(&mut scene, 0, 60);
        let saved: Snapshot = scene.plant.save();
        let after = pulled(&mut scene, 60, 60);
        scene.plant.restore(&saved).unwrap();
        let restored = scene.plant.save();
        assert_eq!(restored, saved);

        let own = options.clone();
        let other = std::thread::Builder::new().spawn(move || {
            let mut twice = Scene::new(&robot(), &own);
            let before = pulled(&mut twice, 0, 60);
            let mut fresh = Scene::new(&robot(), &own);
            fresh.plant.restore(&saved).unwrap();
            fresh.skip(60 * 2000);
            (before, pulled(&mut fresh, 60, 60))
        });
        let (twice, on) = other.unwrap().join().unwrap();
        assert!(twice == before, "{:?}", options.numerics.integrator);
        assert!(on == after, "{:?}", options.numerics.integrator);
    }
}

#[test]
fn a_posture_goes_over_from_one_kind_of_coordinates_to_the_other() {
    for base in [Base::Free, Base::Planar, Base::Fixed] {
        let setup = || Setup {
            base,
            ..hanging(pose([10.0, -25.0, 37.0], [6.0, -4.0, 3.0]))
        };
        let mut from = Scene::of(setup(), Coordinates::Minimal);
        for _ in 0..20 {
            from.go(1000);
        }
        let state = from.plant.state().unwrap();
        let mut to = Scene::of(setup(), Coordinates::Maximal);
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
        // Its springs and heights are those of the other.
        let (there, here) = (from.plant.energy(), to.plant.energy());
        for (a, b) in [(there.kinetic, here.kinetic), (there.spring, here.spring)] {
            assert!((a - b).abs() < 1e-12, "{base:?}: {a} {b}");
        }
        assert_eq!(here.impact + here.actuator + here.dissipated, 0.0);
    }
}

#[test]
fn what_cannot_be_taken_over_is_refused_and_moves_nothing() {
    let mut scene = Scene::of(
        hanging(pose([10.0, -25.0, 37.0], [0.0; 3])),
        Coordinates::Minimal,
    );
    let before = scene.plant.save();
    for state in [
        PlantState::at(SimTime::ZERO).with("leg/LF/angles", &[f64::NAN, 0.0, 0.0]),
        PlantState::at(SimTime::ZERO).with("body/position", &[1.0, 0.0, 0.0]),
        PlantState::at(SimTime::ZERO).with("body/orientation", &[2.0, 0.0, 0.0, 0.0]),
    ] {
        assert!(scene.plant.resume_from(&state).is_err());
    }
    assert_eq!(scene.plant.save(), before);
    let lines = scene
        .plant
        .resume_from(&PlantState::at(SimTime::ZERO).with("mood", &[1.0]));
    let lines = lines.unwrap();
    assert!(lines.iter().any(|line| line.contains("mood")), "{lines:?}");
}

#[test]
fn the_snapshot_of_another_robot_is_refused() {
    let mut scene = Scene::of(standing(), Coordinates::Minimal);
    let other = Scene::of(standing(), Coordinates::Maximal);
    assert!(scene.plant.restore(&other.plant.save()).is_err());
}
