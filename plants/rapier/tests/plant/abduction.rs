//! Legs that abduct.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_legged::{Abduction, Base, Push, PushShape, PushTarget, Setup};
use twinrig_rapier::{Joints, Options, Rapier, RapierError};
use twinrig_robot::Robot;
use twinrig_runtime::Plant as _;
use twinrig_testing::abduction::{
    JOINT, Tumble, assert_stops_hold, assert_weight_is_borne, servo, without_impacts,
};
use twinrig_testing::robots::{self, LEGS, SERVOS, pose, suspended};

use crate::fixture::{Fixture, with_joints};

/// A robot whose legs abduct, about axes beside the hips, at their height.
fn robot() -> Robot {
    level(robots::with_legs(|leg| leg.abduction = Some(JOINT)))
}

fn level(mut robot: Robot) -> Robot {
    for joint in robot
        .legs
        .iter_mut()
        .filter_map(|mount| mount.leg.abduction.as_mut())
    {
        joint.height = 0.0;
    }
    robot
}

/// Legs between their stops, without drives at hip and knee.
fn hanging(base: Base, abduction: Abduction) -> Setup {
    Setup {
        base,
        abduction,
        ..suspended(&LEGS, pose([10.0, -25.0, 37.0], [0.0; 3]), 2000)
    }
}

fn create(robot: &Robot, setup: Setup) -> Fixture {
    with_joints(robot, setup, Joints::Impulse)
}

/// Work and energy are ours, the motion the engine's. The residual is that of the method, whose
/// velocities are half a step old: of order one.
#[test]
fn energy_of_a_tumbling_robot_is_conserved() {
    let robot = level(without_impacts());
    let residual = |seed: u64, step_us: u64| {
        let setup = Setup {
            start: pose([10.0, -26.0, 44.0], [0.0; 3]),
            step: SimDuration::from_micros(step_us),
            ..hanging(Base::Free, Abduction::Passive)
        };
        let mut fixture = create(&robot, setup);
        let state = fixture.plant.state().unwrap();
        let motion = Tumble::drawn(seed).of_plant(&state);
        let lines = fixture.plant.resume_from(&motion).unwrap();
        assert_eq!(lines, Vec::<String>::new());
        fixture.advance_us(60_000);
        let balance = fixture.energy();
        balance.residual.abs() / balance.exchanged
    };
    for seed in 1..=6 {
        let [coarse, fine] = [400, 100].map(|step_us| residual(seed, step_us));
        // Measured values times 1.5, and 4.00 to 4.01.
        assert!(fine < 2.5e-3, "{seed}: {fine:e}");
        assert!(
            (coarse / fine - 4.0).abs() < 0.1,
            "{seed}: {coarse:e} {fine:e}"
        );
    }
}

#[test]
fn servos_bear_the_weight_of_legs_held_aside() {
    let robot = robot();
    let setup = Setup {
        drives: SERVOS,
        ..hanging(Base::Fixed, Abduction::Servos(servo(1.0)))
    };
    assert_weight_is_borne(&mut create(&robot, setup), &robot, [1e-3, 2e-3]);
}

/// A stop ends the swing of a leg that a weak servo drives against it.
#[test]
fn legs_do_not_pass_their_stops() {
    let setup = hanging(Base::Fixed, Abduction::Servos(servo(0.5)));
    assert_stops_hold(&mut create(&robot(), setup), 5e-3);
}

/// Snapshots restore the joints bit for bit; a state of the plant has them.
#[test]
fn joints_are_saved_and_resumed() {
    let create = || create(&robot(), hanging(Base::Free, Abduction::Servos(servo(0.5))));
    let mut from = create();
    from.commands.copy_from_slice(&[0.2, -0.1, 0.1, -0.2]);
    from.advance_us(40_000);
    let (saved, state) = (from.plant.save(), from.plant.state().unwrap());
    from.advance_us(60_000);
    let expected = from.observe().to_vec();
    let mut to = create();
    to.plant.restore(&saved).unwrap();
    to.commands.copy_from_slice(&from.commands);
    to.now_us = 40_000;
    to.advance_us(60_000);
    assert_eq!(to.observe(), expected);

    assert_eq!(to.plant.resume_from(&state).unwrap(), Vec::<String>::new());
    let resumed = to.plant.state().unwrap();
    for leg in LEGS {
        let name = format!("leg/{leg}/abduction");
        let joints = [&resumed, &state].map(|state| state.get(&name).unwrap().to_vec());
        assert_eq!(joints[0], joints[1], "{leg}");
        assert!(joints[0][0].abs() > 1e-2, "{leg}: {joints:?}");
    }
    let upright = state.only(|name| !name.ends_with("/abduction"));
    let lines = to.plant.resume_from(&upright).unwrap();
    assert_eq!(lines.len(), LEGS.len(), "{lines:?}");
}

/// A push turns a robot in the air whose hinges hold as one whose joints are locked: carriers
/// change neither its mass nor its inertia.
#[test]
fn robot_with_carriers_has_the_inertia_of_one_without() {
    let push = Push {
        name: "shove".to_owned(),
        target: PushTarget::Trunk([0.05, 0.03, 0.02]),
        at: SimTime::ZERO,
        duration: SimDuration::from_millis(10),
        shape: PushShape::Rectangle,
        peak: [3.0, 6.0, -3.0],
    };
    let turned = |abduction: Abduction| {
        let setup = Setup {
            step: SimDuration::from_micros(200),
            ..hanging(Base::Free, abduction)
        };
        let options = Options::new(setup, Joints::Impulse);
        let plant = Rapier::new(&robot(), &options, &|_| true).unwrap();
        let mut fixture = Fixture::new(
            plant
                .with_pushes(std::slice::from_ref(&push), &|_| true)
                .unwrap(),
        );
        fixture.advance_us(10_000);
        ["body/velocity", "body/angular_velocity"].map(|signal| fixture.read(signal))
    };
    let free = turned(Abduction::Servos(servo(1.0)));
    let locked = turned(Abduction::Locked);
    for (free, locked) in free.iter().zip(&locked) {
        let size = locked
            .iter()
            .fold(0.0, |size: f64, rate| size.max(rate.abs()));
        assert!(size > 1e-2, "{locked:?}");
        for (a, b) in free.iter().zip(locked) {
            assert!((a - b).abs() < 0.01 * size, "{free:?} {locked:?}");
        }
    }
}

#[test]
fn what_cannot_abduct_is_refused() {
    let setup = || hanging(Base::Free, Abduction::Passive);
    let refused = |robot: &Robot, options: &Options| {
        let refused = Rapier::new(robot, options, &|_| true).map(|_| ());
        refused.unwrap_err()
    };
    let multibody = Options::new(setup(), Joints::Multibody);
    assert_eq!(refused(&robot(), &multibody), RapierError::Abduction);
    let alone = Options {
        step_only: true,
        ..Options::new(setup(), Joints::Impulse)
    };
    assert_eq!(refused(&robot(), &alone), RapierError::Abduction);
    let options = Options::new(setup(), Joints::Impulse);
    let above = robots::with_legs(|leg| leg.abduction = Some(JOINT));
    assert_eq!(refused(&above, &options), RapierError::Balance);
    let mut three = options.clone();
    three.setup.legs.pop();
    assert_eq!(refused(&robot(), &three), RapierError::Balance);
    let text = refused(&robots::robot(), &options).to_string();
    assert!(text.contains("leg LF has no joint of abduction"), "{text}");
}
