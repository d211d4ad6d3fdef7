//! Legs that abduct.

use twinrig_kernel::SimDuration;
use twinrig_legged::{Abduction, Base, Drives, Segment, Setup};
use twinrig_mujoco::{Coordinates, Integrator, Mujoco, MujocoError, Options};
use twinrig_robot::Robot;
use twinrig_runtime::{EnergyBalance, Plant as _};
use twinrig_testing::abduction::{
    JOINT, Tumble, assert_stops_hold, assert_weight_is_borne, axis_of, moment_of_weight, servo,
    without_impacts,
};
use twinrig_testing::robots::{self, LEGS, pose};

use super::fixture::{Fixture, SERVO, hanging, with_options};

/// A robot whose legs abduct, about axes beside and above the hips.
fn robot() -> Robot {
    robots::with_legs(|leg| leg.abduction = Some(JOINT))
}

/// Legs between their stops, without drives.
fn passive(base: Base) -> Setup {
    Setup {
        base,
        abduction: Abduction::Passive,
        ..hanging(pose([10.0, -25.0, 37.0], [0.0; 3]))
    }
}

fn residual(fixture: &Fixture) -> f64 {
    let balance = fixture.energy();
    balance.residual.abs() / balance.exchanged
}

/// The energy is ours, the motion MuJoCo's: a wrong inertia, place or velocity would not be
/// conserved. The residual is that of the method, of order four in minimal coordinates and one in
/// maximal ones.
#[test]
fn energy_of_a_tumbling_robot_is_conserved() {
    let robot = without_impacts();
    for (coordinates, bound) in [(Coordinates::Minimal, 1.2e-9), (Coordinates::Maximal, 5e-3)] {
        for seed in 1..=6 {
            let setup = Setup {
                start: pose([10.0, -26.0, 44.0], [0.0; 3]),
                step: SimDuration::from_micros(100),
                ..passive(Base::Free)
            };
            let mut fixture = with_options(&robot, &Options::new(setup, coordinates));
            let state = fixture.plant.state().unwrap();
            let motion = Tumble::drawn(seed);
            let lines = fixture.plant.resume_from(&motion.of_plant(&state));
            assert_eq!(lines.unwrap(), Vec::<String>::new());
            fixture.advance_us(60_000);
            let balance = fixture.energy();
            assert_eq!(balance.impact, 0.0, "{coordinates:?} {seed}: {balance:?}");
            let residual = residual(&fixture);
            // Measured values times 1.5.
            assert!(residual < bound, "{coordinates:?} {seed}: {residual:e}");
        }
    }
}

/// Returns the balance of a robot in the air whose legs are driven from side to side.
fn swung(drives: Drives, coordinates: Coordinates) -> EnergyBalance {
    let setup = Setup {
        drives,
        abduction: Abduction::Servos(servo(1.0)),
        start: pose([10.0, -26.0, 44.0], [0.0; 3]),
        step: SimDuration::from_micros(100),
        ..passive(Base::Free)
    };
    let mut fixture = with_options(&without_impacts(), &Options::new(setup, coordinates));
    let first = fixture.commands.len() - LEGS.len();
    for ms in 1..=200_u32 {
        let angle = 0.3 * libm::sin(0.03 * f64::from(ms));
        for (command, share) in fixture.commands[first..]
            .iter_mut()
            .zip([1.0, -0.8, 0.6, 0.9])
        {
            *command = share * angle;
        }
        fixture.advance_us(1000);
    }
    fixture.energy()
}

