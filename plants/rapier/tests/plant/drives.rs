//! Servos and motors, at the limits that have closed forms.

use twinrig_legged::{Base, Drives, Setup, StartPose};
use twinrig_rapier::Joints;
use twinrig_robot::{Motor, Servo};
use twinrig_testing::robots::{robot, suspended};

use crate::fixture::with_joints;

fn servo(torque: f64) -> Servo {
    Servo {
        torque,
        speed: 20.0,
        lag: 5e-3,
        dead_band: 0.0,
        inertia: 1e-4,
    }
}

fn hanging_leg(drives: Drives, step_us: u64) -> Setup {
    let q = [0.0, -0.3, 0.3];
    let start = StartPose { q, rates: [0.0; 3] };
    Setup {
        drives,
        base: Base::Fixed,
        ..suspended(&["LF"], start, step_us)
    }
}

#[test]
fn unsaturated_servo_follows_a_ramp_with_its_lag() {
    for joints in Joints::ALL {
        let drives = Drives::Servos {
            hip: servo(50.0),
            knee: servo(50.0),
        };
        let mut fixture = with_joints(&robot(), hanging_leg(drives, 1000), joints);
        let start = fixture.commands.clone();
        for k in 1..=200_u64 {
            fixture.commands[0] = start[0] + 2.0 * 1e-3 * k as f64;
            fixture.advance_to_us(1000 * k);
        }
        // The lag behind a ramp of 2 rad/s is 5 ms; the last command was held for its millisecond.
        let hip = fixture.read("leg/LF/hip/position")[0];
        let expected = fixture.commands[0] - 2.0 * (5e-3 - 0.5e-3);
        assert!(
            (hip - expected).abs() < 1e-3,
            "{joints:?}: {hip} {expected}"
        );
    }
}

#[test]
fn saturated_knee_servo_sets_the_cable_tension() {
    let robot = robot();
    for joints in Joints::ALL {
        let drives = Drives::Servos {
            hip: servo(50.0),
            knee: servo(0.4),
        };
        let mut fixture = with_joints(&robot, hanging_leg(drives, 1000), joints);
        // Beyond the range of the leg: the servo winds until its torque saturates.
        fixture.commands[1] += 3.0;
        fixture.advance_to_us(1_500_000);
        let tension = fixture.read("leg/LF/cable/tension")[0];
        let expected = 0.4 / robot.legs[0].leg.pulley_radius;
        assert!(
            (tension - expected).abs() < 0.02 * expected,
            "{joints:?}: {tension} {expected}"
        );
        let torque = fixture.read("leg/LF/knee/torque")[0];
        assert!((torque - 0.4).abs() < 8e-3, "{joints:?}: {torque}");
    }
}

#[test]
fn cable_tension_is_never_negative() {
    let drives = Drives::Servos {
        hip: servo(50.0),
        knee: servo(50.0),
    };
    let mut fixture = with_joints(&robot(), hanging_leg(drives, 2000), Joints::Impulse);
    let start = fixture.commands.clone();
    for k in 1..=200_u64 {
        let phase = 0.05 * k as f64;
        fixture.commands[1] = start[1] + 0.3 * libm::sin(phase);
        fixture.advance_to_us(2000 * k);
        let tension = fixture.read("leg/LF/cable/tension")[0];
        assert!(tension >= 0.0, "{tension}");
    }
}

#[test]
fn unloaded_motor_reaches_its_no_load_speed() {
    let motor = Motor {
        resistance: 0.593,
        torque_constant: 14.05e-3,
        gear: 14.0,
        inertia: 5.54e-7,
        voltage: 24.0,
    };
    let drives = Drives::Motors {
        hip: motor,
        knee: motor,
    };
    let mut fixture = with_joints(&robot(), hanging_leg(drives, 1000), Joints::Impulse);
    // The pulley unwinds, so that the cable is slack; the bridge of the hip is open.
    fixture.commands = vec![0.0, 0.0, -6.0, 1.0];
    fixture.advance_to_us(100_000);
    let rate = fixture.read("leg/LF/knee/rate")[0];
    let expected = -6.0 / (14.05e-3 * 14.0);
    assert!(
        (rate - expected).abs() < 1e-9 * expected.abs(),
        "{rate} {expected}"
    );
}
