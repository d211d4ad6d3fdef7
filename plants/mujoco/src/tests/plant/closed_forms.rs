//! A robot on the ground against closed forms.

use twinrig_contact::{Ground, HeightField, Terrain};
use twinrig_legged::{Base, Drives, Setup};
use twinrig_mujoco::{Coordinates, Options};
use twinrig_robot::GRAVITY;
use twinrig_runtime::Plant;
use twinrig_testing::robots::{LEGS, flat_ground, robot};

use super::fixture::{Fixture, standing, with_coordinates, with_options};

/// Returns the sum of the mean forces on the feet over 0.1 s, after the robot has stood for a
/// second.
fn mean_ground_force(setup: Setup, coordinates: Coordinates) -> [f64; 3] {
    let mut fixture = with_coordinates(setup, coordinates);
    for _ in 0..500 {
        fixture.advance_us(2000);
    }
    fixture.plant.begin_window();
    for _ in 0..50 {
        fixture.advance_us(2000);
    }
    let mut sum = [0.0; 3];
    for leg in LEGS {
        let force = fixture.read(&format!("leg/{leg}/foot/force"));
        for (sum, force) in sum.iter_mut().zip(force) {
            *sum += force;
        }
    }
    sum
}

#[test]
fn ground_carries_the_weight() {
    let weight = robot().weight();
    for coordinates in Coordinates::ALL {
        for base in [Base::Free, Base::Planar] {
            let [x, y, z] = mean_ground_force(Setup { base, ..standing() }, coordinates);
            // The robot still sways: a thousandth of its weight changes its velocity by 1 mm/s in
            // this time.
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
fn feet_rest_at_the_height_of_every_terrain() {
    let field = || HeightField::new([-0.5; 2], 0.25, 5, vec![0.03; 25]).unwrap();
    for (terrain, height) in [
        (Terrain::Flat, 0.0),
        (Terrain::step_down(1.0, 0.02), 0.0),
        (Terrain::step_down(-1.0, 0.02), -0.02),
        (Terrain::Heights(field()), 0.03),
    ] {
        let ground = Some(Ground::new(terrain, 0.6, 0.0).unwrap());
        for coordinates in Coordinates::ALL {
            let mut fixture = with_coordinates(
                Setup {
                    ground: ground.clone(),
                    ..standing()
                },
                coordinates,
            );
            for _ in 0..500 {
                fixture.advance_us(2000);
            }
            for leg in LEGS {
                let foot = fixture.read(&format!("leg/{leg}/foot/position"))[2];
                // A foot penetrates the ground by micrometres.
                assert!(
                    (foot - height).abs() < 5e-5,
                    "{coordinates:?} {height}: {foot}"
                );
            }
        }
    }
}

#[test]
fn sliding_distance_agrees_with_coulomb_friction() {
    // v²/(2 µ g), with the legs held by their drives.
    let (friction, speed) = (0.2, 0.3);
    for coordinates in Coordinates::ALL {
        let setup = Setup {
            ground: Some(flat_ground(friction)),
            ..standing()
        };
        let mut fixture = with_coordinates(setup, coordinates);
        for _ in 0..500 {
            fixture.advance_us(2000);
        }
        let mut state = fixture.plant.state().unwrap();
        // Sideways: the legs do not yield in that direction.
        state = state.with("body/velocity", &[0.0, speed, 0.0]);
        fixture.plant.resume_from(&state).unwrap();
        let start = fixture.read("body/position")[1];
        for _ in 0..300 {
            fixture.advance_us(2000);
        }
        let distance = fixture.read("body/position")[1] - start;
        let expected = speed * speed / (2.0 * friction * GRAVITY);
        // The trunk rolls, and the load shifts between the feet, but all of them slide.
        assert!(
            (distance - expected).abs() < 0.1 * expected,
            "{coordinates:?}: {distance} {expected}"
        );
    }
}

/// Returns the largest height of the feet of a robot that slides sideways \[m\], and the number of
/// steps of feet without load.
fn max_lift(coordinates: Coordinates, sliding_rounds: Option<u32>) -> (f64, u32) {
    let setup = Setup {
        ground: Some(flat_ground(0.2)),
        ..standing()
    };
    let mut options = Options::new(setup, coordinates);
    if let Some(rounds) = sliding_rounds {
        options.numerics.sliding_rounds = rounds;
    }
    let mut fixture = with_options(&robot(), &options);
    for _ in 0..500 {
        fixture.advance_us(2000);
    }
    let state = fixture.plant.state().unwrap();
    let state = state.with("body/velocity", &[0.0, 0.5, 0.0]);
    fixture.plant.resume_from(&state).unwrap();
    let (mut highest, mut free) = (0.0_f64, 0);
    for _ in 0..50 {
        fixture.plant.begin_window();
        fixture.advance_us(2000);
        for leg in LEGS {
            highest = highest.max(fixture.read(&format!("leg/{leg}/foot/position"))[2]);
            free += u32::from(fixture.read(&format!("leg/{leg}/foot/load"))[0] <= 0.0);
        }
    }
    (highest, free)
}

#[test]
fn sliding_feet_stay_on_the_ground() {
    for coordinates in Coordinates::ALL {
        let (highest, free) = max_lift(coordinates, None);
        // Braking unloads the feet of one side for a moment, some steps of 200.
        assert!(
            highest < 2e-5 && free < 30,
            "{coordinates:?}: {highest} m, {free} steps"
        );
        // MuJoCo's own friction lifts them at µ times their sliding velocity, and they fall back.
        let (highest, free) = max_lift(coordinates, Some(0));
        assert!(
            highest > 1e-4 && free > 60,
            "{coordinates:?}: {highest} m, {free} steps"
        );
    }
}

#[test]
fn robot_without_ground_falls_freely() {
    for coordinates in Coordinates::ALL {
        let setup = Setup {
            ground: None,
            drives: Drives::None,
            ..standing()
        };
        let mut fixture = with_coordinates(setup, coordinates);
        let centre = |fixture: &mut Fixture| fixture.plant.energy().gravity / robot().weight();
        let start = centre(&mut fixture);
        for _ in 0..100 {
            fixture.advance_us(1000);
        }
        let fall = start - centre(&mut fixture);
        // First-order steps fall by half a step's velocity more: g t h/2.
        let expected = 0.5 * GRAVITY * 0.1 * 0.1;
        let excess = GRAVITY * 0.1 * 0.5e-3 + 1e-6;
        assert!(
            (fall - expected).abs() <= excess * 1.01,
            "{coordinates:?}: {fall} {expected}"
        );
    }
}

#[test]
fn exported_model_has_the_mass_of_the_robot() {
    for coordinates in Coordinates::ALL {
        let setup = Setup {
            drives: Drives::None,
            ..standing()
        };
        let text = twinrig_mujoco::mjcf(&robot(), &Options::new(setup, coordinates)).unwrap();
        let engine = twinrig_mujoco::Engine::compile(&text).unwrap();
        let mass: f64 = engine.model().body_mass().iter().sum();
        assert!((mass - robot().mass()).abs() < 1e-12);
        let dofs = engine.data().qvel().len();
        let expected = match coordinates {
            Coordinates::Minimal => 6 + 12,
            Coordinates::Maximal => 6 + 36,
        };
        assert_eq!(dofs, expected);
    }
}
