//! Legs without drives, and starts from joint angles and rates.

use twinrig_kernel::Direction;
use twinrig_legged::{Abduction, Base, Contacts, Drives, LeggedError, SetPoint, Setup, StartPose};
use twinrig_massless::{Force, Massless, MasslessError, Options};
use twinrig_robot::Robot;
use twinrig_robot::leg::Pantograph;
use twinrig_runtime::Plant;
use twinrig_testing::plant_harness::at_ms;
use twinrig_testing::robots::robot;

use super::harness::{massless, setup};

/// One leg on a fixed trunk, in the air, without drives.
fn hanging(q: [f64; 3], rates: [f64; 3], step_us: u64) -> Setup {
    Setup {
        base: Base::Fixed,
        legs: vec!["LF".to_owned()],
        ground: None,
        step: twinrig_kernel::SimDuration::from_micros(step_us),
        drives: Drives::None,
        abduction: Abduction::Locked,
        contacts: Contacts::Feet,
        set_point: SetPoint::Held,
        start: StartPose { q, rates }.into(),
    }
}

fn without_friction(mut robot: Robot) -> Robot {
    for mount in &mut robot.legs {
        let friction = &mut mount.leg.joint_friction;
        (friction.hip, friction.knee, friction.ankle) = (0.0, 0.0, 0.0);
    }
    robot
}

#[test]
fn rigid_leg_swings_like_a_pendulum() {
    // Preloaded so that the leg stays extended and closed: a foot on a rod, and the first segment's
    // own inertia.
    let mut robot = without_friction(robot());
    for mount in &mut robot.legs {
        (mount.leg.diagonal.preload, mount.leg.parallel.preload) = (0.05, 0.05);
    }
    let (leg, start) = (&robot.legs[0].leg, 0.02);
    let length = Pantograph::new(leg).unwrap().length_max();
    let inertia = leg.mass.lumped_foot * length * length + leg.mass.l1 * leg.l1 * leg.l1 / 3.0;
    let omega = (leg.mass.lumped_foot * 9.81 * length / inertia).sqrt();
    let mut harness = massless(&robot, &hanging([start, 0.0, 0.0], [0.0; 3], 100));
    let mut worst = 0.0_f64;
    for ms in 1..=1000_u32 {
        harness.advance_to_ms(ms.into());
        let expected = start * libm::cos(omega * f64::from(ms) * 1e-3);
        worst = worst.max((harness.value("leg/LF/hip/position") - expected).abs());
    }
    // A swing of 0.02 rad is slower by 0.02²/16 than a small one, 2.5e-5: 8.1 rad are late by 2e-4.
    // The stops yield by the overlap of a step, which makes the leg swing faster; by 2e-3 at 1 ms,
    // a hundredth of that at 0.1 ms.
    assert!(worst < 5e-4 * start, "{worst:e} rad");
    // The first segment's inertia, a hundredth of the foot's, is resolved.
    let without = (9.81 / length).sqrt();
    assert!((omega / without - 1.0).abs() > 1e-3);
}

#[test]
fn energy_balance_of_a_passive_leg_closes_until_rest() {
    let mut harness = massless(&robot(), &hanging([0.17, -0.16, 0.26], [0.0; 3], 250));
    assert!(harness.commands.is_empty());
    let begun = harness.energy();
    assert_eq!(begun.kinetic, 0.0);
    for ms in 1..=3000 {
        harness.advance_to_ms(ms);
        let angles = harness.read("leg/LF/angles");
        assert!(angles.iter().all(|angle| angle.abs() < 2.0), "{angles:?}");
    }
    let balance = harness.energy();
    assert_eq!(balance.actuator, 0.0);
    assert!(
        balance.residual.abs() < 1e-9 * balance.exchanged,
        "{balance:?}"
    );
    assert!(
        balance.dissipated > 0.0 && balance.kinetic < 1e-3 * balance.dissipated,
        "{balance:?}"
    );
    assert!(harness.value("leg/LF/hip/position").abs() < 0.05);
}

