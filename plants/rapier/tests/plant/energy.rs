//! Energy: what the books lack falls with the step, and where nothing takes any none is lost.

use twinrig_legged::StartPose;
use twinrig_rapier::Joints;
use twinrig_runtime::Plant;

use crate::scene::{Golden, Scene, hanging, robot, standing};

/// What is missing after 0.2 s, as a share of what was moved.
fn missing(name: &str, joints: Joints, step_us: u64) -> f64 {
    let golden = Golden::read(name);
    let setup = hanging(&["LF"], golden.start(), step_us);
    let mut scene = Scene::of(&golden.robot(), setup, joints);
    scene.run_to_us(200_000);
    let balance = scene.plant.energy();
    balance.residual.abs() / balance.exchanged
}

#[test]
fn what_the_books_lack_falls_with_the_step() {
    for name in ["between", "passive", "hard-hit"] {
        let [coarse, fine] = [2000, 200].map(|step| missing(name, Joints::Impulse, step));
        // Kinetic energy is that of half a step ago: an error of first order.
        assert!(coarse > 3.0 * fine, "{name}: {coarse:e}, then {fine:e}");
        assert!(coarse < 0.1, "{name}: {coarse:e}");
    }
}

#[test]
fn a_leg_without_friction_swings_on() {
    // Off its stops: only springs and gravity are at work, and energy does nothing but swing.
    let mut robot = robot();
    let leg = &mut robot.legs[0].leg;
    (leg.diagonal.preload, leg.parallel.preload) = (-4e-3, -4e-3);
    let friction = &mut leg.joint_friction;
    (friction.hip, friction.knee, friction.ankle) = (0.0, 0.0, 0.0);
    let q = [10.0_f64, -26.0, 44.0].map(f64::to_radians);
    let start = StartPose { q, rates: [0.0; 3] };
    let mut scene = Scene::of(&robot, hanging(&["LF"], start, 500), Joints::Impulse);
    let mut worst = 0.0_f64;
    for k in 1..=100 {
        scene.run_to_us(20_000 * k);
        worst = worst.max(scene.plant.energy().residual.abs());
    }
    let balance = scene.plant.energy();
    assert_eq!(balance.dissipated, 0.0);
    // Measured after 2 s: 0.15 % of 0.17 J; a drift would have made more of it.
    assert!(
        worst < 5e-3 * balance.exchanged,
        "{worst:e} of {}",
        balance.exchanged
    );
}

#[test]
fn a_robot_that_stands_spends_nothing() {
    let mut scene = Scene::of(&robot(), standing(2000), Joints::Impulse);
    scene.run_to_us(1_500_000);
    let before = scene.plant.energy();
    scene.run_to_us(2_000_000);
    let after = scene.plant.energy();
    // Half a joule a second would lift it by 46 mm.
    assert!((after.stored() - before.stored()).abs() < 1e-4);
    assert!((after.impact - before.impact).abs() < 1e-3);
    assert!((after.dissipated - before.dissipated).abs() < 1e-3);
}