/// Servos of abduction work on the joint, its rotor and nothing else: their work is not that of
/// stops or of the cable, beside which it acts.
#[test]
fn work_of_servos_is_their_own() {
    let servos = Drives::Servos {
        hip: SERVO,
        knee: SERVO,
    };
    for drives in [Drives::None, servos] {
        for coordinates in Coordinates::ALL {
            let balance = swung(drives.clone(), coordinates);
            let most = match coordinates {
                Coordinates::Minimal => 5e-9,
                Coordinates::Maximal => 8e-4,
            };
            // Measured values times 1.6.
            let residual = balance.residual.abs() / balance.exchanged;
            assert!(residual < most, "{coordinates:?}: {residual:e}");
            assert!(balance.actuator > 0.04, "{coordinates:?}: {balance:?}");
            assert!(balance.impact.abs() < 1e-6, "{coordinates:?}: {balance:?}");
        }
    }
}

#[test]
fn servos_bear_the_weight_of_legs_held_aside() {
    let robot = robot();
    for coordinates in Coordinates::ALL {
        let setup = Setup {
            drives: Drives::Servos {
                hip: SERVO,
                knee: SERVO,
            },
            abduction: Abduction::Servos(servo(1.0)),
            ..hanging(pose([10.0, -25.0, 37.0], [0.0; 3]))
        };
        let mut fixture = with_options(&robot, &Options::new(setup, coordinates));
        // The rest of a motion that a lag of 20 ms ends.
        assert_weight_is_borne(&mut fixture, &robot, [1e-4, 2e-4]);
    }
}

/// The sag of a leg on a position actuator is the moment of its weight over the stiffness: that of
/// a servo critically damped at twice the rate of its lag, with the inertia of the stretched leg.
/// The actuators of hip and knee shake the leg, which leaves the means.
#[test]
fn legs_sag_on_position_actuators() {
    let (robot, angle, servo) = (robot(), 0.2, servo(1.0));
    let setup = Setup {
        drives: Drives::Servos {
            hip: SERVO,
            knee: SERVO,
        },
        abduction: Abduction::Servos(servo),
        ..hanging(pose([10.0, -25.0, 37.0], [0.0; 3]))
    };
    let mut options = Options::new(setup, Coordinates::Minimal);
    (options.step_only, options.position_actuators) = (true, true);
    options.numerics.integrator = Integrator::ImplicitFast;
    let mut fixture = with_options(&robot, &options);
    let first = fixture.commands.len() - LEGS.len();
    fixture.commands[first..].fill(angle);
    fixture.advance_us(1_000_000);
    let mut sums = [[0.0; 2]; LEGS.len()];
    for _ in 0..1000 {
        fixture.advance_us(2000);
        let state = fixture.plant.state().unwrap();
        for (mount, [sags, moments]) in robot.legs.iter().zip(&mut sums) {
            let of_leg = |name: &str| state.get(&format!("leg/{}/{name}", mount.name)).unwrap();
            let [found, _] = of_leg("abduction") else {
                panic!("{state:?}");
            };
            *sags += angle - found;
            *moments += moment_of_weight(mount, *found, of_leg("angles"));
        }
    }
    for (mount, [sag, moment]) in robot.legs.iter().zip(sums) {
        let axis = [axis_of(mount), mount.hip[2] + JOINT.height];
        let (mut inertia, mut length) = (servo.inertia, mount.hip[2]);
        for segment in Segment::of(&mount.leg) {
            let (y, z) = (mount.hip[1] - axis[0], length - segment.centre - axis[1]);
            inertia += segment.moment + segment.mass * (y * y + z * z);
            length -= segment.length;
        }
        let stiffness = inertia * (2.0 / servo.lag) * (2.0 / servo.lag);
        let share = sag * stiffness / moment;
        assert!((share - 1.0).abs() < 0.02, "{}: {share}", mount.name);
    }
}

