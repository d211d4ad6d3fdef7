//! Servos and motors, against what they are by themselves.

use twinrig_actuator::{DcMotor, PositionServo};
use twinrig_legged::{Base, Drives, Setup};
use twinrig_mujoco::{Coordinates, Integrator, Options};
use twinrig_robot::{Motor, Servo};

use crate::scene::{SERVO, Scene, hanging, robot};

/// One leg that hangs, driven.
fn driven(drives: Drives) -> Setup {
    Setup {
        base: Base::Fixed,
        legs: vec!["LF".to_owned()],
        drives,
        ..hanging(twinrig_legged::Start::default())
    }
}

#[test]
fn a_servo_goes_its_own_way_whatever_the_leg_weighs() {
    for coordinates in Coordinates::ALL {
        for integrator in [Integrator::Euler, Integrator::Rk4, Integrator::Discrete] {
            let setup = driven(Drives::Servos {
                hip: SERVO,
                knee: SERVO,
            });
            let mut options = Options::new(setup, coordinates);
            options.numerics.integrator = integrator;
            let mut scene = Scene::new(&robot(), &options);
            let servo = PositionServo::new(&SERVO).unwrap();
            let start = [
                scene.read("leg/LF/hip/position")[0],
                scene.read("leg/LF/knee/position")[0],
            ];
            let (mut places, mut rates) = (start, [0.0; 2]);
            // Not so far that it takes all of their torque.
            scene.inputs[0] += 0.03;
            scene.inputs[1] += 0.05;
            for step in 0..100 {
                scene.go(1000);
                for i in 0..2 {
                    let then = servo.rate_after(1e-3, scene.inputs[i], places[i], rates[i]);
                    // MuJoCo moves positions by the rate at the step's end, or by its stages'.
                    let moved = if integrator == Integrator::Rk4 {
                        0.5 * (rates[i] + then)
                    } else {
                        then
                    };
                    places[i] += 1e-3 * moved;
                    rates[i] = then;
                }
                let found = [
                    scene.read("leg/LF/hip/position")[0],
                    scene.read("leg/LF/knee/position")[0],
                ];
                for i in 0..2 {
                    // The clutch gives way by 1e-4 of what it is asked for.
                    assert!(
                        (found[i] - places[i]).abs() < 1e-3,
                        "{coordinates:?} {integrator:?} {step}: {found:?} {places:?}"
                    );
                }
            }
            assert!((places[0] - start[0] - 0.03).abs() < 1e-6, "it has arrived");
        }
    }
}

#[test]
fn a_servo_gives_no_more_torque_than_it_has_at_its_rate() {
    let weak = Servo {
        torque: 0.05,
        ..SERVO
    };
    for coordinates in Coordinates::ALL {
        let setup = driven(Drives::Servos {
            hip: weak,
            knee: weak,
        });
        let mut scene = Scene::of(setup, coordinates);
        scene.inputs[0] += 1.0;
        let mut saturated = 0;
        let mut rate = 0.0;
        for _ in 0..200 {
            let most = weak.torque * (1.0 - f64::clamp(rate / weak.speed, 0.0, 1.0));
            scene.go(1000);
            let torque = scene.read("leg/LF/hip/torque")[0];
            let angles = scene.read("leg/LF/hip/position")[0];
            // Against the motion it has all of its torque.
            assert!(
                torque <= most + 1e-6 && torque >= -weak.torque - 1e-6,
                "{torque} {most}"
            );
            saturated += u32::from((torque - most).abs() < 1e-6);
            let state = twinrig_runtime::Plant::state(&scene.plant).unwrap();
            rate = state.get("leg/LF/rates").unwrap()[0];
            assert!(angles.is_finite());
        }
        assert!(saturated > 3, "{coordinates:?}: spent in {saturated} steps");
    }
}

/// The motors of Oncilla's joints.
const MOTOR: Motor = Motor {
    resistance: 0.593,
    torque_constant: 14.05e-3,
    gear: 14.0,
    inertia: 5.54e-7,
    voltage: 24.0,
};

#[test]
fn a_pulley_whose_cable_is_slack_turns_as_its_motor_does_alone() {
    let motor = DcMotor::new(&MOTOR).unwrap();
    for coordinates in Coordinates::ALL {
        for integrator in Integrator::ALL {
            let setup = driven(Drives::Motors {
                hip: MOTOR,
                knee: MOTOR,
            });
            let mut options = Options::new(setup, coordinates);
            options.numerics.integrator = integrator;
            let mut scene = Scene::new(&robot(), &options);
            // Hip voltage and bridge, knee voltage and bridge: unwinding, so that the cable does not pull.
            scene.inputs = vec![0.0, 1.0, -3.0, 1.0];
            for step in 1..=10 {
                scene.go(200);
                let time = 2e-4 * f64::from(step);
                let exact =
                    0.125 * motor.no_load_rate() * libm::expm1(-time / motor.time_constant());
                let rate = scene.read("leg/LF/knee/rate")[0];
                // The trapezoidal rule, and of fourth order: (h/T)²/12 of the whole.
                let off = (rate - exact).abs();
                assert!(
                    off < 2e-3 * 0.125 * motor.no_load_rate(),
                    "{coordinates:?} {integrator:?}: {rate} {exact}"
                );
            }
            let tension = scene.read("leg/LF/cable/tension")[0];
            assert!(tension.abs() < 1e-9, "{tension}");
        }
    }
}

#[test]
fn a_taut_cable_pulls_and_never_pushes() {
    for coordinates in Coordinates::ALL {
        let setup = driven(Drives::Servos {
            hip: SERVO,
            knee: SERVO,
        });
        let mut scene = Scene::of(setup, coordinates);
        let first = scene.inputs[1];
        let (mut taut, mut slack) = (0, 0);
        for step in 0..400 {
            scene.inputs[1] = first + 0.6 * libm::sin(0.05 * f64::from(step));
            scene.go(1000);
            let tension = scene.read("leg/LF/cable/tension")[0];
            assert!(tension > -1e-6, "{tension}");
            taut += u32::from(tension > 1.0);
            slack += u32::from(tension < 1e-9);
        }
        assert!(taut > 50 && slack > 50, "{coordinates:?}: {taut} {slack}");
    }
}

#[test]
fn a_servo_that_stands_still_in_its_dead_band_holds_what_pulls_at_it() {
    let idle = Servo {
        dead_band: 0.1,
        ..SERVO
    };
    for coordinates in Coordinates::ALL {
        let setup = driven(Drives::Servos {
            hip: idle,
            knee: idle,
        });
        let mut scene = Scene::of(setup, coordinates);
        // The springs pull at the cable from then on.
        scene.inputs[1] += 0.3;
        for _ in 0..1000 {
            scene.go(1000);
        }
        let start = scene.read("leg/LF/knee/position")[0];
        let torque = scene.read("leg/LF/knee/torque")[0];
        for _ in 0..1000 {
            scene.go(1000);
        }
        let crept = (scene.read("leg/LF/knee/position")[0] - start).abs();
        // Measured, and half as much again; ten times that with clutches as soft as pins.
        assert!(
            torque.abs() > 0.05 && crept < 1.2e-3,
            "{coordinates:?}: {torque} N·m, {crept} rad/s"
        );
    }
}
