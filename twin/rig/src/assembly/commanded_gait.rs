//! Commands of a gait, from the variables of its controller and the drives of its robot.

use twinrig_actuator::serial::{Bridge, Winding};
use twinrig_robot::serial::SerialServo;
use twinrig_robot::{Motor, Robot, Servo};
use twinrig_runtime::ProcessVariable;
use twinrig_scenario::{
    ActuatorKind, CommandedGait, DriveLimits, LegFact, Scenario, ServoOverride,
};

use crate::parts::setup::overridden;

/// Variable of a controller with the step height of all legs, of a leg (`step_height/LF`) or of an
/// end of the robot (`step_height/fore`).
const STEP_HEIGHT: &str = "step_height";
/// Variable of a controller with the time in which its gait grows to the full size.
const RAMP: &str = "ramp";

/// Returns what the controller with these variables commands.
pub(super) fn of(
    variables: &[ProcessVariable],
    scenario: &Scenario,
    legs: &[LegFact],
    robot: Option<&Robot>,
) -> CommandedGait {
    let value = |name: &str| {
        let variable = variables.iter().find(|variable| variable.name() == name);
        variable.map(ProcessVariable::value)
    };
    let is_of = |name: &str| name.split('/').next() == Some(STEP_HEIGHT);
    let has_any = variables.iter().any(|variable| is_of(variable.name()));
    let changes = scenario
        .changes
        .iter()
        .any(|change| is_of(&change.variable));
    let step_height = |leg: &LegFact| {
        let end = if leg.fore { "fore" } else { "hind" };
        value(&format!("{STEP_HEIGHT}/{}", leg.name))
            .or_else(|| value(&format!("{STEP_HEIGHT}/{end}")))
            .or_else(|| value(STEP_HEIGHT))
            .filter(|_| !changes)
    };
    CommandedGait {
        step_heights: legs.iter().map(step_height).collect(),
        no_step_heights: if changes {
            Some("the run changes the step height".to_owned())
        } else {
            (!has_any).then(|| "the controller has no variable `step_height`".to_owned())
        },
        ramp: value(RAMP).unwrap_or(0.0),
        limits: robot.and_then(|robot| limits(robot, scenario)),
    }
}

/// Returns the limits of the drives of hip and knee; none for ideal drives.
fn limits(robot: &Robot, scenario: &Scenario) -> Option<[DriveLimits; 2]> {
    let actuator = &scenario.actuator;
    match actuator.kind {
        ActuatorKind::Servo => {
            let of = |servo: Servo, by: &ServoOverride| {
                let Servo { speed, torque, .. } = overridden(servo, by);
                DriveLimits { speed, torque }
            };
            let servos = &robot.actuators;
            Some([
                of(servos.hip, &actuator.hip),
                of(servos.knee, &actuator.knee),
            ])
        }
        ActuatorKind::Motor => {
            let motors = robot.motors.as_ref()?;
            Some([motors.hip, motors.knee].map(at_supply))
        }
        ActuatorKind::Serial => {
            let servo = robot.serial.as_ref()?;
            Some([of_serial(servo); 2])
        }
        ActuatorKind::Ideal | ActuatorKind::None => None,
    }
}

/// Returns the torque–speed line of a serial servo with a cold winding, without friction.
fn of_serial(servo: &SerialServo) -> DriveLimits {
    let winding = Winding::new(&servo.motor, &servo.supply);
    let full = Bridge::Duty(servo.controller.duty_limit);
    DriveLimits {
        speed: servo.controller.duty_limit * servo.supply.voltage / servo.motor.torque_constant,
        torque: winding.electric(full, 0.0, 0.0).torque,
    }
}

/// Returns the torque–speed line of a motor at its supply voltage.
fn at_supply(motor: Motor) -> DriveLimits {
    let constant = motor.torque_constant * motor.gear;
    DriveLimits {
        speed: motor.voltage / constant,
        torque: constant * motor.voltage / motor.resistance,
    }
}
