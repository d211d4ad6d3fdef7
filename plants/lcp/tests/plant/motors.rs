//! Motors that are given voltages, by every method: the torque of the closed form, books that close, and what every drive must
//! keep to.

use std::path::Path;

use twinrig_actuator::DcMotor;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_lcp::{LcpError, Method};
use twinrig_legged::{Base, Drives, Setup};
use twinrig_robot::{Robot, RobotFile};
use twinrig_runtime::Plant;

use crate::scene::{DEFAULT, Scene, Way, built, hanging, pose, standing};

/// Every method that has motors, at a step that takes their 1.66 ms in.
const WAYS: [Way; 5] = [
    DEFAULT,
    Way::by(Method::Rodas4, 2000),
    Way::by(Method::Moreau, 1000),
    Way::by(Method::SemiImplicit, 200),
    Way::by(Method::ExplicitEuler, 20),
];

/// A robot that has motors.
fn oncilla() -> Robot {
    let beside = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let file = RobotFile::find("oncilla", beside).unwrap();
    file.robot().unwrap()
}

/// The same setup with the robot's motors for drives.
fn motorised(robot: &Robot, setup: Setup) -> Setup {
    let motors = robot.motors.unwrap();
    let drives = Drives::Motors {
        hip: motors.hip,
        knee: motors.knee,
    };
    Setup { drives, ..setup }
}

/// The fore left leg of a trunk that is held.
fn one_leg(robot: &Robot) -> Setup {
    let setup = hanging(twinrig_legged::Start::default());
    let legs = vec!["LF".to_owned()];
    motorised(robot, Setup { legs, ..setup })
}

/// Positions of hip and pulley of each leg.
fn positions(scene: &mut Scene, setup: &Setup) -> Vec<f64> {
    let mut positions = Vec::new();
    for leg in &setup.legs {
        for joint in ["hip", "knee"] {
            positions.push(scene.value(&format!("leg/{leg}/{joint}/position")));
        }
    }
    positions
}

/// A controller of positions, once a millisecond: 40 V for a radian. What damps the motor is damping enough.
struct Loop {
    setup: Setup,
    home: Vec<f64>,
}

impl Loop {
    fn new(scene: &mut Scene, setup: &Setup) -> Self {
        Self {
            setup: setup.clone(),
            home: positions(scene, setup),
        }
    }

    /// What the drives are given at `ms`: legs sway and bend from where they start, as far as springs and cables let them.
    fn command(&self, scene: &mut Scene, ms: u64) {
        let phase = core::f64::consts::TAU * ms as f64 * 1e-3;
        let (sway, bend) = (0.1 * libm::sin(phase), 0.25 * (1.0 - libm::cos(phase)));
        let positions = positions(scene, &self.setup);
        let pairs = positions.iter().zip(&self.home).enumerate();
        let inputs = pairs.flat_map(|(i, (position, home))| {
            let wanted = home + [sway, bend][i % 2];
            [40.0 * (wanted - position), 1.0]
        });
        scene.commands = inputs.collect();
    }

    fn run(&self, scene: &mut Scene, from_ms: u64, to_ms: u64) {
        for ms in from_ms..to_ms {
            self.command(scene, ms);
            scene.to_ms(ms + 1);
        }
    }
}

#[test]
fn a_pulley_that_unwinds_runs_like_the_motor_alone() {
    let robot = oncilla();
    let motor = DcMotor::new(&robot.motors.unwrap().knee).unwrap();
    let (last, tau) = (-0.5 * motor.no_load_rate(), motor.time_constant());
    let risen = -libm::expm1(-4e-3 / tau);
    let turned = last * (4e-3 - tau * risen);
    // Shares of rate and way: the methods' orders are 4, 4, 2, 1 and 1.
    let bounds = [3e-5, 1e-5, 1e-2, 0.1, 3e-3];
    for (way, bound) in WAYS.into_iter().zip(bounds) {
        let mut scene = Scene::new(&robot, &one_leg(&robot), way);
        let start = scene.value("leg/LF/knee/position");
        scene.commands.copy_from_slice(&[0.0, 1.0, -12.0, 1.0]);
        scene.to_ms(4);
        let rate = scene.value("leg/LF/knee/rate") / (last * risen) - 1.0;
        let way_there = (scene.value("leg/LF/knee/position") - start) / turned - 1.0;
        assert!(
            rate.abs() < bound && way_there.abs() < bound,
            "{way:?}: {rate} {way_there}"
        );
    }
}

#[test]
fn a_leg_in_the_air_goes_one_way_by_every_method() {
    let robot = oncilla();
    let setup = one_leg(&robot);
    let run = |way: Way| {
        let mut scene = Scene::new(&robot, &setup, way);
        let control = Loop::new(&mut scene, &setup);
        let mut track = Vec::new();
        for ms in 0..300 {
            control.run(&mut scene, ms, ms + 1);
            track.push(positions(&mut scene, &setup));
        }
        track
    };
    let exact = run(Way::by(Method::Rodas4, 100).within(1e-9));
    // Events that are found to the instant leave the methods' own error; the others find a cable taut up to a step too late.
    let bounds = [1e-6, 1e-6, 3e-3, 3e-3, 5e-4];
    for (way, bound) in WAYS.into_iter().zip(bounds) {
        let track = run(way);
        let pairs = track.iter().flatten().zip(exact.iter().flatten());
        let worst = pairs.fold(0.0_f64, |worst, (a, b)| worst.max((a - b).abs()));
        assert!(worst < bound, "{way:?}: {worst}");
    }
}

