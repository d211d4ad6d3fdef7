//! Motors that are given voltages: the torque of the closed form, books that close, and what every drive must keep to.

use twinrig_actuator::DcMotor;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_legged::{Base, Drives, Setup};
use twinrig_robot::Robot;
use twinrig_runtime::Plant;

use crate::scene::{Scene, at, named_robot, setup};

/// A robot that has motors, and them for its drives.
fn oncilla() -> (Robot, Setup) {
    let robot = named_robot("oncilla");
    let motors = robot.motors.unwrap();
    let drives = Drives::Motors {
        hip: motors.hip,
        knee: motors.knee,
    };
    (robot, Setup { drives, ..setup() })
}

/// The fore left leg of a trunk that is held, in steps of so many microseconds.
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
        let phase = std::f64::consts::TAU * ms as f64 * 1e-3;
        let (sway, bend) = (0.1 * libm::sin(phase), 0.25 * (1.0 - libm::cos(phase)));
        let mut inputs = Vec::new();
        for (i, leg) in self.setup.legs.iter().enumerate() {
            for (j, joint) in ["hip", "knee"].into_iter().enumerate() {
                let position = scene.value(&format!("leg/{leg}/{joint}/position"));
                let wanted = self.home[2 * i + j] + [sway, bend][j];
                inputs.extend([40.0 * (wanted - position), 1.0]);
            }
        }
        scene.commands.copy_from_slice(&inputs);
    }

    fn run(&self, scene: &mut Scene, from_ms: u64, to_ms: u64) {
        for ms in from_ms..to_ms {
            self.command(scene, ms);
            scene.to(ms + 1);
        }
    }
}

#[test]
fn a_pulley_that_unwinds_runs_like_the_motor_alone_with_an_error_of_second_order() {
    let error = |step_us: u64| {
        let (robot, setup) = hanging(step_us);
        let mut scene = Scene::new(&robot, &setup);
        let start = scene.value("leg/LF/knee/position");
        scene.commands.copy_from_slice(&[0.0, 1.0, -12.0, 1.0]);
        scene.to(4);
        let motor = knee(&robot);
        let (last, tau) = (-0.5 * motor.no_load_rate(), motor.time_constant());
        let risen = -libm::expm1(-4e-3 / tau);
        let turned = last * (4e-3 - tau * risen);
        let [rate, position] =
            ["rate", "position"].map(|what| scene.value(&format!("leg/LF/knee/{what}")));
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
fn a_leg_in_the_air_goes_as_in_steps_a_fiftieth_as_long() {
    let run = |step_us: u64| {
        let (robot, setup) = hanging(step_us);
        let mut scene = Scene::new(&robot, &setup);
        let control = Loop::new(&mut scene, &setup);
        let mut track = Vec::new();
        for ms in 0..500 {
            control.run(&mut scene, ms, ms + 1);
            track.push(positions(&mut scene, &setup));
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
    // Where a cable becomes taut in its step is of first order; a motor that takes up a new voltage within 1.66 ms, of second.
    assert!(
        errors[0] < 2e-3 && errors[2] < errors[0] / 3.0,
        "{errors:?}"
    );
    // It moved at all.
    assert!((fine[499][1] - fine[0][1]).abs() > 0.2);
}

#[test]
fn the_torque_is_that_of_the_mean_rate_and_the_supply_limits_it() {
    let (robot, setup) = hanging(1000);
    let mut scene = Scene::new(&robot, &setup);
    let motor = knee(&robot);
    for (ms, (voltage, bridge)) in (1..).zip([(9.0, 1.0), (-70.0, 1.0), (5.0, 0.0), (0.0, 1.0)]) {
        let before = scene.value("leg/LF/hip/rate");
        scene.commands.copy_from_slice(&[voltage, bridge, 0.0, 0.0]);
        scene.to(ms);
        let mean = 0.5 * (before + scene.value("leg/LF/hip/rate"));
        let torque = scene.value("leg/LF/hip/torque");
        let line = motor.torque(voltage, bridge, mean);
        assert!(
            (torque - line).abs() < 1e-6 * motor.stall_torque(),
            "{torque} {line}"
        );
    }
}

#[test]
fn books_close_under_motors_on_every_base() {
    for base in [Base::Free, Base::Planar, Base::Fixed] {
        let (robot, setup) = oncilla();
        let setup = Setup { base, ..setup };
        let mut scene = Scene::new(&robot, &setup);
        let control = Loop::new(&mut scene, &setup);
        control.run(&mut scene, 0, 1500);
        let balance = scene.energy();
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
fn motors_start_coasting_and_give_no_work_until_a_bridge_closes() {
    let (robot, setup) = oncilla();
    let mut scene = Scene::new(&robot, &setup);
    assert!(scene.commands.iter().all(|input| *input == 0.0));
    scene.to(300);
    // Rounding of torques that cancel.
    assert!(scene.energy().actuator.abs() < 1e-9 * scene.energy().exchanged);
    // Legs that nothing holds give way.
    assert!(
        scene.value("leg/LF/hip/position").abs() > 1e-3 || scene.read("body/position")[2] < 0.2
    );
}

#[test]
fn a_plant_with_motors_is_restored_bit_for_bit() {
    let (robot, setup) = oncilla();
    let mut scene = Scene::new(&robot, &setup);
    let control = Loop::new(&mut scene, &setup);
    control.run(&mut scene, 0, 77);
    let (saved, mut other) = (scene.plant.save(), Scene::new(&robot, &setup));
    other.plant.restore(&saved).unwrap();
    for scene in [&mut scene, &mut other] {
        control.run(scene, 77, 150);
    }
    assert_eq!(scene.plant.save().0, other.plant.save().0);
}

#[test]
fn steps_under_motors_allocate_nothing() {
    let (robot, setup) = oncilla();
    let mut scene = Scene::new(&robot, &setup);
    let control = Loop::new(&mut scene, &setup);
    control.run(&mut scene, 0, 500);
    let inputs = scene.commands.clone();
    let mut outputs = scene.observe().to_vec();
    let allocations = allocation_counter::measure(|| {
        for ms in 501..600 {
            scene.plant.advance(at(ms), &inputs).unwrap();
            scene.plant.observe(&mut outputs);
        }
    });
    assert_eq!(allocations.count_total, 0);
}

#[test]
fn a_voltage_that_is_no_number_is_named_and_nothing_moves() {
    let (robot, setup) = hanging(1000);
    let mut scene = Scene::new(&robot, &setup);
    let saved = scene.plant.save();
    let fault = scene.plant.advance(at(1), &[0.0, 1.0, f64::INFINITY, 1.0]);
    let fault = fault.unwrap_err();
    assert_eq!(
        (fault.part.as_str(), fault.time),
        ("leg/LF/knee/voltage", SimTime::ZERO)
    );
    assert_eq!(scene.plant.save().0, saved.0);
}
