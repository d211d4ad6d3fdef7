//! Mean action of the drives over a step.

use twinrig_legged::DriveModels;

use super::solved_step::SolvedStep;
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

/// Hips over a step.
pub(super) struct Hip {
    /// Rates before and after the forces in the middle.
    pub(super) rates: [Lanes; 2],
    pub(super) acceleration: Lanes,
    /// Damping of motors that impose no acceleration \[N·m·s/rad\].
    pub(super) damping: Lanes,
    /// Torque that imposes the acceleration of the other motors \[N·m\].
    pub(super) imposed_torque: Lanes,
    /// Changes of momentum in the half steps before and after, due to the change of the legs'
    /// configuration \[kg·m²/s\].
    pub(super) momentum_change: [Lanes; 2],
}

/// Computes the torques of the motors, mean over a step, and the work of the hip motors.
pub(super) fn drive_torques<const N: usize>(
    dynamics: &Dynamics<'_, Lanes, N>,
    solved: &mut SolvedStep<N>,
    drive: &DriveAction<Lanes>,
    hip: &Hip,
    winding: Lanes,
    seconds: f64,
) {
    let Some(drives) = &dynamics.model.drives else {
        return;
    };
    let h = Lanes::splat(seconds);
    let inertia = drives.inertias().map(Lanes::splat);
    let lost = Lanes::splat(0.5 * seconds) * hip.damping;
    let mut torque = drive.hip_torque - lost * hip.acceleration;
    solved.hip_work = h * torque * solved.mean[0];
    if let DriveModels::Servos(_) = drives {
        let saturated = dynamics.mode.commands.hip_saturated;
        let follows = Lanes::splat(1.0) - saturated * saturated;
        let kick = h * (inertia[0] * hip.acceleration + hip.imposed_torque);
        let ([behind, beyond], [first, last]) = (hip.momentum_change, hip.rates);
        torque += follows * (behind + kick + beyond) / h;
        solved.hip_work += follows * (behind * first + kick * solved.mean[0] + beyond * last);
    }
    let radius = dynamics.legs.pulley_radius;
    solved.torques = [torque, inertia[1] * winding + radius * solved.tension];
}
