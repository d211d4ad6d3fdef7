//! Plant of the robot's motors on a test bench, and the hip-abduction servos of a composite plant,
//! from scenario options.

use twinrig_document::Range;
use twinrig_drives::{BenchMotors, Load, MotorBench, ServoBench, Shaft};
use twinrig_kernel::{Port, Unit, signal};
use twinrig_runtime::{CompositePlant, Plant};
use twinrig_scenario::{Accepts, ActuatorKind, OptionSpec};

use crate::error::BuildError;
use crate::parts::option::option;
use crate::parts::plant_kind::{PlantContext, PlantKind};
use crate::parts::setup::{motors, set_point};

const INERTIA: &str = "load_inertia";
const FRICTION: &str = "load_friction";

pub(crate) fn kind() -> PlantKind {
    let about =
        "motors of the robot on a test bench, without legs; for [actuator] kind = \"motor\"";
    PlantKind::new("drives", about, drives)
        .with_ports(|context| Ok(MotorBench::ports_of(&legs(context))))
        .with_option(at_shaft(
            INERTIA,
            "load inertia of each shaft in addition to the rotor's (none)",
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

fn legs(context: &PlantContext<'_>) -> Vec<String> {
    context.legs.iter().map(|&leg| leg.to_owned()).collect()
}

fn drives(context: &PlantContext<'_>) -> Result<MotorBench, BuildError> {
    if context.actuator.kind != ActuatorKind::Motor {
        return Err("it simulates motors only: write [actuator] kind = \"motor\"".into());
    }
    let motors = motors(context.robot)?;
    let of = |name| context.plant.options.number(name).unwrap_or(0.0);
    let load = Load {
        inertia: of(INERTIA),
        friction: of(FRICTION),
    };
    let bench_motors = BenchMotors {
        legs: legs(context),
        hip: Shaft {
            motor: motors.hip,
            load,
        },
        knee: Shaft {
            motor: motors.knee,
            load,
        },
    };
    Ok(MotorBench::new(&bench_motors, context.wanted)?)
}

/// Returns the simulated legs whose hip abduction the controller commands.
fn abducted_legs(context: &PlantContext<'_>) -> Vec<String> {
    let abducted = |leg: &&&str| {
        let name = signal::command(leg, "abduction");
        let mut commands = context.first_commands.iter();
        commands.any(|(known, _)| *known == name)
    };
    let legs = context.legs.iter().filter(abducted);
    legs.map(|&leg| leg.to_owned()).collect()
}

/// Returns the ports of the hip-abduction servos; empty if the controller does not command them.
pub(crate) fn abduction_ports(context: &PlantContext<'_>) -> Vec<Port> {
    ServoBench::ports_of(&abducted_legs(context))
}

/// Combines the plant with servos for hip abduction, which no plant simulates; returns the plant
/// itself if the controller does not command abduction.
pub(crate) fn with_abduction(
    plant: Box<dyn Plant>,
    context: &PlantContext<'_>,
) -> Result<Box<dyn Plant>, BuildError> {
    let legs = abducted_legs(context);
    if legs.is_empty() {
        return Ok(plant);
    }
    let servo = context.robot.actuators.abduction.as_ref();
    let servo = servo
        .ok_or("the robot file has no [actuator.abduction]: hip abduction is not available")?;
    let servos = ServoBench::new(&legs, servo, context.wanted)?;
    let servos = servos.with_set_point(set_point(context));
    Ok(Box::new(CompositePlant::new(plant, Box::new(servos))?))
}
