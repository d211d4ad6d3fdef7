//! Motors as drives: torques in closed form, energy balance, and requirements common to all drives.

use twinrig_actuator::DcMotor;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_legged::{Base, Drives, Setup};
use twinrig_robot::Robot;
use twinrig_runtime::Plant;
use twinrig_testing::plant_harness::at_ms;
use twinrig_testing::robots::robot_named;

use super::harness::{Harness, massless, setup};

/// A robot with motors, and a setup that uses these as drives.
fn oncilla() -> (Robot, Setup) {
    let robot = robot_named("oncilla");
    let motors = robot.motors.unwrap();
    let drives = Drives::Motors {
        hip: motors.hip,
        knee: motors.knee,
    };
    (robot, Setup { drives, ..setup() })
}

/// The fore left leg on a fixed trunk, with a step of `step_us` microseconds.
fn hanging(step_us: u64) -> (Robot, Setup) {
    let (robot, setup) = oncilla();
    let setup = Setup {
        base: Base::Fixed,
        ground: None,
        legs: vec!["LF".to_owned()],
        step: SimDuration::from_micros(step_us),
        ..setup
    };
    (robot, setup)
}

fn knee(robot: &Robot) -> DcMotor {
    DcMotor::new(&robot.motors.unwrap().knee).unwrap()
}

/// Positions of hip and pulley of each leg.
fn positions(harness: &mut Harness, setup: &Setup) -> Vec<f64> {
    let mut positions = Vec::new();
    for leg in &setup.legs {
        for joint in ["hip", "knee"] {
            positions.push(harness.value(&format!("leg/{leg}/{joint}/position")));
        }
    }
    positions
}

/// Position controller with a period of a millisecond and a gain of 40 V/rad; the motor's own
/// damping suffices.
struct Loop {
    setup: Setup,
    home: Vec<f64>,
}

impl Loop {
    fn new(harness: &mut Harness, setup: &Setup) -> Self {
        Self {
            setup: setup.clone(),
            home: positions(harness, setup),
        }
    }

    /// Sets the inputs at `ms`: legs sway and bend about their start, as far as springs and cables
    /// allow.
    fn command(&self, harness: &mut Harness, ms: u64) {
        let phase = std::f64::consts::TAU * ms as f64 * 1e-3;
        let (sway, bend) = (0.1 * libm::sin(phase), 0.25 * (1.0 - libm::cos(phase)));
        let mut inputs = Vec::new();
        for (i, leg) in self.setup.legs.iter().enumerate() {
            for (j, joint) in ["hip", "knee"].into_iter().enumerate() {
                let position = harness.value(&format!("leg/{leg}/{joint}/position"));
                let target = self.home[2 * i + j] + [sway, bend][j];
                inputs.extend([40.0 * (target - position), 1.0]);
            }
        }
        harness.commands.copy_from_slice(&inputs);
    }

    fn run(&self, harness: &mut Harness, from_ms: u64, to_ms: u64) {
        for ms in from_ms..to_ms {
            self.command(harness, ms);
            harness.advance_to_ms(ms + 1);
        }
    }
}

#[test]
fn unwinding_pulley_follows_the_unloaded_motor_to_second_order() {
    let error = |step_us: u64| {
        let (robot, setup) = hanging(step_us);
        let mut harness = massless(&robot, &setup);
        let start = harness.value("leg/LF/knee/position");
        harness.commands.copy_from_slice(&[0.0, 1.0, -12.0, 1.0]);
        harness.advance_to_ms(4);
        let motor = knee(&robot);
        let (last, tau) = (-0.5 * motor.no_load_rate(), motor.time_constant());
        let risen = -libm::expm1(-4e-3 / tau);
        let turned = last * (4e-3 - tau * risen);
        let [rate, position] =
            ["rate", "position"].map(|what| harness.value(&format!("leg/LF/knee/{what}")));
        (
            (rate - last * risen).abs() / last.abs(),
            (position - start - turned).abs(),
        )
    };
    let (coarse, fine) = (error(500), error(250));
    assert!(coarse.0 < 1e-2 && coarse.1 < 1e-3, "{coarse:?}");
    assert!(
        fine.0 < coarse.0 / 3.5 && fine.1 < coarse.1 / 3.5,
        "{coarse:?} {fine:?}"
    );
}

