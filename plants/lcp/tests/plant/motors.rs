//! Motors with voltage inputs, by every method: closed-form torque, energy balance, and
//! requirements on all drives.

use std::path::Path;

use twinrig_actuator::DcMotor;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_lcp::{LcpError, Method};
use twinrig_legged::{Base, Drives, Setup};
use twinrig_robot::{Robot, RobotFile};
use twinrig_runtime::Plant;
use twinrig_testing::robots::pose;

use crate::harness::{DEFAULT, Harness, Integration, build, lcp, standing_setup, suspended};

/// Every method that supports motors, at a step that resolves their time constant of 1.66 ms.
const INTEGRATIONS: [Integration; 5] = [
    DEFAULT,
    Integration::new(Method::Rodas4, 2000),
    Integration::new(Method::Moreau, 1000),
    Integration::new(Method::SemiImplicit, 200),
    Integration::new(Method::ExplicitEuler, 20),
];

/// Returns a robot with motors.
fn oncilla() -> Robot {
    let workspace = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let file = RobotFile::find("oncilla", workspace).unwrap();
    file.robot().unwrap()
}

/// Returns the setup with the robot's motors as drives.
fn motorised(robot: &Robot, setup: Setup) -> Setup {
    let motors = robot.motors.unwrap();
    let drives = Drives::Motors {
        hip: motors.hip,
        knee: motors.knee,
    };
    Setup { drives, ..setup }
}

/// Returns a setup of the left fore leg on a fixed trunk.
fn one_leg(robot: &Robot) -> Setup {
    let setup = suspended(twinrig_legged::Start::default());
    let legs = vec!["LF".to_owned()];
    motorised(robot, Setup { legs, ..setup })
}

/// Returns the positions of hip and pulley of each leg.
fn positions(harness: &mut Harness, setup: &Setup) -> Vec<f64> {
    let mut positions = Vec::new();
    for leg in &setup.legs {
        for joint in ["hip", "knee"] {
            positions.push(harness.value(&format!("leg/{leg}/{joint}/position")));
        }
    }
    positions
}

/// Position controller at 1 kHz with a gain of 40 V/rad; the back-EMF of the motors provides the
/// damping.
struct PositionLoop {
    setup: Setup,
    home: Vec<f64>,
}

impl PositionLoop {
    fn new(harness: &mut Harness, setup: &Setup) -> Self {
        Self {
            setup: setup.clone(),
            home: positions(harness, setup),
        }
    }

    /// Sets the inputs at `ms`: legs sway and bend about their start, as far as springs and cables
    /// permit.
    fn command(&self, harness: &mut Harness, ms: u64) {
        let phase = core::f64::consts::TAU * ms as f64 * 1e-3;
        let (sway, bend) = (0.1 * libm::sin(phase), 0.25 * (1.0 - libm::cos(phase)));
        let positions = positions(harness, &self.setup);
        let pairs = positions.iter().zip(&self.home).enumerate();
        let inputs = pairs.flat_map(|(i, (position, home))| {
            let target = home + [sway, bend][i % 2];
            [40.0 * (target - position), 1.0]
        });
        harness.commands = inputs.collect();
    }

    fn run(&self, harness: &mut Harness, from_ms: u64, advance_to_ms: u64) {
        for ms in from_ms..advance_to_ms {
            self.command(harness, ms);
            harness.advance_to_ms(ms + 1);
        }
    }
}

