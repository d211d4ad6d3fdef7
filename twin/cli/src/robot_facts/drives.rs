//! Facts of the drives: torques and speeds, and what these are at a foot.

use twinrig_kernel::Unit;
use twinrig_robot::leg::{LegError, Planar};
use twinrig_robot::{Motor, Robot, Servo};

use super::fact::Fact;
use super::leg::LegKind;

/// Returns the facts of the drives themselves.
pub(super) fn facts(robot: &Robot) -> Vec<Fact> {
    let servos = &robot.actuators;
    let mut facts = Vec::new();
    facts.extend(servo(
        ["hip_torque", "hip_speed", "hip_lag"],
        HIP,
        &servos.hip,
        "hip",
    ));
    facts.extend(servo(
        ["knee_torque", "knee_speed", "knee_lag"],
        KNEE,
        &servos.knee,
        "knee",
    ));
    if let Some(abduction) = &servos.abduction {
        let keys = ["abduction_torque", "abduction_speed", "abduction_lag"];
        facts.extend(servo(keys, ABDUCTION, abduction, "abduction"));
    }
    if let Some(motors) = &robot.motors {
        facts.extend(motor(
            ["hip_motor_stall", "hip_motor_speed"],
            ["hip motor, stall torque", "hip motor, speed without load"],
            &motors.hip,
            "motor.hip",
        ));
        facts.extend(motor(
            ["knee_motor_stall", "knee_motor_speed"],
            ["knee motor, stall torque", "knee motor, speed without load"],
            &motors.knee,
            "motor.knee",
        ));
    }
    facts
}

const HIP: [&str; 3] = ["hip servo, torque", "hip servo, speed", "hip servo, lag"];
const KNEE: [&str; 3] = ["knee servo, torque", "knee servo, speed", "knee servo, lag"];
const ABDUCTION: [&str; 3] = ["abduction, torque", "abduction, speed", "abduction, lag"];

fn servo(
    keys: [&'static str; 3],
    names: [&'static str; 3],
    servo: &Servo,
    table: &str,
) -> [Fact; 3] {
    let fact = |n: usize, value: f64, unit: Unit, key: &str| {
        Fact::new(
            keys[n],
            names[n],
            [value],
            unit,
            &format!("actuator.{table}.{key}"),
        )
    };
    [
        fact(0, servo.torque, Unit::NewtonMeter, "torque"),
        fact(1, servo.speed, Unit::RadianPerSecond, "speed"),
        fact(2, servo.lag, Unit::Second, "lag"),
    ]
}

/// Returns the ends of the torque-speed line of a motor, behind its gear.
fn motor(
    keys: [&'static str; 2],
    names: [&'static str; 2],
    motor: &Motor,
    table: &str,
) -> [Fact; 2] {
    let current = motor.voltage / motor.resistance;
    let stall = motor.torque_constant * current * motor.gear;
    let speed = motor.voltage / motor.torque_constant / motor.gear;
    [
        Fact::new(keys[0], names[0], [stall], Unit::NewtonMeter, table).with_note(format!(
            "behind the gear of {}:1, {current:.1} A",
            motor.gear
        )),
        Fact::new(keys[1], names[1], [speed], Unit::RadianPerSecond, table)
            .with_note("behind the gear"),
    ]
}

/// Returns what the servos achieve at the foot of a standing leg, the pantograph closed.
///
/// # Errors
/// [`LegError`] for a leg without the pose.
pub(super) fn foot_facts(robot: &Robot, kind: &LegKind) -> Result<Vec<Fact>, LegError> {
    let (hip, knee) = (&robot.actuators.hip, &robot.actuators.knee);
    let length = kind.standing.length;
    let winding = winding(kind, length)?;
    let (keys, pulley) = (kind.keys(true), kind.key("pulley_radius"));
    let from = |key: &str| format!("{keys} trunk.mass actuator.{key}");
    let wound = format!("{} {pulley}", from("knee.torque"));
    Ok(vec![
        Fact::new(
            "foot_force_hip",
            "force across the leg by the hip",
            [hip.torque / length],
            Unit::Newton,
            &from("hip.torque"),
        )
        .with_note("standing"),
        Fact::new(
            "foot_speed_hip",
            "speed across the leg by the hip",
            [hip.speed * length],
            Unit::MeterPerSecond,
            &from("hip.speed"),
        )
        .with_note("standing, without load"),
        Fact::new(
            "cable_tension",
            "tension of the cable",
            [knee.torque / kind.pantograph.pulley_radius()],
            Unit::Newton,
            &format!("actuator.knee.torque {pulley}"),
        ),
        Fact::new(
            "foot_force_knee",
            "pull along the leg by the cable",
            [knee.torque * winding],
            Unit::Newton,
            &wound,
        )
        .with_note("standing, against the springs"),
        Fact::new(
            "foot_speed_knee",
            "speed along the leg by the cable",
            [knee.speed / winding],
            Unit::MeterPerSecond,
            &format!("{} {pulley}", from("knee.speed")),
        )
        .with_note("standing, without load"),
    ])
}

/// Returns the angle by which the pulley winds up per length by which the leg shortens, with a taut
/// cable and a closed pantograph, by differences of the inverse kinematics \[rad/m\].
fn winding(kind: &LegKind, length: f64) -> Result<f64, LegError> {
    let leg = &kind.pantograph;
    let step = 1e-6 * leg.length_max();
    let middle = length.clamp(leg.length_min() + step, leg.length_max() - step);
    let knee = |length: f64| {
        leg.inverse_closed(Planar::new(0.0, -length))
            .map(|c| c.knee)
    };
    Ok((knee(middle - step)? - knee(middle + step)?) / (2.0 * step))
}
