//! Right-hand side of the equations of motion for constant active constraints.

use twinrig_legged::DriveModels;

use super::mode::Mode;
use super::workspace::Workspace;
use crate::model::Model;
use crate::model::articulated::{Accelerations, Articulated, Floating};
use crate::model::chain::Chain;
use crate::model::constants::Constants;
use crate::model::drives::{Commands, DriveCoordinates, drive_action, saturation_torque};
use crate::model::elimination::{ConstraintSet, LegMobility};
use crate::model::leg_constraints::{ActiveConstraints, CABLE, CONSTRAINTS, DriveAction, HIP};
use crate::model::load::Load;
use crate::model::real::{Real, Wide};
use crate::model::rotation::{Rotation, identity, into_world, quaternion_rate};
use crate::model::state::{Slope, State};

/// Forces inside the legs during motion: constraint forces and motor torques.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LegForces<R> {
    pub(crate) forces: [R; CONSTRAINTS],
    pub(crate) hip_torque: R,
    pub(crate) knee_torque: R,
}

/// Right-hand side with its intermediate results.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motion<R: Real, const N: usize> {
    pub(crate) slope: Slope<R, N>,
    pub(crate) forces: LegForces<R>,
    pub(crate) articulated: Articulated<R, N>,
    pub(crate) drive: DriveAction<R>,
}

impl<R: Real, const N: usize> Motion<R, N> {
    /// Zero-initialised storage.
    pub(crate) fn blank() -> Self {
        Self {
            slope: Slope::zero(),
            forces: LegForces {
                forces: [R::zero(); CONSTRAINTS],
                hip_torque: R::zero(),
                knee_torque: R::zero(),
            },
            articulated: Articulated::blank(),
            drive: DriveAction::none(),
        }
    }
}

/// Dynamics of a model in one number type, with the active constraints of a mode.
#[derive(Debug, Clone)]
pub(crate) struct Dynamics<'a, R, const N: usize> {
    pub(crate) model: &'a Model<N>,
    pub(crate) legs: &'a Constants<R, N>,
    pub(crate) mode: &'a Mode,
    pub(crate) active: ActiveConstraints<R>,
    pub(crate) commands: Commands<R>,
    pub(crate) load: Option<Load<R>>,
    /// Decay rate of constraint errors \[1/s\].
    pub(crate) recovery: f64,
}

impl<'a, R: Wide, const N: usize> Dynamics<'a, R, N> {
    pub(crate) fn new(
        model: &'a Model<N>,
        legs: &'a Constants<R, N>,
        mode: &'a Mode,
        recovery: f64,
    ) -> Self {
        Self {
            model,
            legs,
            mode,
            active: mode.active.map(|&lanes| R::of(lanes)),
            commands: mode.commands.widened(),
            load: mode.load.as_ref().map(Load::new),
            recovery,
        }
    }

    /// Returns the action of the drives in a state.
    #[inline(always)]
    pub(crate) fn drive(&self, state: &State<R, N>) -> DriveAction<R> {
        let Some(drives) = &self.model.drives else {
            return DriveAction::none();
        };
        let coordinates = DriveCoordinates {
            hip: state.angles[0],
            hip_rate: state.rates[0],
            pulley: state.pulley,
            pulley_rate: state.pulley_rate,
        };
        drive_action(drives, &self.commands, &coordinates)
    }

    /// Returns the right-hand side in a state without contacts, and no intermediate results, which
    /// stay in registers or are not computed.
    #[inline(always)]
    pub(crate) fn slope_without_contacts(
        &self,
        state: &State<R, N>,
    ) -> (Slope<R, N>, LegForces<R>) {
        let drive = self.drive(state);
        let constraint_set = ConstraintSet {
            active: &self.active,
            drive: &drive,
            recovery: R::splat(self.recovery),
            implicit_seconds: 0.0,
            any: self.mode.any,
        };
        if self.model.is_free() {
            let load = self.load.as_ref();
            let articulated = Articulated::new(self.model, self.legs, state, &constraint_set, load);
            let accelerations = articulated.accelerations();
            let forces = self.leg_forces(&articulated, &accelerations, &drive);
            let mut slope = self.slope(state, &articulated, &accelerations, &drive, &forces);
            slope.dissipated = articulated.chain.friction_power();
            slope.external = self.push_power(state, &articulated.chain, articulated.rotation());
            return (slope, forces);
        }
        let load = self.load.as_ref();
        let (chain, mobility, torques) = Articulated::legs(self.legs, state, &constraint_set, load);
        let accelerations = Accelerations {
            trunk: [<R::Sum as Real>::zero(); 6],
            links: mobility.accelerations(&torques),
            torques,
        };
        let forces = self.leg_forces_of(&mobility, &accelerations, &drive);
        let mut slope = self.slope_of(state, None, &accelerations, &drive, &forces);
        slope.dissipated = chain.friction_power();
        slope.external = self.push_power(state, &chain, identity());
        (slope, forces)
    }

    /// Returns the power of pushes \[W\].
    #[inline(always)]
    fn push_power(
        &self,
        state: &State<R, N>,
        chain: &Chain<R, N>,
        rotation: Rotation<R::Sum>,
    ) -> R {
        let Some(load) = &self.load else {
            return R::zero();
        };
        let turns = [&chain.sines, &chain.cosines];
        load.forces(self.legs, turns, &rotation).power(state)
    }

