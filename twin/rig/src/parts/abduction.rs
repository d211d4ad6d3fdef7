//! Hip-abduction servos beside a plant whose joints of abduction are locked.

use twinrig_actuator::drives::ServoBench;
use twinrig_kernel::{Port, signal};
use twinrig_runtime::{CompositePlant, Plant};
use twinrig_scenario::Abduction;

use crate::error::BuildError;
use crate::parts::context::PlantContext;
use crate::parts::setup::set_point;

/// Returns the simulated legs whose hip abduction the controller commands while the joints are
/// locked.
fn abducted_legs(context: &PlantContext<'_>) -> Vec<String> {
    if context.plant.abduction == Abduction::Free {
        return Vec::new();
    }
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

/// Combines the plant with servos for locked hip abduction; returns the plant itself if the
/// controller does not command abduction, or if the joints are not locked.
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
