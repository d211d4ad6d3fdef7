//! The motors of a robot on a bench, out of a scenario's words; and the servos beside a robot that does not abduct.

use twinrig_document::Range;
use twinrig_drives::{Load, MotorBench, Motored, ServoBench, Shaft};
use twinrig_kernel::Unit;
use twinrig_runtime::{CompositePlant, Plant};
use twinrig_scenario::{Accepts, ActuatorKind, OptionSpec};

use crate::error::BuildError;
use crate::parts::option::option;
use crate::parts::plant_kind::{PlantContext, PlantKind};
use crate::parts::setup::motors;

const INERTIA: &str = "load_inertia";
const FRICTION: &str = "load_friction";

pub(crate) fn kind() -> PlantKind {
    let about = "the motors of the robot on a bench, without legs; for [actuator] kind = \"motor\"";
    PlantKind::new("drives", about, drives)
        .with_option(at_shaft(
            INERTIA,
            "inertia at each shaft beside the rotor's (none)",
            Unit::KilogramSquareMeter,
        ))
        .with_option(at_shaft(
            FRICTION,
            "viscous friction of each shaft (none)",
            Unit::NewtonMeterSecondPerRadian,
        ))
}

fn at_shaft(name: &str, about: &str, unit: Unit) -> OptionSpec {
    let range = Range::NOT_NEGATIVE;
    option(name, about, Accepts::Quantity { unit, range })
}

fn drives(context: &PlantContext<'_>) -> Result<MotorBench, BuildError> {
    if context.actuator.kind != ActuatorKind::Motor {
        return Err("it is a bench of motors: write [actuator] kind = \"motor\"".into());
    }
    let motors = motors(context.robot)?;
    let of = |name| context.plant.options.number(name).unwrap_or(0.0);
    let load = Load {
        inertia: of(INERTIA),
        friction: of(FRICTION),
    };
    let motored = Motored {
        legs: context.legs.iter().map(|&leg| leg.to_owned()).collect(),
        hip: Shaft {
            motor: motors.hip,
            load,
        },
        knee: Shaft {
            motor: motors.knee,
            load,
        },
    };
    Ok(MotorBench::new(&motored, context.wanted)?)
}

/// The plant with servos beside it for the abduction of its legs, which no plant of a robot moves; as it is where the
/// controller commands none.
pub(crate) fn with_abduction(
    plant: Box<dyn Plant>,
    context: &PlantContext<'_>,
) -> Result<Box<dyn Plant>, BuildError> {
    let abducted = |leg: &&&str| {
        let name = format!("leg/{leg}/abduction/command");
        let mut commands = context.first_commands.iter();
        commands.any(|(known, _)| *known == name)
    };
    let legs: Vec<String> = context
        .legs
        .iter()
        .filter(abducted)
        .map(|&leg| leg.to_owned())
        .collect();
    if legs.is_empty() {
        return Ok(plant);
    }
    let servo = context.robot.actuators.abduction.as_ref();
    let servo =
        servo.ok_or("the robot file has no [actuator.abduction]: its hips do not abduct")?;
    let servos = ServoBench::new(&legs, servo, context.wanted)?;
    Ok(Box::new(CompositePlant::new(plant, Box::new(servos))?))
}
