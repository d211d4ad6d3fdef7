//! Explicit Euler at a fixed step.

use twinrig_legged::{Abduction, Base, Contacts, Drives, SetPoint, Setup, StartPose};
use twinrig_massless::{Force, Massless, Method, Options};
use twinrig_robot::Robot;
use twinrig_runtime::Plant;
use twinrig_testing::robots::robot;

use super::harness::{Harness, setup};

/// Cheetah-cub with springs that hold a foot in the air between the stops, and a multiple of the
/// friction of its joints.
fn hanging(friction: f64) -> Robot {
    let mut robot = robot();
    for mount in &mut robot.legs {
        let leg = &mut mount.leg;
        (leg.diagonal.preload, leg.parallel.preload) = (-0.004, -0.004);
        let joints = &mut leg.joint_friction;
        (joints.knee, joints.ankle) = (friction * joints.knee, friction * joints.ankle);
    }
    robot
}

/// One leg after 50 ms at a step \[µs\], its hip held, released beside its rest.
fn swung(robot: &Robot, method: Method, step_us: u64) -> Harness {
    let q = [0.0, -0.25, 0.3];
    let setup = Setup {
        base: Base::Fixed,
        legs: vec!["LF".to_owned()],
        ground: None,
        step: twinrig_kernel::SimDuration::from_micros(step_us),
        drives: Drives::Ideal { period: 5e-3 },
        abduction: Abduction::Locked,
        contacts: Contacts::Feet,
        set_point: SetPoint::Held,
        start: StartPose { q, rates: [0.0; 3] }.into(),
    };
    let options = Options {
        method,
        ..Options::new(setup, Force::Solve)
    };
    let mut harness = Harness::new(Massless::new(robot, &options, &|_| true).unwrap());
    harness.advance_to_ms(50);
    harness
}

#[test]
fn error_is_of_first_order() {
    let robot = hanging(1.0);
    let foot = |method, step_us| swung(&robot, method, step_us).read("leg/LF/foot/position");
    let exact = foot(Method::Midpoint, 10);
    let error = |step_us| {
        let found = foot(Method::ExplicitEuler, step_us);
        let squares = found.iter().zip(&exact).map(|(a, b)| (a - b) * (a - b));
        squares.sum::<f64>().sqrt()
    };
    let (coarse, fine) = (error(20), error(10));
    assert!((1.8..2.2).contains(&(coarse / fine)), "{coarse:e} {fine:e}");
}

#[test]
fn undamped_leg_gains_energy_at_every_step() {
    let robot = hanging(0.0);
    let gained = |step_us| {
        let energy = swung(&robot, Method::ExplicitEuler, step_us).energy();
        assert_eq!(energy.dissipated, 0.0);
        energy.residual / energy.exchanged
    };
    let (coarse, fine) = (gained(20), gained(10));
    assert!(
        fine > 0.0 && (1.8..2.4).contains(&(coarse / fine)),
        "{coarse:e} {fine:e}"
    );
    let midpoint = swung(&robot, Method::Midpoint, 20).energy();
    assert!(midpoint.residual.abs() < 1e-6 * midpoint.exchanged);
}

#[test]
fn unstable_step_ends_in_a_fault_and_is_never_divided() {
    let robot = hanging(0.0);
    let leg = Setup {
        base: Base::Fixed,
        ground: None,
        step: twinrig_kernel::SimDuration::from_millis(5),
        ..setup()
    };
    let options = Options {
        method: Method::ExplicitEuler,
        ..Options::new(leg, Force::LinearLookup { cells: 32 })
    };
    let mut plant = Massless::new(&robot, &options, &|_| true).unwrap();
    let mut steps = 0;
    let end = (1..400).find(|tick| {
        let to = twinrig_testing::plant_harness::at_ms(5 * tick);
        let advanced = plant.advance(to, &[0.0; 8]);
        steps += u64::from(advanced.is_ok());
        advanced.is_err()
    });
    let work = plant.work();
    assert_eq!((work.fallbacks, work.steps), (0, 4 * steps), "{end:?}");
    assert!(end.is_some(), "it stays bounded");
}
