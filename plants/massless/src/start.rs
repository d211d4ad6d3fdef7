//! State at the start.

use nalgebra::Vector3;
use twinrig_legged::{DriveModels, Setup};
use twinrig_robot::Robot;

use crate::drives::Inputs;
use crate::model::{MasslessError, Model};
use crate::state::State;

/// State at the start, and inputs that keep servos there; motors coast.
pub(crate) fn start(
    robot: &Robot,
    model: &Model,
    setup: &Setup,
) -> Result<(State, Inputs), MasslessError> {
    let mut state = State::zero();
    state.set_attitude([1.0, 0.0, 0.0, 0.0]);
    let mut inputs = Inputs::default();
    for (i, leg) in model.legs.iter().enumerate() {
        let start = setup.start.of_leg(&leg.name, &leg.pantograph)?;
        let pose = leg.pantograph.pose_of_angles(start.angles);
        let pose = pose.map_err(|error| MasslessError::Start(error.to_string()))?;
        if !leg.pantograph.is_unfolded(&pose) {
            let why = "the ankle is folded up to the second segment, where hip and foot do not determine the pose";
            return Err(MasslessError::Start(format!("leg {}: {why}", leg.name)));
        }
        if let Some(DriveModels::Servos(_)) = model.drives {
            inputs[i][..2].copy_from_slice(&[start.command.hip, start.command.knee]);
        }
        state.set_foot(i, start.foot);
        state.set_hip(i, start.angles[0]);
        state.set_pulley(i, start.command.knee);
        state.set_foot_velocity(i, start.foot_velocity);
        state.set_hip_rate(i, start.rates[0]);
    }
    let height = setup.height(robot, |mount, start| {
        let foot = Vector3::new(start.foot.x, 0.0, start.foot.y);
        Vector3::from(mount.hip) + foot
    })?;
    // The trunk's own centre is above the origin, as on other plants.
    state.set_position(Vector3::z() * height + model.centre);
    Ok((state, inputs))
}