#[test]
fn the_torque_of_a_step_is_that_of_its_mean_rate() {
    let robot = oncilla();
    let motor = DcMotor::new(&robot.motors.unwrap().hip).unwrap();
    // Moreau's rule and explicit steps have no other; the rest differ by the error of their steps.
    for (way, bound) in WAYS.into_iter().zip([0.02, 0.05, 1e-12, 0.03, 1e-12]) {
        let mut scene = Scene::new(&robot, &one_leg(&robot), way);
        let mut from_us = 0;
        for (voltage, bridge) in [(9.0, 1.0), (-70.0, 1.0), (5.0, 0.0), (0.0, 1.0)] {
            scene.commands = vec![voltage, bridge, 0.0, 0.0];
            for _ in 0..4 {
                let before = scene.value("leg/LF/hip/position");
                from_us += way.step_us;
                scene.try_to_us(from_us).unwrap();
                let turned = scene.value("leg/LF/hip/position") - before;
                let torque = scene.value("leg/LF/hip/torque");
                let line = motor.torque(voltage, bridge, turned / (way.step_us as f64 * 1e-6));
                let off = (torque - line).abs() / motor.stall_torque();
                assert!(off < bound, "{way:?}: {torque} {line}");
            }
        }
    }
}

#[test]
fn motors_that_brake_within_a_millionth_of_a_step_hold_their_legs() {
    let mut robot = oncilla();
    let motors = robot.motors.as_mut().unwrap();
    (motors.hip.resistance, motors.knee.resistance) = (1e-4, 1e-4);
    let start = hanging(pose([30.0, -35.0, 35.0], [0.0; 3]));
    let legs = vec!["LF".to_owned()];
    let setup = motorised(&robot, Setup { legs, ..start });
    for way in &WAYS[..3] {
        let mut scene = Scene::new(&robot, &setup, *way);
        let before = scene.value("leg/LF/hip/position");
        scene.commands.copy_from_slice(&[0.0, 1.0, 0.0, 1.0]);
        scene.to_ms(100);
        // A leg weighs some hundredths of a newton metre at its hip, over (k N)²/R = 387 N·m·s/rad.
        let turned = scene.value("leg/LF/hip/position") - before;
        assert!(turned.abs() < 2e-4, "{way:?}: {turned}");
        assert!(scene.value("leg/LF/hip/torque").abs() > 0.01, "{way:?}");
    }
}

#[test]
fn books_close_under_motors_on_every_base() {
    let robot = oncilla();
    for base in [Base::Free, Base::Planar, Base::Fixed] {
        let setup = motorised(&robot, Setup { base, ..standing() });
        for (way, share) in WAYS.into_iter().take(4).zip([1e-4, 2e-4, 2e-4, 2e-4]) {
            let mut scene = Scene::new(&robot, &setup, way);
            let control = Loop::new(&mut scene, &setup);
            control.run(&mut scene, 0, 500);
            let balance = scene.energy();
            let missing = balance.residual.abs() / balance.exchanged;
            assert!(missing < share, "{base:?} {way:?}: {missing} {balance:?}");
            assert!(balance.exchanged > 0.5, "{base:?} {way:?}: {balance:?}");
        }
    }
}

#[test]
fn the_thesis_has_no_motors_and_says_so() {
    let robot = oncilla();
    let way = Way::by(Method::Thesis, 20);
    let error = built(&robot, &one_leg(&robot), way).err().unwrap();
    assert_eq!(error, LcpError::Motors);
    assert!(built(&robot, &standing(), way).is_ok());
}

#[test]
fn motors_start_coasting_and_give_no_work_until_a_bridge_closes() {
    let robot = oncilla();
    let setup = motorised(&robot, standing());
    for way in &WAYS[..4] {
        let mut scene = Scene::new(&robot, &setup, *way);
        assert!(scene.commands.iter().all(|input| *input == 0.0));
        scene.to_ms(100);
        assert!(scene.energy().actuator.abs() < 1e-12, "{way:?}");
        assert!(scene.value("leg/LF/hip/rate").abs() > 1e-3, "{way:?}");
    }
}

#[test]
fn a_plant_with_motors_is_restored_bit_for_bit() {
    let robot = oncilla();
    let setup = motorised(&robot, standing());
    for way in WAYS {
        let mut scene = Scene::new(&robot, &setup, way);
        let control = Loop::new(&mut scene, &setup);
        control.run(&mut scene, 0, 37);
        let (saved, mut other) = (scene.plant.save(), Scene::new(&robot, &setup, way));
        other.plant.restore(&saved).unwrap();
        for scene in [&mut scene, &mut other] {
            control.run(scene, 37, 60);
        }
        assert_eq!(scene.plant.save().0, other.plant.save().0, "{way:?}");
    }
}

#[test]
fn steps_under_motors_ask_for_no_memory() {
    let robot = oncilla();
    let setup = motorised(&robot, standing());
    for way in [DEFAULT, Way::by(Method::Moreau, 1000)] {
        let mut scene = Scene::new(&robot, &setup, way);
        let control = Loop::new(&mut scene, &setup);
        control.run(&mut scene, 0, 1000);
        let mut outputs = scene.observe().to_vec();
        let inputs = scene.commands.clone();
        let counted = allocation_counter::measure(|| {
            for ms in 1001..1050 {
                let at = SimTime::ZERO + SimDuration::from_millis(ms);
                scene.plant.advance(at, &inputs).unwrap();
                scene.plant.observe(&mut outputs);
            }
        });
        assert_eq!(counted.count_total, 0, "{way:?}");
    }
}
