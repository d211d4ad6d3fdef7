//! The drives in the mean of a step.

use twinrig_legged::Fitted;

use crate::constraints::Driven;
use crate::drives::line;
use crate::flow::Flow;
use crate::motion::Scene;
use crate::real::{Lanes, Real};
use crate::state::State;

/// The lines of torque over rate on which motors work that impose no acceleration: torque at
/// standstill \[N·m\] and damping \[N·m·s/rad\], of hips and pulleys.
pub(super) type Lines = [[Lanes; 2]; 2];

/// What the drives do over a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Demand {
    pub(super) drive: Driven<Lanes>,
    /// Damping of hip motors that impose no acceleration \[N·m·s/rad\].
    pub(super) hip_damping: Lanes,
}

impl<const N: usize> Flow<N> {
    /// The lines of the motors at these rates of hips and pulleys.
    pub(super) fn lines(&self, rates: [Lanes; 2]) -> Lines {
        let commands = &self.mode.commands;
        match &self.model.drives {
            None => [[Lanes::zero(); 2]; 2],
            Some(Fitted::Servos(servos)) => [
                line(&servos.hip, commands.hip_saturated, rates[0]),
                line(&servos.knee, commands.pulley_saturated, rates[1]),
            ],
            Some(Fitted::Motors(_)) => [
                [commands.hip, commands.hip_damping],
                [commands.pulley, commands.pulley_damping],
            ],
        }
    }

    /// Mean accelerations to the rates that the drives want at the step's end.
    pub(super) fn wanted_over(&self, before: &State<Lanes, N>, seconds: f64) -> [Lanes; 2] {
        let Some(Fitted::Servos(servos)) = &self.model.drives else {
            return [Lanes::zero(); 2];
        };
        let told = [self.mode.commands.hip, self.mode.commands.pulley];
        let at = [before.angles[0], before.pulley];
        let rates = [before.rates[0], before.pulley_rate];
        std::array::from_fn(|i| {
            Lanes::new(std::array::from_fn(|leg| {
                let of = |lanes: &[Lanes; 2]| lanes[i].lane(leg);
                let rate = of(&rates);
                let then = servos.both()[i].rate_after(seconds, of(&told), of(&at), rate);
                (then - rate) / seconds
            }))
        })
    }

    /// What the drives do in the mean of a step. Torques fall with the mean rate, so that what
    /// damps a motor answers to accelerations, like friction in the joints.
    pub(super) fn drive_over(
        &self,
        scene: &Scene<'_, Lanes, N>,
        middle: &State<Lanes, N>,
        wanted: [Lanes; 2],
        lines: &Lines,
        seconds: f64,
    ) -> Demand {
        let mut drive = scene.drive(middle);
        drive.hip_acceleration = wanted[0];
        let [[hip, hip_damping], [knee, knee_damping]] = *lines;
        if let Some(drives) = &self.model.drives {
            let half = Lanes::splat(0.5 * seconds);
            drive.hip_torque = hip - hip_damping * middle.rates[0];
            drive.hip_inertia += half * hip_damping;
            let saturated =
                self.mode.commands.pulley_saturated * self.mode.commands.pulley_saturated;
            let inertia = Lanes::splat(drives.inertias()[1]);
            drive.pulley_mobility = saturated / (inertia + half * knee_damping);
            drive.pulley_acceleration = (Lanes::splat(1.0) - saturated) * wanted[1]
                + (knee - knee_damping * middle.pulley_rate) * drive.pulley_mobility;
        }
        Demand { drive, hip_damping }
    }
}