#[test]
fn leg_in_the_air_converges_to_the_solution_with_fine_steps() {
    let run = |step_us: u64| {
        let (robot, setup) = hanging(step_us);
        let mut harness = massless(&robot, &setup);
        let control = Loop::new(&mut harness, &setup);
        let mut track = Vec::new();
        for ms in 0..500 {
            control.run(&mut harness, ms, ms + 1);
            track.push(positions(&mut harness, &setup));
        }
        track
    };
    let fine = run(20);
    let error = |step_us| {
        let coarse = run(step_us);
        let pairs = coarse.iter().flatten().zip(fine.iter().flatten());
        pairs.fold(0.0_f64, |worst, (a, b)| worst.max((a - b).abs()))
    };
    let errors = [1000, 500, 200].map(error);
    // The time within a step at which a cable becomes taut is of first order; the response of a
    // motor to a new voltage, within 1.66 ms, of second.
    assert!(
        errors[0] < 2e-3 && errors[2] < errors[0] / 3.0,
        "{errors:?}"
    );
    // The joint moves.
    assert!((fine[499][1] - fine[0][1]).abs() > 0.2);
}

#[test]
fn torque_is_that_of_the_mean_rate_and_limited_by_the_supply() {
    let (robot, setup) = hanging(1000);
    let mut harness = massless(&robot, &setup);
    let motor = knee(&robot);
    for (ms, (voltage, bridge)) in (1..).zip([(9.0, 1.0), (-70.0, 1.0), (5.0, 0.0), (0.0, 1.0)]) {
        let before = harness.value("leg/LF/hip/rate");
        harness
            .commands
            .copy_from_slice(&[voltage, bridge, 0.0, 0.0]);
        harness.advance_to_ms(ms);
        let mean = 0.5 * (before + harness.value("leg/LF/hip/rate"));
        let torque = harness.value("leg/LF/hip/torque");
        let line = motor.torque(voltage, bridge, mean);
        assert!(
            (torque - line).abs() < 1e-6 * motor.stall_torque(),
            "{torque} {line}"
        );
    }
}

#[test]
fn energy_balance_closes_under_motors_on_every_base() {
    for base in [Base::Free, Base::Planar, Base::Fixed] {
        let (robot, setup) = oncilla();
        let setup = Setup { base, ..setup };
        let mut harness = massless(&robot, &setup);
        let control = Loop::new(&mut harness, &setup);
        control.run(&mut harness, 0, 1500);
        let balance = harness.energy();
        assert!(
            balance.residual.abs() < 1e-6 * balance.exchanged,
            "{base:?}: {balance:?}"
        );
        assert!(
            balance.exchanged > 1.0 && balance.dissipated > 0.0,
            "{base:?}: {balance:?}"
        );
    }
}

#[test]
fn motors_coast_at_start_and_do_no_work_until_a_bridge_closes() {
    let (robot, setup) = oncilla();
    let mut harness = massless(&robot, &setup);
    assert!(harness.commands.iter().all(|input| *input == 0.0));
    harness.advance_to_ms(300);
    // Up to rounding of torques that cancel.
    assert!(harness.energy().actuator.abs() < 1e-9 * harness.energy().exchanged);
    // Unpowered legs yield.
    assert!(
        harness.value("leg/LF/hip/position").abs() > 1e-3 || harness.read("body/position")[2] < 0.2
    );
}

#[test]
fn plant_with_motors_is_restored_bit_for_bit() {
    let (robot, setup) = oncilla();
    let mut harness = massless(&robot, &setup);
    let control = Loop::new(&mut harness, &setup);
    control.run(&mut harness, 0, 77);
    let (saved, mut other) = (harness.plant.save(), massless(&robot, &setup));
    other.plant.restore(&saved).unwrap();
    for harness in [&mut harness, &mut other] {
        control.run(harness, 77, 150);
    }
    assert_eq!(harness.plant.save().0, other.plant.save().0);
}

#[test]
fn steps_under_motors_allocate_nothing() {
    let (robot, setup) = oncilla();
    let mut harness = massless(&robot, &setup);
    let control = Loop::new(&mut harness, &setup);
    control.run(&mut harness, 0, 500);
    let inputs = harness.commands.clone();
    let mut outputs = harness.observe().to_vec();
    let allocations = allocation_counter::measure(|| {
        for ms in 501..600 {
            harness.plant.advance(at_ms(ms), &inputs).unwrap();
            harness.plant.observe(&mut outputs);
        }
    });
    assert_eq!(allocations.count_total, 0);
}

#[test]
fn non_finite_voltage_is_a_fault_that_leaves_the_plant_unchanged() {
    let (robot, setup) = hanging(1000);
    let mut harness = massless(&robot, &setup);
    let saved = harness.plant.save();
    let fault = harness
        .plant
        .advance(at_ms(1), &[0.0, 1.0, f64::INFINITY, 1.0]);
    let fault = fault.unwrap_err();
    assert_eq!(
        (fault.part.as_str(), fault.time),
        ("leg/LF/knee/voltage", SimTime::ZERO)
    );
    assert_eq!(harness.plant.save().0, saved.0);
}