#[test]
fn unwinding_pulley_follows_closed_form_of_motor() {
    let robot = oncilla();
    let motor = DcMotor::new(&robot.motors.unwrap().knee).unwrap();
    let (final_rate, tau) = (-0.5 * motor.no_load_rate(), motor.time_constant());
    let rise = -libm::expm1(-4e-3 / tau);
    let rotation = final_rate * (4e-3 - tau * rise);
    // Relative errors of rate and angle: the orders of the methods are 4, 4, 2, 1 and 1.
    let bounds = [3e-5, 1e-5, 1e-2, 0.1, 3e-3];
    for (integration, bound) in INTEGRATIONS.into_iter().zip(bounds) {
        let mut harness = lcp(&robot, &one_leg(&robot), integration);
        let start = harness.value("leg/LF/knee/position");
        harness.commands.copy_from_slice(&[0.0, 1.0, -12.0, 1.0]);
        harness.advance_to_ms(4);
        let rate = harness.value("leg/LF/knee/rate") / (final_rate * rise) - 1.0;
        let angle = (harness.value("leg/LF/knee/position") - start) / rotation - 1.0;
        assert!(
            rate.abs() < bound && angle.abs() < bound,
            "{integration:?}: {rate} {angle}"
        );
    }
}

#[test]
fn all_methods_agree_on_leg_in_the_air() {
    let robot = oncilla();
    let setup = one_leg(&robot);
    let run = |integration: Integration| {
        let mut harness = lcp(&robot, &setup, integration);
        let control = PositionLoop::new(&mut harness, &setup);
        let mut track = Vec::new();
        for ms in 0..300 {
            control.run(&mut harness, ms, ms + 1);
            track.push(positions(&mut harness, &setup));
        }
        track
    };
    let exact = run(Integration::new(Method::Rodas4, 100).with_tolerance(1e-9));
    // With event location only the error of the method remains; the other methods detect a taut
    // cable up to a step late.
    let bounds = [1e-6, 1e-6, 3e-3, 3e-3, 5e-4];
    for (integration, bound) in INTEGRATIONS.into_iter().zip(bounds) {
        let track = run(integration);
        let pairs = track.iter().flatten().zip(exact.iter().flatten());
        let worst = pairs.fold(0.0_f64, |worst, (a, b)| worst.max((a - b).abs()));
        assert!(worst < bound, "{integration:?}: {worst}");
    }
}

#[test]
fn torque_of_step_corresponds_to_its_mean_rate() {
    let robot = oncilla();
    let motor = DcMotor::new(&robot.motors.unwrap().hip).unwrap();
    // The Moreau method and explicit Euler use this torque exactly; the others differ by their
    // discretisation error.
    for (integration, bound) in INTEGRATIONS
        .into_iter()
        .zip([0.02, 0.05, 1e-12, 0.03, 1e-12])
    {
        let mut harness = lcp(&robot, &one_leg(&robot), integration);
        let mut from_us = 0;
        for (voltage, bridge) in [(9.0, 1.0), (-70.0, 1.0), (5.0, 0.0), (0.0, 1.0)] {
            harness.commands = vec![voltage, bridge, 0.0, 0.0];
            for _ in 0..4 {
                let before = harness.value("leg/LF/hip/position");
                from_us += integration.step_us;
                harness.try_advance_to_us(from_us).unwrap();
                let rotation = harness.value("leg/LF/hip/position") - before;
                let torque = harness.value("leg/LF/hip/torque");
                let line = motor.torque(
                    voltage,
                    bridge,
                    rotation / (integration.step_us as f64 * 1e-6),
                );
                let error = (torque - line).abs() / motor.stall_torque();
                assert!(error < bound, "{integration:?}: {torque} {line}");
            }
        }
    }
}

#[test]
fn motors_of_negligible_resistance_hold_their_legs() {
    let mut robot = oncilla();
    let motors = robot.motors.as_mut().unwrap();
    (motors.hip.resistance, motors.knee.resistance) = (1e-4, 1e-4);
    let start = suspended(pose([30.0, -35.0, 35.0], [0.0; 3]));
    let legs = vec!["LF".to_owned()];
    let setup = motorised(&robot, Setup { legs, ..start });
    for integration in &INTEGRATIONS[..3] {
        let mut harness = lcp(&robot, &setup, *integration);
        let before = harness.value("leg/LF/hip/position");
        harness.commands.copy_from_slice(&[0.0, 1.0, 0.0, 1.0]);
        harness.advance_to_ms(100);
        // The leg exerts some 0.01 N·m at its hip, against a damping of (k N)²/R = 387 N·m·s/rad.
        let rotation = harness.value("leg/LF/hip/position") - before;
        assert!(rotation.abs() < 2e-4, "{integration:?}: {rotation}");
        assert!(
            harness.value("leg/LF/hip/torque").abs() > 0.01,
            "{integration:?}"
        );
    }
}

