//! Right-hand side of the equations of motion for constant active constraints.

use twinrig_legged::DriveModels;

use crate::constraints::mode::Mode;
use crate::model::Model;
use crate::model::articulated::{
    Accelerations, Articulated, Floating, Response, Row, cross_mobility, into_world,
};
use crate::model::constants::Constants;
use crate::model::dense::solve;
use crate::model::drives::{Commands, DriveCoordinates, drive_action, saturation_torque};
use crate::model::leg_constraints::{
    ActiveConstraints, CABLE, CONSTRAINTS, ConstraintSet, DriveAction, HIP, LegMobility,
};
use crate::model::real::{Real, Wide};
use crate::model::site::{Footing, Site};
use crate::model::state::{Slope, State};

/// Workspace of a right-hand side.
#[derive(Debug, Clone)]
pub(crate) struct Workspace<T, const N: usize> {
    rows: Vec<Row<T, N>>,
    force_rows: Vec<Row<T, N>>,
    responses: Vec<Response<T, N>>,
    matrix: Vec<T>,
    pub(crate) forces: Vec<T>,
    /// By row, the share of a normal's mobility that sliding friction leaves; one without sliding.
    pub(crate) normal_shares: Vec<f64>,
}

impl<T, const N: usize> Default for Workspace<T, N> {
    fn default() -> Self {
        Self {
            rows: Vec::new(),
            force_rows: Vec::new(),
            responses: Vec::new(),
            matrix: Vec::new(),
            forces: Vec::new(),
            normal_shares: Vec::new(),
        }
    }
}

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
            let articulated = Articulated::new(self.model, self.legs, state, &constraint_set);
            let accelerations = articulated.accelerations();
            let forces = self.leg_forces(&articulated, &accelerations, &drive);
            let mut slope = self.slope(state, &articulated, &accelerations, &drive, &forces);
            slope.dissipated = articulated.chain.friction_power();
            return (slope, forces);
        }
        let (chain, mobility, torques) = Articulated::legs(self.legs, state, &constraint_set);
        let accelerations = Accelerations {
            trunk: [<R::Sum as Real>::zero(); 6],
            links: mobility.accelerations(&torques),
            torques,
        };
        let forces = self.leg_forces_of(&mobility, &accelerations, &drive);
        let mut slope = self.slope_of(state, None, &accelerations, &drive, &forces);
        slope.dissipated = chain.friction_power();
        (slope, forces)
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
        articulated.renew(self.model, self.legs, state, &constraint_set);
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

    /// Solves for the contact forces and adds their effect to accelerations and dissipated power.
    fn add_contact_forces(
        &self,
        state: &State<R, N>,
        articulated: &Articulated<R, N>,
        accelerations: &mut Accelerations<R, N>,
        workspace: &mut Workspace<R::Sum, N>,
        dissipated: &mut R,
    ) {
        let Some(ground) = &self.model.ground else {
            return;
        };
        let friction = <R::Sum as Real>::splat(ground.friction);
        let upright = articulated.rotation();
        workspace.rows.clear();
        workspace.force_rows.clear();
        workspace.responses.clear();
        workspace.forces.clear();
        workspace.normal_shares.clear();
        for contact in &self.mode.contacts {
            let site = Site::new(
                self.legs,
                &articulated.chain,
                state,
                contact.leg,
                contact.links,
            );
            let footing = site.footing(ground, state.position, &upright);
            let count = if contact.slides.is_some() { 1 } else { 3 };
            for k in 0..count {
                let row = site.row(footing.directions[k]);
                let force_row = match contact.slides {
                    Some(last) => {
                        let slide = sliding(&footing, last);
                        let [n, a, b] = footing.directions;
                        site.row(std::array::from_fn(|i| {
                            n[i] - friction * (slide[0] * a[i] + slide[1] * b[i])
                        }))
                    }
                    None => row,
                };
                let free = row_acceleration(&row, accelerations);
                let recovery = <R::Sum as Real>::splat(self.recovery);
                let mut missing = -(free + footing.bias[k]) - recovery * footing.velocity[k];
                if k == 0 {
                    missing -= recovery * (footing.velocity[0] + recovery * footing.gap);
                }
                workspace.responses.push(articulated.response(&force_row));
                workspace.rows.push(row);
                workspace.force_rows.push(force_row);
                workspace.forces.push(missing);
                workspace
                    .normal_shares
                    .push(if contact.slides.is_some() { 0.0 } else { 1.0 });
            }
        }
        workspace.fill(articulated, self.model.contact_compliance());
        solve(&mut workspace.matrix, &mut workspace.forces);
        let mut trunk = accelerations.trunk;
        let mut torques = articulated.torques;
        for ((force_row, response), &force) in workspace
            .force_rows
            .iter()
            .zip(&workspace.responses)
            .zip(&workspace.forces)
        {
            for (a, r) in trunk.iter_mut().zip(&response.trunk) {
                *a += *r * force;
            }
            for (torque, arm) in torques.iter_mut().zip(&force_row.links) {
                let sum = torque.lane(force_row.leg) + *arm * force;
                *torque = torque.with_lane(force_row.leg, sum);
            }
        }
        *accelerations = articulated.with_trunk(trunk, &torques);
        let mut next = 0;
        for contact in &self.mode.contacts {
            if let Some(last) = contact.slides {
                let site = Site::new(
                    self.legs,
                    &articulated.chain,
                    state,
                    contact.leg,
                    contact.links,
                );
                let footing = site.footing(ground, state.position, &upright);
                let slide = sliding(&footing, last);
                let speed = slide[0] * footing.velocity[1] + slide[1] * footing.velocity[2];
                let friction_power = friction * workspace.forces[next] * speed;
                let sum = dissipated.lane(contact.leg) + friction_power;
                *dissipated = dissipated.with_lane(contact.leg, sum);
            }
            next += if contact.slides.is_some() { 1 } else { 3 };
        }
    }
}

