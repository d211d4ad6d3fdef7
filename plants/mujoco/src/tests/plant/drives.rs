//! Servos and motors in the plant against their models alone.

use twinrig_actuator::{DcMotor, PositionServo};
use twinrig_legged::{Base, Drives, Setup};
use twinrig_mujoco::{Coordinates, Integrator, Options};
use twinrig_robot::{Motor, Servo};
use twinrig_testing::robots::robot;

use super::fixture::{SERVO, hanging, with_coordinates, with_options};

/// Returns the setup of a hanging leg with these drives.
fn hanging_leg(drives: Drives) -> Setup {
    Setup {
        base: Base::Fixed,
        legs: vec!["LF".to_owned()],
        drives,
        ..hanging(twinrig_legged::Start::default())
    }
}

#[test]
fn servo_motion_is_independent_of_the_load() {
    for coordinates in Coordinates::ALL {
        for integrator in [Integrator::Euler, Integrator::Rk4, Integrator::Discrete] {
            let setup = hanging_leg(Drives::Servos {
                hip: SERVO,
                knee: SERVO,
            });
            let mut options = Options::new(setup, coordinates);
            options.numerics.integrator = integrator;
            let mut fixture = with_options(&robot(), &options);
            let servo = PositionServo::new(&SERVO).unwrap();
            let start = [
                fixture.read("leg/LF/hip/position")[0],
                fixture.read("leg/LF/knee/position")[0],
            ];
            let (mut places, mut rates) = (start, [0.0; 2]);
            // Small enough not to saturate the torque.
            fixture.commands[0] += 0.03;
            fixture.commands[1] += 0.05;
            for step in 0..100 {
                fixture.advance_us(1000);
                for i in 0..2 {
                    let next_rate =
                        servo.rate_after(1e-3, fixture.commands[i], places[i], rates[i]);
                    // MuJoCo integrates positions with the rate at the step's end, or with those of
                    // its stages.
                    let moved = if integrator == Integrator::Rk4 {
                        0.5 * (rates[i] + next_rate)
                    } else {
                        next_rate
                    };
                    places[i] += 1e-3 * moved;
                    rates[i] = next_rate;
                }
                let found = [
                    fixture.read("leg/LF/hip/position")[0],
                    fixture.read("leg/LF/knee/position")[0],
                ];
                for i in 0..2 {
                    // The clutch yields by 1e-4 of the reference acceleration.
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
fn servo_torque_stays_within_the_limit_at_its_rate() {
    let weak = Servo {
        torque: 0.05,
        ..SERVO
    };
    for coordinates in Coordinates::ALL {
        let setup = hanging_leg(Drives::Servos {
            hip: weak,
            knee: weak,
        });
        let mut fixture = with_coordinates(setup, coordinates);
        fixture.commands[0] += 1.0;
        let mut saturated = 0;
        let mut rate = 0.0;
        for _ in 0..200 {
            let limit = weak.torque * (1.0 - f64::clamp(rate / weak.speed, 0.0, 1.0));
            fixture.advance_us(1000);
            let torque = fixture.read("leg/LF/hip/torque")[0];
            let angles = fixture.read("leg/LF/hip/position")[0];
            // Against the motion the full torque is available.
            assert!(
                torque <= limit + 1e-6 && torque >= -weak.torque - 1e-6,
                "{torque} {limit}"
            );
            saturated += u32::from((torque - limit).abs() < 1e-6);
            let state = twinrig_runtime::Plant::state(&fixture.plant).unwrap();
            rate = state.get("leg/LF/rates").unwrap()[0];
            assert!(angles.is_finite());
        }
        assert!(
            saturated > 3,
            "{coordinates:?}: saturated in {saturated} steps"
        );
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
fn pulley_with_slack_cable_turns_as_the_unloaded_motor() {
    let motor = DcMotor::new(&MOTOR).unwrap();
    for coordinates in Coordinates::ALL {
        for integrator in Integrator::ALL {
            let setup = hanging_leg(Drives::Motors {
                hip: MOTOR,
                knee: MOTOR,
            });
            let mut options = Options::new(setup, coordinates);
            options.numerics.integrator = integrator;
            let mut fixture = with_options(&robot(), &options);
            // Hip voltage and bridge, knee voltage and bridge: the pulley unwinds, so that the
            // cable is slack.
            fixture.commands = vec![0.0, 1.0, -3.0, 1.0];
            for step in 1..=10 {
                fixture.advance_us(200);
                let time = 2e-4 * f64::from(step);
                let exact =
                    0.125 * motor.no_load_rate() * libm::expm1(-time / motor.time_constant());
                let rate = fixture.read("leg/LF/knee/rate")[0];
                // Error of the trapezoidal rule, and of the fourth-order method: (h/T)²/12 of the
                // total.
                let error = (rate - exact).abs();
                assert!(
                    error < 2e-3 * 0.125 * motor.no_load_rate(),
                    "{coordinates:?} {integrator:?}: {rate} {exact}"
                );
            }
            let tension = fixture.read("leg/LF/cable/tension")[0];
            assert!(tension.abs() < 1e-9, "{tension}");
        }
    }
}

#[test]
fn cable_tension_is_never_negative() {
    for coordinates in Coordinates::ALL {
        let setup = hanging_leg(Drives::Servos {
            hip: SERVO,
            knee: SERVO,
        });
        let mut fixture = with_coordinates(setup, coordinates);
        let first = fixture.commands[1];
        let (mut taut, mut slack) = (0, 0);
        for step in 0..400 {
            fixture.commands[1] = first + 0.6 * libm::sin(0.05 * f64::from(step));
            fixture.advance_us(1000);
            let tension = fixture.read("leg/LF/cable/tension")[0];
            assert!(tension > -1e-6, "{tension}");
            taut += u32::from(tension > 1.0);
            slack += u32::from(tension < 1e-9);
        }
        assert!(taut > 50 && slack > 50, "{coordinates:?}: {taut} {slack}");
    }
}

#[test]
fn servo_in_its_dead_band_holds_the_load() {
    let idle = Servo {
        dead_band: 0.1,
        ..SERVO
    };
    for coordinates in Coordinates::ALL {
        let setup = hanging_leg(Drives::Servos {
            hip: idle,
            knee: idle,
        });
        let mut fixture = with_coordinates(setup, coordinates);
        // The springs pull at the cable from here on.
        fixture.commands[1] += 0.3;
        for _ in 0..1000 {
            fixture.advance_us(1000);
        }
        let start = fixture.read("leg/LF/knee/position")[0];
        let torque = fixture.read("leg/LF/knee/torque")[0];
        for _ in 0..1000 {
            fixture.advance_us(1000);
        }
        let creep = (fixture.read("leg/LF/knee/position")[0] - start).abs();
        // Measured value times 1.5; ten times as much with clutches as soft as pins.
        assert!(
            torque.abs() > 0.05 && creep < 1.2e-3,
            "{coordinates:?}: {torque} N·m, {creep} rad/s"
        );
    }
}