#[test]
fn energy_balance_closes_under_motors_on_every_base() {
    let robot = oncilla();
    for base in [Base::Free, Base::Planar, Base::Fixed] {
        let setup = motorised(
            &robot,
            Setup {
                base,
                ..standing_setup()
            },
        );
        for (integration, share) in INTEGRATIONS
            .into_iter()
            .take(4)
            .zip([1e-4, 2e-4, 2e-4, 2e-4])
        {
            let mut harness = lcp(&robot, &setup, integration);
            let control = PositionLoop::new(&mut harness, &setup);
            control.run(&mut harness, 0, 500);
            let balance = harness.energy();
            let residual_share = balance.residual.abs() / balance.exchanged;
            assert!(
                residual_share < share,
                "{base:?} {integration:?}: {residual_share} {balance:?}"
            );
            assert!(
                balance.exchanged > 0.5,
                "{base:?} {integration:?}: {balance:?}"
            );
        }
    }
}

#[test]
fn thesis_method_rejects_motors() {
    let robot = oncilla();
    let integration = Integration::new(Method::Thesis, 20);
    let error = build(&robot, &one_leg(&robot), integration).err().unwrap();
    assert_eq!(error, LcpError::Motors);
    assert!(build(&robot, &standing_setup(), integration).is_ok());
}

#[test]
fn motors_coast_without_work_until_bridge_closes() {
    let robot = oncilla();
    let setup = motorised(&robot, standing_setup());
    for integration in &INTEGRATIONS[..4] {
        let mut harness = lcp(&robot, &setup, *integration);
        assert!(harness.commands.iter().all(|input| *input == 0.0));
        harness.advance_to_ms(100);
        assert!(harness.energy().actuator.abs() < 1e-12, "{integration:?}");
        assert!(
            harness.value("leg/LF/hip/rate").abs() > 1e-3,
            "{integration:?}"
        );
    }
}

#[test]
fn restored_plant_with_motors_continues_bit_for_bit() {
    let robot = oncilla();
    let setup = motorised(&robot, standing_setup());
    for integration in INTEGRATIONS {
        let mut harness = lcp(&robot, &setup, integration);
        let control = PositionLoop::new(&mut harness, &setup);
        control.run(&mut harness, 0, 37);
        let (saved, mut other) = (harness.plant.save(), lcp(&robot, &setup, integration));
        other.plant.restore(&saved).unwrap();
        for harness in [&mut harness, &mut other] {
            control.run(harness, 37, 60);
        }
        assert_eq!(
            harness.plant.save().0,
            other.plant.save().0,
            "{integration:?}"
        );
    }
}

#[test]
fn steps_under_motors_do_not_allocate() {
    let robot = oncilla();
    let setup = motorised(&robot, standing_setup());
    for integration in [DEFAULT, Integration::new(Method::Moreau, 1000)] {
        let mut harness = lcp(&robot, &setup, integration);
        let control = PositionLoop::new(&mut harness, &setup);
        control.run(&mut harness, 0, 1000);
        let mut outputs = harness.observe().to_vec();
        let inputs = harness.commands.clone();
        let allocations = allocation_counter::measure(|| {
            for ms in 1001..1050 {
                let at = SimTime::ZERO + SimDuration::from_millis(ms);
                harness.plant.advance(at, &inputs).unwrap();
                harness.plant.observe(&mut outputs);
            }
        });
        assert_eq!(allocations.count_total, 0, "{integration:?}");
    }
}
