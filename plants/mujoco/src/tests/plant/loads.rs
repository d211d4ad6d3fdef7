//! Payloads and surfaces against closed forms.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use twinrig_contact::Patch;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_legged::Setup;
use twinrig_mujoco::{Coordinates, Options};
use twinrig_runtime::Plant;
use twinrig_testing::robots::{LEGS, LoadedTrunk, flat_ground, suspended};

use super::fixture::{standing, with_coordinates, with_options};

#[test]
fn sliding_feet_have_the_friction_of_the_present_patch() {
    let patch = |friction, begin_us| Patch {
        friction,
        extent: f64::NEG_INFINITY..f64::INFINITY,
        begin: SimTime::ZERO + SimDuration::from_micros(begin_us),
        end: None,
    };
    let ground = flat_ground(0.3).with_patches(vec![patch(0.05, 50_300)]);
    let setup = Setup {
        ground: Some(ground.unwrap()),
        ..standing()
    };
    for coordinates in Coordinates::ALL {
        let mut fixture = with_coordinates(setup.clone(), coordinates);
        let state = fixture.plant.state().unwrap();
        let state = state.with("body/velocity", &[1.5, 0.0, 0.0]);
        fixture.plant.resume_from(&state).unwrap();
        fixture.advance_us(20_000);
        for (to_us, friction) in [(30_300, 0.3), (40_000, 0.05)] {
            fixture.plant.begin_window();
            fixture.advance_us(to_us);
            let force = LEGS.map(|leg| fixture.read(&format!("leg/{leg}/foot/force")));
            let sum = |axis: usize| force.iter().map(|force| force[axis]).sum::<f64>();
            let ratio = -sum(0) / sum(2);
            assert!(
                (ratio - friction).abs() < 0.02 * friction,
                "{coordinates:?}: {ratio} {friction}"
            );
        }
    }
}

/// Without legs, trunk and payload are one free body: its angular momentum in the world is
/// conserved, and its energy, which the plant computes from the parts.
#[test]
fn trunk_and_payload_are_one_rigid_body() {
    let loaded = LoadedTrunk::new(0.4, Vector3::new(0.08, -0.05, 0.03));
    let (centre, inertia) = (loaded.centre, loaded.inertia);
    let setup = suspended(&[], twinrig_legged::Start::default(), 500);
    let setup = Setup {
        base: twinrig_legged::Base::Free,
        ..setup
    };
    let mut fixture = with_options(&loaded.robot, &Options::new(setup, Coordinates::Maximal));
    let turning = Vector3::new(4.0, 7.0, -5.0);
    let velocity = turning.cross(&-centre);
    let state = fixture.plant.state().unwrap();
    let state = state.with("body/velocity", velocity.as_slice());
    let state = state.with("body/angular_velocity", turning.as_slice());
    fixture.plant.resume_from(&state).unwrap();
    let start = Vector3::from_column_slice(&fixture.read("body/position"));
    for _ in 0..200 {
        fixture.advance_us(500);
    }
    let [w, x, y, z] = fixture.read("body/orientation")[..] else {
        panic!("a quaternion")
    };
    let turn = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
    let rate = Vector3::from_column_slice(&fixture.read("body/angular_velocity"));
    let momentum = turn * (inertia * rate);
    let change = (momentum - inertia * turning).norm() / momentum.norm();
    assert!(change < 5e-3, "{change}");
    // The centre of mass, which was at rest, falls 49 mm in 0.1 s.
    let position = Vector3::from_column_slice(&fixture.read("body/position"));
    let moved = position + turn * centre - start - centre;
    let fall = Vector3::z() * (-0.5 * twinrig_robot::GRAVITY * 0.01);
    assert!((moved - fall).norm() < 5e-4, "{moved}");
    let balance = fixture.plant.energy();
    let share = balance.residual.abs() / balance.kinetic;
    assert!(share < 5e-3, "{balance:?}");
}
