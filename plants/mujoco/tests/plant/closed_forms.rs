//! What a robot on the ground does that can be worked out by hand.

use twinrig_contact::{Ground, HeightField, Terrain};
use twinrig_legged::{Base, Drives, Setup};
use twinrig_mujoco::{Coordinates, Options};
use twinrig_robot::GRAVITY;
use twinrig_runtime::Plant;

use crate::scene::{LEGS, Scene, flat, robot, standing};

/// Lets a robot stand for a second, and takes the mean over the next tenth of a second of the sum of its feet's forces.
fn carried(setup: Setup, coordinates: Coordinates) -> [f64; 3] {
    let mut scene = Scene::of(setup, coordinates);
    for _ in 0..500 {
        scene.go(2000);
    }
    scene.plant.begin_window();
    for _ in 0..50 {
        scene.go(2000);
    }
    let mut sum = [0.0; 3];
    for leg in LEGS {
        let force = scene.read(&format!("leg/{leg}/foot/force"));
        for (sum, force) in sum.iter_mut().zip(force) {
            *sum += force;
        }
    }
    sum
}

#[test]
fn the_ground_carries_the_robots_weight() {
    let weight = robot().weight();
    for coordinates in Coordinates::ALL {
        for base in [Base::Free, Base::Planar] {
            let [x, y, z] = carried(Setup { base, ..standing() }, coordinates);
            // It still sways a little: a thousandth of its weight is a velocity that changes by 1 mm/s in this time.
            assert!(
                (z - weight).abs() < 2e-3 * weight,
                "{coordinates:?} {base:?}: {z} N"
            );
            assert!(
                x.abs() + y.abs() < 2e-3 * weight,
                "{coordinates:?} {base:?}: {x} {y}"
            );
        }
    }
}

#[test]
fn every_ground_carries_the_robot_and_at_its_own_height() {
    let field = || HeightField::new([-0.5; 2], 0.25, 5, vec![0.03; 25]).unwrap();
    for (terrain, height) in [
        (Terrain::Flat, 0.0),
        (
            Terrain::StepDown {
                at: 1.0,
                drop: 0.02,
            },
            0.0,
        ),
        (
            Terrain::StepDown {
                at: -1.0,
                drop: 0.02,
            },
            -0.02,
        ),
        (Terrain::Heights(field()), 0.03),
    ] {
        let ground = Some(Ground::new(terrain, 0.6, 0.0).unwrap());
        for coordinates in Coordinates::ALL {
            let mut scene = Scene::of(
                Setup {
                    ground: ground.clone(),
                    ..standing()
                },
                coordinates,
            );
            for _ in 0..500 {
                scene.go(2000);
            }
            for leg in LEGS {
                let foot = scene.read(&format!("leg/{leg}/foot/position"))[2];
                // A foot sinks in by micrometres.
                assert!(
                    (foot - height).abs() < 5e-5,
                    "{coordinates:?} {height}: {foot}"
                );
            }
        }
    }
}

#[test]
fn a_robot_slides_to_a_stop_as_friction_has_it() {
    // v²/(2 µ g), the legs held by their drives.
    let (friction, speed) = (0.2, 0.3);
    for coordinates in Coordinates::ALL {
        let setup = Setup {
            ground: Some(flat(friction)),
            ..standing()
        };
        let mut scene = Scene::of(setup, coordinates);
        for _ in 0..500 {
            scene.go(2000);
        }
        let mut state = scene.plant.state().unwrap();
        // Sideways: the legs do not give in that direction.
        state = state.with("body/velocity", &[0.0, speed, 0.0]);
        scene.plant.resume_from(&state).unwrap();
        let start = scene.read("body/position")[1];
        for _ in 0..300 {
            scene.go(2000);
        }
        let slid = scene.read("body/position")[1] - start;
        let expected = speed * speed / (2.0 * friction * GRAVITY);
        // The trunk rolls, and load wanders between the feet, but all of them slide.
        assert!(
            (slid - expected).abs() < 0.1 * expected,
            "{coordinates:?}: {slid} {expected}"
        );
    }
}

/// How far feet leave the ground on which a robot slides sideways \[m\], and the steps in which one of them carries nothing.
fn lifted(coordinates: Coordinates, sliding_rounds: Option<u32>) -> (f64, u32) {
    let setup = Setup {
        ground: Some(flat(0.2)),
        ..standing()
    };
    let mut options = Options::new(setup, coordinates);
    if let Some(rounds) = sliding_rounds {
        options.numerics.sliding_rounds = rounds;
    }
    let mut scene = Scene::new(&robot(), &options);
    for _ in 0..500 {
        scene.go(2000);
    }
    let state = scene.plant.state().unwrap();
    let state = state.with("body/velocity", &[0.0, 0.5, 0.0]);
    scene.plant.resume_from(&state).unwrap();
    let (mut highest, mut free) = (0.0_f64, 0);
    for _ in 0..50 {
        scene.plant.begin_window();
        scene.go(2000);
        for leg in LEGS {
            highest = highest.max(scene.read(&format!("leg/{leg}/foot/position"))[2]);
            free += u32::from(scene.read(&format!("leg/{leg}/foot/load"))[0] <= 0.0);
        }
    }
    (highest, free)
}

#[test]
fn feet_that_slide_stay_on_the_ground() {
    for coordinates in Coordinates::ALL {
        let (highest, free) = lifted(coordinates, None);
        // Braking unloads the feet of one side for a moment, some steps of 200.
        assert!(
            highest < 2e-5 && free < 30,
            "{coordinates:?}: {highest} m, {free} steps"
        );
        // MuJoCo's own friction lifts them at µ times what they slide at, and drops them again.
        let (highest, free) = lifted(coordinates, Some(0));
        assert!(
            highest > 1e-4 && free > 60,
            "{coordinates:?}: {highest} m, {free} steps"
        );
    }
}

#[test]
fn a_robot_without_ground_falls_as_a_stone() {
    for coordinates in Coordinates::ALL {
        let setup = Setup {
            ground: None,
            drives: Drives::None,
            ..standing()
        };
        let mut scene = Scene::of(setup, coordinates);
        let centre = |scene: &mut Scene| scene.plant.energy().gravity / robot().weight();
        let start = centre(&mut scene);
        for _ in 0..100 {
            scene.go(1000);
        }
        let fallen = start - centre(&mut scene);
        // Steps of first order fall by half a step's velocity more: g t h/2.
        let expected = 0.5 * GRAVITY * 0.1 * 0.1;
        let more = GRAVITY * 0.1 * 0.5e-3 + 1e-6;
        assert!(
            (fallen - expected).abs() <= more * 1.01,
            "{coordinates:?}: {fallen} {expected}"
        );
    }
}

#[test]
fn the_model_that_is_written_weighs_what_the_robot_weighs() {
    for coordinates in Coordinates::ALL {
        let setup = Setup {
            drives: Drives::None,
            ..standing()
        };
        let text = twinrig_mujoco::mjcf(&robot(), &Options::new(setup, coordinates)).unwrap();
        let engine = twinrig_mujoco::Engine::compile(&text).unwrap();
        let mass: f64 = engine.model().body_mass().iter().sum();
        assert!((mass - robot().mass()).abs() < 1e-12);
        let freedoms = engine.data().qvel().len();
        let expected = match coordinates {
            Coordinates::Minimal => 6 + 12,
            Coordinates::Maximal => 6 + 36,
        };
        assert_eq!(freedoms, expected);
    }
}
