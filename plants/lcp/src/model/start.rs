//! Start state of a robot.

use nalgebra::Vector3;
use twinrig_legged::Setup;
use twinrig_robot::Robot;

use super::Model;
use super::real::{Lanes, Real};
use super::state::State;
use crate::options::{LcpError, Options};

/// Returns the start state: a taut cable, and toes without load.
pub(crate) fn start_state<const N: usize>(
    model: &Model<N>,
    robot: &Robot,
    options: &Options,
) -> Result<State<Lanes, N>, LcpError> {
    let setup = &options.setup;
    let zero = Lanes::zero();
    let mut state = State {
        position: [0.0, 0.0, height::<N>(robot, setup)?],
        attitude: [1.0, 0.0, 0.0, 0.0],
        velocity: [0.0; 3],
        turning: [0.0; 3],
        angles: [zero; N],
        rates: [zero; N],
        pulley: zero,
        pulley_rate: zero,
    };
    for (i, leg) in model.legs.iter().enumerate() {
        let start = setup.start.of_leg(&leg.name, &leg.pantograph)?;
        for k in 0..N {
            // An unloaded toe follows the third segment.
            let (angle, rate) = if k < 3 {
                (start.angles[k], start.rates[k])
            } else {
                (start.angles[2] + leg.constants.toe[1], start.rates[2])
            };
            state.angles[k] = state.angles[k].with_lane(i, angle);
            state.rates[k] = state.rates[k].with_lane(i, rate);
        }
        state.pulley = state.pulley.with_lane(i, start.command.knee);
    }
    Ok(state)
}

/// Returns the initial height of the trunk \[m\].
fn height<const N: usize>(robot: &Robot, setup: &Setup) -> Result<f64, LcpError> {
    let lowest = |mount: &twinrig_robot::LegMount, start: &twinrig_legged::LegStart| {
        let foot = Vector3::from(mount.hip) + Vector3::new(start.foot.x, 0.0, start.foot.y);
        let Some(toe) = mount.leg.toe.filter(|_| N > 3) else {
            return foot;
        };
        let angle = start.angles[2] + toe.rest;
        let tip = foot + Vector3::new(libm::sin(angle), 0.0, -libm::cos(angle)) * toe.length;
        if tip.z < foot.z { tip } else { foot }
    };
    Ok(setup.height(robot, lowest)?)
}