/// A servo has less torque the faster it turns: a weak one that jumps follows its line.
#[test]
fn torque_of_servos_falls_with_their_speed() {
    let weak = servo(0.05);
    for coordinates in Coordinates::ALL {
        let setup = Setup {
            abduction: Abduction::Servos(weak),
            step: SimDuration::from_micros(200),
            ..passive(Base::Fixed)
        };
        let mut fixture = with_options(&robot(), &Options::new(setup, coordinates));
        fixture.commands.copy_from_slice(&[0.5, -0.5, 0.5, -0.5]);
        let mut fastest = 0.0_f64;
        for _ in 0..250 {
            fixture.advance_us(200);
            let torque = fixture.value("leg/LF/abduction/torque");
            let state = fixture.plant.state().unwrap();
            let rate = state.get("leg/LF/abduction").unwrap()[1];
            let most = weak.torque * (1.0 - rate / weak.speed);
            // The rate changes by less than 5 % of the speed in a step.
            assert!(
                torque < most + 0.05 * weak.torque,
                "{coordinates:?}: {torque} N·m, {rate} rad/s"
            );
            fastest = fastest.max(rate);
        }
        assert!(fastest > 0.25 * weak.speed, "{coordinates:?}: {fastest}");
    }
}

/// A stop ends the swing of a leg that a weak servo drives against it.
#[test]
fn legs_do_not_pass_their_stops() {
    for coordinates in Coordinates::ALL {
        let setup = Setup {
            abduction: Abduction::Servos(servo(0.5)),
            ..passive(Base::Fixed)
        };
        let mut fixture = with_options(&robot(), &Options::new(setup, coordinates));
        assert_stops_hold(&mut fixture, 5e-3);
    }
}

/// Snapshots restore the joints bit for bit, and states of the other coordinates to rounding.
#[test]
fn joints_are_saved_and_resumed() {
    let setup = || Setup {
        abduction: Abduction::Servos(servo(0.5)),
        ..passive(Base::Free)
    };
    let create = |coordinates| with_options(&robot(), &Options::new(setup(), coordinates));
    let mut from = create(Coordinates::Minimal);
    from.commands.copy_from_slice(&[0.2, -0.1, 0.1, -0.2]);
    from.advance_us(40_000);
    let (saved, state) = (from.plant.save(), from.plant.state().unwrap());
    from.advance_us(60_000);
    let expected = from.observe().to_vec();
    from.plant.restore(&saved).unwrap();
    from.now_us = 40_000;
    from.advance_us(60_000);
    assert_eq!(from.observe(), expected);

    let mut to = create(Coordinates::Maximal);
    assert_eq!(to.plant.resume_from(&state).unwrap(), Vec::<String>::new());
    let resumed = to.plant.state().unwrap();
    for leg in LEGS {
        let name = format!("leg/{leg}/abduction");
        let (found, expected) = (resumed.get(&name).unwrap(), state.get(&name).unwrap());
        for (found, expected) in found.iter().zip(expected) {
            assert!(
                (found - expected).abs() < 1e-12,
                "{leg}: {found} {expected}"
            );
        }
        assert!(expected[0].abs() > 1e-2, "{leg}: {expected:?}");
    }
    // The way of a point at the length of the first segment from the axis.
    let pressed = state
        .clone()
        .with("leg/LF/abduction", &[JOINT.abduction_max + 0.1, 0.0]);
    to.plant.resume_from(&pressed).unwrap();
    let way = 0.1 * robot().legs[0].leg.l1;
    let violation = to.plant.constraint_violation().unwrap();
    assert!((violation - way).abs() < 1e-12, "{violation} {way}");

    let upright = state.only(|name| !name.ends_with("/abduction"));
    let lines = to.plant.resume_from(&upright).unwrap();
    assert_eq!(lines.len(), LEGS.len(), "{lines:?}");
    assert!(
        lines[0].contains("leg/LF/abduction is missing"),
        "{lines:?}"
    );
}

#[test]
fn robots_without_the_joint_are_refused() {
    let options = Options::new(passive(Base::Free), Coordinates::Minimal);
    let refused = Mujoco::new(&robots::robot(), &options, &|_| true).map(|_| ());
    let error: MujocoError = refused.unwrap_err();
    let text = error.to_string();
    assert!(text.contains("leg LF has no joint of abduction"), "{text}");
}