#[test]
fn start_has_the_requested_angles_and_kinetic_energy() {
    let (q, rates) = ([0.3, -0.4, 0.5], [-10.0, 15.0, 30.0]);
    let (robot, setup) = (robot(), hanging(q, rates, 1000));
    let mut harness = massless(&robot, &setup);
    let leg = &robot.legs[0].leg;
    let pantograph = Pantograph::new(leg).unwrap();
    let angles = harness.read("leg/LF/angles");
    let joints = pantograph.joints([angles[0], angles[1], angles[2]]);
    assert!((joints.q2 - q[1]).abs() < 1e-9 && (joints.q3 - q[2]).abs() < 1e-9);
    assert!((harness.value("leg/LF/hip/position") - q[0]).abs() < 1e-12);
    let speed = harness.read("leg/LF/foot/velocity");
    let before = harness.read("leg/LF/foot/position");
    let kinetic = 0.5 * leg.mass.lumped_foot * speed.iter().map(|v| v * v).sum::<f64>()
        + leg.mass.l1 * leg.l1 * leg.l1 / 6.0 * rates[0] * rates[0];
    assert!((harness.energy().kinetic - kinetic).abs() < 1e-12);
    // The velocity is consistent with the motion: a microsecond changes 1 m/s by about a millionth.
    let instant = twinrig_kernel::SimTime::from_nanos(1000);
    harness.plant.advance(instant, &[]).unwrap();
    let after = harness.read("leg/LF/foot/position");
    for i in 0..3 {
        let found = (after[i] - before[i]) / 1e-6;
        assert!((found - speed[i]).abs() < 5e-3, "{found} {}", speed[i]);
    }
}

#[test]
fn ankle_folded_up_beyond_the_second_segment_is_rejected() {
    // The widest opening at a strong bend: between the stops, but the foot position also belongs to
    // another pose.
    let robot = robot();
    let pantograph = Pantograph::new(&robot.legs[0].leg).unwrap();
    let knee = -1.4;
    let widest = 0.98 * pantograph.opening_stop(knee).unwrap().value;
    let options = Options::new(
        hanging([0.0, knee, widest - knee], [0.0; 3], 1000),
        Force::Solve,
    );
    let error = Massless::new(&robot, &options, &|_| true).unwrap_err();
    assert!(
        matches!(&error, MasslessError::Start(why) if why.contains("LF")),
        "{error}"
    );
}

#[test]
fn drives_hold_a_start_given_by_joint_angles() {
    let q = [0.2, -0.5, 0.5];
    let posed = Setup {
        base: Base::Fixed,
        ground: None,
        start: StartPose { q, rates: [0.0; 3] }.into(),
        ..setup()
    };
    let mut harness = massless(&robot(), &posed);
    let first = harness.commands.clone();
    assert_eq!(first.len(), 8);
    assert!(first.chunks(2).all(|pair| pair[0] == q[0] && pair[1] > 0.0));
    let before = harness.read("leg/RH/foot/position");
    harness.advance_to_ms(500);
    let after = harness.read("leg/RH/foot/position");
    let moved = (0..3).map(|i| (after[i] - before[i]).abs());
    assert!(moved.fold(0.0, f64::max) < 1e-4, "{before:?} {after:?}");
}

#[test]
fn plant_without_drives_has_no_inputs_and_no_cable() {
    let options = Options::new(hanging([0.0, -0.8, 0.8], [0.0; 3], 1000), Force::Solve);
    let mut plant = Massless::new(&robot(), &options, &|_| true).unwrap();
    let ports = plant.ports();
    assert!(ports.iter().all(|port| port.direction == Direction::Output));
    assert!(ports.iter().all(|port| !port.name.contains("cable")));
    // A cable that was just taut would hold the knee at its start, while its spring extends it.
    plant.advance(at_ms(500), &[]).unwrap();
    let layout = twinrig_kernel::Layout::of(&ports, Direction::Output);
    let mut outputs = vec![0.0; layout.len()];
    plant.observe(&mut outputs);
    let angles = &outputs[layout.find("leg/LF/angles").unwrap()];
    let pantograph = Pantograph::new(&robot().legs[0].leg).unwrap();
    let joints = pantograph.joints([angles[0], angles[1], angles[2]]);
    assert!(joints.q2.abs() < 1e-3, "{joints:?}");
}

#[test]
fn massless_first_segment_without_drive_is_rejected() {
    let mut robot = robot();
    robot.legs[0].leg.mass.l1 = 0.0;
    let options = |drives| {
        let setup = Setup {
            drives,
            ..hanging([0.0; 3], [0.0; 3], 1000)
        };
        Options::new(setup, Force::Solve)
    };
    let error = Massless::new(&robot, &options(Drives::None), &|_| true).unwrap_err();
    assert!(
        matches!(&error, MasslessError::Setup(LeggedError::Mass { .. })),
        "{error}"
    );
    Massless::new(&robot, &options(setup().drives), &|_| true).unwrap();
}