    /// Returns the right-hand side in a state.
    #[inline(always)]
    pub(crate) fn motion(
        &self,
        state: &State<R, N>,
        workspace: &mut Workspace<R::Sum, N>,
    ) -> Motion<R, N> {
        let mut motion = Motion::blank();
        self.motion_into(state, workspace, &mut motion);
        motion
    }

    /// Computes the same in place.
    #[inline(always)]
    pub(crate) fn motion_into(
        &self,
        state: &State<R, N>,
        workspace: &mut Workspace<R::Sum, N>,
        motion: &mut Motion<R, N>,
    ) {
        let drive = self.drive(state);
        let constraint_set = ConstraintSet {
            active: &self.active,
            drive: &drive,
            recovery: R::splat(self.recovery),
            implicit_seconds: 0.0,
            any: self.mode.any,
        };
        let articulated = &mut motion.articulated;
        let load = self.load.as_ref();
        articulated.update(self.model, self.legs, state, &constraint_set, load);
        let mut accelerations = articulated.accelerations();
        let mut dissipated = articulated.chain.friction_power();
        if !self.mode.contacts.is_empty() {
            self.add_contact_forces(
                state,
                articulated,
                &mut accelerations,
                workspace,
                &mut dissipated,
            );
        }
        motion.forces = self.leg_forces(articulated, &accelerations, &drive);
        motion.slope = self.slope(state, articulated, &accelerations, &drive, &motion.forces);
        motion.slope.dissipated = dissipated;
        motion.slope.external = self.push_power(state, &articulated.chain, articulated.rotation());
        motion.drive = drive;
    }

    /// Returns the slope of the state under these accelerations; the dissipated power is left at
    /// zero.
    #[inline(always)]
    pub(crate) fn slope(
        &self,
        state: &State<R, N>,
        articulated: &Articulated<R, N>,
        accelerations: &Accelerations<R, N>,
        drive: &DriveAction<R>,
        forces: &LegForces<R>,
    ) -> Slope<R, N> {
        self.slope_of(
            state,
            articulated.base.as_ref(),
            accelerations,
            drive,
            forces,
        )
    }

    #[inline(always)]
    fn slope_of(
        &self,
        state: &State<R, N>,
        base: Option<&Floating<R, N>>,
        accelerations: &Accelerations<R, N>,
        drive: &DriveAction<R>,
        forces: &LegForces<R>,
    ) -> Slope<R, N> {
        let mut slope = Slope::zero();
        slope.angles = state.rates;
        slope.rates = accelerations.links;
        if self.model.drives.is_some() {
            slope.pulley = state.pulley_rate;
            slope.pulley_rate = drive.pulley_acceleration
                - drive.pulley_mobility * self.legs.pulley_radius * forces.forces[CABLE];
            slope.actuator =
                forces.hip_torque * state.rates[0] + forces.knee_torque * state.pulley_rate;
        }
        if let Some(base) = base {
            let trunk = accelerations.trunk;
            slope.position = into_world(&base.rotation, state.velocity);
            slope.attitude = quaternion_rate(state.attitude, state.turning);
            slope.velocity = [trunk[0], trunk[1], trunk[2]];
            slope.turning = [trunk[3], trunk[4], trunk[5]];
        }
        slope
    }

    /// Returns constraint forces and motor torques.
    #[inline(always)]
    pub(crate) fn leg_forces(
        &self,
        articulated: &Articulated<R, N>,
        accelerations: &Accelerations<R, N>,
        drive: &DriveAction<R>,
    ) -> LegForces<R> {
        self.leg_forces_of(&articulated.mobility, accelerations, drive)
    }

    #[inline(always)]
    fn leg_forces_of(
        &self,
        mobility: &LegMobility<R, N>,
        accelerations: &Accelerations<R, N>,
        drive: &DriveAction<R>,
    ) -> LegForces<R> {
        let zero = R::zero();
        let mut forces = LegForces {
            forces: [zero; CONSTRAINTS],
            hip_torque: zero,
            knee_torque: zero,
        };
        if self.mode.any.contains(&true) {
            forces.forces = mobility.forces(&accelerations.torques);
        }
        match &self.model.drives {
            None => {}
            Some(DriveModels::Motors(motors)) => {
                forces.hip_torque = drive.hip_torque;
                forces.knee_torque = R::splat(motors.knee.inertia()) * drive.pulley_acceleration;
            }
            Some(DriveModels::Servos(servos)) => {
                let one = R::splat(1.0);
                let hip = &self.commands;
                let follows = one - hip.hip_saturated * hip.hip_saturated;
                forces.hip_torque = drive.hip_torque
                    + follows
                        * (R::splat(servos.hip.inertia()) * accelerations.links[0]
                            + forces.forces[HIP]);
                let follows = one - hip.pulley_saturated * hip.pulley_saturated;
                forces.knee_torque = follows
                    * (R::splat(servos.knee.inertia()) * drive.pulley_acceleration
                        + self.legs.pulley_radius * forces.forces[CABLE])
                    + saturation_torque(&servos.knee, hip.pulley_saturated, drive.pulley_rate);
            }
        }
        forces
    }
}