impl<T: Real, const N: usize> Workspace<T, N> {
    /// Fills the matrix: accelerations along each row by unit forces.
    fn fill<R: Wide<Sum = T>>(&mut self, articulated: &Articulated<R, N>, compliance: f64) {
        let n = self.rows.len();
        self.matrix.clear();
        for row in 0..n {
            let response = articulated.response(&self.rows[row]);
            for column in 0..n {
                let mut entry = cross_mobility(
                    &self.rows[row],
                    &response.pull,
                    &self.force_rows[column],
                    &self.responses[column],
                );
                if row == column {
                    if self.normal_shares[row] == 0.0 {
                        let (upright, pull) = (&self.rows[row], &response.pull);
                        let normal = cross_mobility(upright, pull, upright, &response);
                        self.normal_shares[row] = entry.plain() / normal.plain();
                    }
                    // Redundant constraints share their force; a row without mobility has none.
                    entry += T::splat(compliance);
                    if entry.plain() <= compliance {
                        entry = T::splat(1.0);
                        self.forces[row] = T::zero();
                    }
                }
                self.matrix.push(entry);
            }
        }
    }
}

impl<R: Real, const N: usize> Articulated<R, N> {
    /// Returns the rotation from trunk to world; the identity for a fixed trunk.
    pub(crate) fn rotation(&self) -> [[R::Sum; 3]; 3] {
        let (zero, one) = (<R::Sum as Real>::zero(), <R::Sum as Real>::splat(1.0));
        self.base.as_ref().map_or(
            [[one, zero, zero], [zero, one, zero], [zero, zero, one]],
            |base| base.rotation,
        )
    }
}

/// Returns the acceleration along a row without velocity terms.
fn row_acceleration<R: Real, const N: usize>(
    row: &Row<R::Sum, N>,
    accelerations: &Accelerations<R, N>,
) -> R::Sum {
    let mut sum = <R::Sum as Real>::zero();
    for (j, a) in row.trunk.iter().zip(&accelerations.trunk) {
        sum += *j * *a;
    }
    for (j, a) in row.links.iter().zip(&accelerations.links) {
        sum += *j * a.lane(row.leg);
    }
    sum
}

/// Returns the direction in which a foot slides, in the tangents of the ground. It is `last` at
/// small speeds, and after a reversal, so that the guard observes the sign change.
pub(crate) fn sliding<T: Real>(footing: &Footing<T>, last: [f64; 2]) -> [T; 2] {
    /// Speed below which the direction is undefined \[m/s\].
    const STILL: f64 = 1e-7;
    let [_, a, b] = footing.velocity;
    let speed = (a * a + b * b).sqrt();
    let onward = a.plain() * last[0] + b.plain() * last[1];
    if speed.plain() < STILL || onward <= 0.0 {
        last.map(T::splat)
    } else {
        [a / speed, b / speed]
    }
}

#[inline(always)]
pub(crate) fn quaternion_rate<T: Real>([w, x, y, z]: [T; 4], turning: [T; 3]) -> [T; 4] {
    let half = T::splat(0.5);
    let [p, q, r] = turning.map(|rate| half * rate);
    [
        -(x * p + y * q + z * r),
        w * p + y * r - z * q,
        w * q + z * p - x * r,
        w * r + x * q - y * p,
    ]
}
