//! Plant of the robot's motors on a test bench, from scenario options.

use twinrig_actuator::drives::{BenchMotors, Load, MotorBench, Shaft};
use twinrig_document::Range;
use twinrig_kernel::Unit;
use twinrig_scenario::{Accepts, ActuatorKind, OptionSpec};

use crate::error::BuildError;
use crate::parts::context::PlantContext;
use crate::parts::option::option;
use crate::parts::plant_kind::PlantKind;
use crate::parts::setup::motors;

const INERTIA: &str = "load_inertia";
const FRICTION: &str = "load_friction";

pub(crate) fn kind() -> PlantKind {
    let about =
        "motors of the robot on a test bench, without legs; for [actuator] kind = \"motor\"";
    PlantKind::new("drives", about, drives)
        .exact()
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
