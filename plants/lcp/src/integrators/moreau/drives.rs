//! Mean action of the drives over a step.

use twinrig_legged::DriveModels;

use crate::constraints::motion::Dynamics;
use crate::model::Model;
use crate::model::drives::{Commands, torque_speed_line};
use crate::model::leg_constraints::DriveAction;
use crate::model::real::{Lanes, Real};
use crate::model::state::State;

/// Torque–speed lines of motors that impose no acceleration: stall torque \[N·m\] and damping
/// \[N·m·s/rad\], of hips and pulleys.
pub(super) type TorqueSpeedLines = [[Lanes; 2]; 2];

/// Action of the drives over a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct MeanDrive {
    pub(super) drive: DriveAction<Lanes>,
    /// Damping of hip motors that impose no acceleration \[N·m·s/rad\].
    pub(super) hip_damping: Lanes,
}

/// Returns the torque–speed lines of the motors at these rates of hips and pulleys.
pub(super) fn torque_speed_lines<const N: usize>(
    model: &Model<N>,
    commands: &Commands<Lanes>,
    rates: [Lanes; 2],
) -> TorqueSpeedLines {
    match &model.drives {
        None => [[Lanes::zero(); 2]; 2],
        Some(DriveModels::Servos(servos)) => [
            torque_speed_line(&servos.hip, commands.hip_saturated, rates[0]),
            torque_speed_line(&servos.knee, commands.pulley_saturated, rates[1]),
        ],
        Some(DriveModels::Motors(_)) => [
            [commands.hip, commands.hip_damping],
            [commands.pulley, commands.pulley_damping],
        ],
    }
}

/// Returns the mean accelerations to the rates commanded at the end of the step.
pub(super) fn mean_commanded<const N: usize>(
    model: &Model<N>,
    commands: &Commands<Lanes>,
    before: &State<Lanes, N>,
    seconds: f64,
) -> [Lanes; 2] {
    let Some(DriveModels::Servos(servos)) = &model.drives else {
        return [Lanes::zero(); 2];
    };
    let commands = [commands.hip, commands.pulley];
    let at = [before.angles[0], before.pulley];
    let rates = [before.rates[0], before.pulley_rate];
    std::array::from_fn(|i| {
        Lanes::new(std::array::from_fn(|leg| {
            let of = |lanes: &[Lanes; 2]| lanes[i].lane(leg);
            let rate = of(&rates);
            let then = servos.both()[i].rate_after(seconds, of(&commands), of(&at), rate);
            (then - rate) / seconds
        }))
    })
}

/// Returns the mean action of the drives over a step. Torques fall with the mean rate, so that
/// the damping of a motor is implicit in the accelerations, like joint friction.
pub(super) fn drive_over<const N: usize>(
    dynamics: &Dynamics<'_, Lanes, N>,
    middle: &State<Lanes, N>,
    commanded: [Lanes; 2],
    lines: &TorqueSpeedLines,
    seconds: f64,
) -> MeanDrive {
    let mut drive = dynamics.drive(middle);
    drive.hip_acceleration = commanded[0];
    let [[hip, hip_damping], [knee, knee_damping]] = *lines;
    if let Some(drives) = &dynamics.model.drives {
        let half = Lanes::splat(0.5 * seconds);
        drive.hip_torque = hip - hip_damping * middle.rates[0];
        drive.hip_inertia += half * hip_damping;
        let saturated =
            dynamics.mode.commands.pulley_saturated * dynamics.mode.commands.pulley_saturated;
        let inertia = Lanes::splat(drives.inertias()[1]);
        drive.pulley_mobility = saturated / (inertia + half * knee_damping);
        drive.pulley_acceleration = (Lanes::splat(1.0) - saturated) * commanded[1]
            + (knee - knee_damping * middle.pulley_rate) * drive.pulley_mobility;
    }
    MeanDrive { drive, hip_damping }
}
