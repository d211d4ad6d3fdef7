//! A plant that diverges stops, and says what broke.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_legged::StartPose;
use twinrig_rapier::{Joints, Options, Solver};
use twinrig_runtime::{Plant, PlantFault};

use crate::scene::{Golden, Scene, hanging, robot, standing};

/// Runs for half a second; the fault, if there is one.
fn fault(scene: &mut Scene) -> Option<PlantFault> {
    let end = SimTime::ZERO + SimDuration::from_millis(500);
    scene.plant.advance(end, &scene.commands).err()
}

/// A leg at its stops, hard springs, and rates of some ten rad/s.
fn swinging(step_us: u64) -> Scene {
    let golden = Golden::read("hard-hit");
    let setup = hanging(&["LF"], golden.start(), step_us);
    Scene::of(&golden.robot(), setup, Joints::Impulse)
}

#[test]
fn steps_that_are_much_too_long_stop_the_plant() {
    for step_us in [50_000, 100_000] {
        let fault = fault(&mut swinging(step_us));
        let fault = fault.unwrap_or_else(|| panic!("{step_us} µs went through"));
        assert!(
            fault.energy.is_finite() && fault.energy.abs() < 100.0,
            "{fault}"
        );
        assert!(fault.why.contains("shorten the step"), "{fault}");
        assert!(
            fault.part == "energy" || fault.part.starts_with("leg/"),
            "{fault}"
        );
    }
}

#[test]
fn whatever_the_step_a_plant_stops_or_is_what_it_can_be() {
    let robot = robot();
    let reach = 0.5;
    for step_us in [2_000, 5_000, 10_000, 20_000, 50_000, 100_000] {
        for joints in Joints::ALL {
            let mut scene = Scene::of(&robot, standing(step_us), joints);
            let fault = fault(&mut scene);
            if fault.is_some() {
                assert!(step_us > 2_000, "{joints:?}: {fault:?}");
                continue;
            }
            let balance = scene.plant.energy();
            // 1.1 kg from a height of 0.2 m: 2.2 J, and springs of the same order.
            assert!(
                balance.stored().abs() < 10.0 && balance.residual < 10.0,
                "{step_us}, {joints:?}: {balance:?}"
            );
            let [body, foot] =
                ["body/position", "leg/LF/foot/position"].map(|name| scene.read(name));
            let apart: f64 = body.iter().zip(&foot).map(|(a, b)| (a - b) * (a - b)).sum();
            assert!(apart.sqrt() < reach, "{step_us}, {joints:?}: {apart}");
        }
    }
}

#[test]
fn joints_of_a_tree_with_the_engines_own_settings_stop_or_stay_numbers() {
    for name in ["hard-hit", "undamped", "passive"] {
        for step_us in [500, 2000] {
            let golden = Golden::read(name);
            let options = Options {
                solver: Solver::of_the_engine(),
                ..Options::new(hanging(&["LF"], golden.start(), step_us), Joints::Multibody)
            };
            let mut scene = Scene::new(&golden.robot(), &options);
            let fault = fault(&mut scene);
            let energy = scene.plant.energy();
            assert!(
                fault.is_some() || energy.stored().abs() < 10.0,
                "{name}: {energy:?}"
            );
        }
    }
}

#[test]
fn a_leg_that_turns_faster_than_steps_can_tell_is_a_fault_at_once() {
    let start = StartPose {
        q: [0.0, -0.3, 0.3],
        rates: [3000.0, 0.0, 0.0],
    };
    let options = Options::new(hanging(&["LF"], start, 1000), Joints::Impulse);
    let mut scene = Scene::new(&robot(), &options);
    let fault = fault(&mut scene).unwrap();
    assert_eq!((fault.part.as_str(), fault.time), ("leg/LF", SimTime::ZERO));
    assert!(fault.why.contains("rad/s"), "{fault}");
}
