//! How the state changes while what holds goes on holding: the right-hand side of the equations of motion.

use twinrig_legged::Fitted;

use crate::articulated::{
    Accelerations, Articulated, Floating, Response, Row, between, into_world,
};
use crate::constants::Constants;
use crate::constraints::{ActiveConstraints, CABLE, CONSTRAINTS, ConstraintSet, Driven, Give, HIP};
use crate::dense::solve;
use crate::drives::{Commands, Turned, driven, greatest};
use crate::mode::Mode;
use crate::model::Model;
use crate::real::{Real, Wide};
use crate::site::{Footing, Site};
use crate::state::{Slope, State};

/// The memory of a right-hand side.
#[derive(Debug, Clone)]
pub(crate) struct Bench<T, const N: usize> {
    rows: Vec<Row<T, N>>,
    pushes: Vec<Row<T, N>>,
    responses: Vec<Response<T, N>>,
    matrix: Vec<T>,
    pub(crate) forces: Vec<T>,
    /// By row, the share of a normal's mobility that the friction of its slide leaves it; one where nothing slides.
    pub(crate) lifts: Vec<f64>,
}

impl<T, const N: usize> Default for Bench<T, N> {
    fn default() -> Self {
        Self {
            rows: Vec::new(),
            pushes: Vec::new(),
            responses: Vec::new(),
            matrix: Vec::new(),
            forces: Vec::new(),
            lifts: Vec::new(),
        }
    }
}

/// What is felt while things move: forces of what holds inside the legs, torques of the motors.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LegForces<R> {
    pub(crate) forces: [R; CONSTRAINTS],
    pub(crate) hip_torque: R,
    pub(crate) knee_torque: R,
}

/// The right-hand side, with what it was made from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motion<R: Real, const N: usize> {
    pub(crate) slope: Slope<R, N>,
    pub(crate) forces: LegForces<R>,
    pub(crate) articulated: Articulated<R, N>,
    pub(crate) drive: Driven<R>,
}

impl<R: Real, const N: usize> Motion<R, N> {
    /// No motion: room for one.
    pub(crate) fn blank() -> Self {
        Self {
            slope: Slope::zero(),
            forces: LegForces {
                forces: [R::zero(); CONSTRAINTS],
                hip_torque: R::zero(),
                knee_torque: R::zero(),
            },
            articulated: Articulated::blank(),
            drive: Driven::none(),
        }
    }
}

/// A model in numbers of one kind, and what holds of it.
#[derive(Debug, Clone)]
pub(crate) struct Scene<'a, R, const N: usize> {
    pub(crate) model: &'a Model<N>,
    pub(crate) legs: &'a Constants<R, N>,
    pub(crate) mode: &'a Mode,
    pub(crate) active: ActiveConstraints<R>,
    pub(crate) commands: Commands<R>,
    /// How fast errors of constraints are taken back \[1/s\].
    pub(crate) recovery: f64,
}

impl<'a, R: Wide, const N: usize> Scene<'a, R, N> {
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
            commands: mode.commands.raised(),
            recovery,
        }
    }

    /// What the drives do in a state.
    #[inline(always)]
    pub(crate) fn drive(&self, state: &State<R, N>) -> Driven<R> {
        let Some(drives) = &self.model.drives else {
            return Driven::none();
        };
        let turned = Turned {
            hip: state.angles[0],
            hip_rate: state.rates[0],
            pulley: state.pulley,
            pulley_rate: state.pulley_rate,
        };
        driven(drives, &self.commands, &turned)
    }

    /// The right-hand side in a state where no foot stands, and no more than that: what it is made from never leaves the
    /// registers, and half of it is not needed.
    #[inline(always)]
    pub(crate) fn slope_aloft(&self, state: &State<R, N>) -> (Slope<R, N>, LegForces<R>) {
        let drive = self.drive(state);
        let constraint_set = ConstraintSet {
            active: &self.active,
            drive: &drive,
            recovery: R::splat(self.recovery),
            ahead: 0.0,
            any: self.mode.any,
        };
        if self.model.is_free() {
            let articulated = Articulated::new(self.model, self.legs, state, &constraint_set);
            let accelerations = articulated.accelerations();
            let forces = self.feel(&articulated, &accelerations, &drive);
            let mut slope = self.slope(state, &articulated, &accelerations, &drive, &forces);
            slope.dissipated = articulated.chain.friction_power();
            return (slope, forces);
        }
        let (chain, give, torques) = Articulated::legs(self.legs, state, &constraint_set);
        let accelerations = Accelerations {
            trunk: [<R::Sum as Real>::zero(); 6],
            links: give.accelerations(&torques),
            torques,
        };
        let forces = self.feel_legs(&give, &accelerations, &drive);
        let mut slope = self.slope_of(state, None, &accelerations, &drive, &forces);
        slope.dissipated = chain.friction_power();
        (slope, forces)
    }

    /// The right-hand side in a state.
    #[inline(always)]
    pub(crate) fn motion(&self, state: &State<R, N>, bench: &mut Bench<R::Sum, N>) -> Motion<R, N> {
        let mut motion = Motion::blank();
        self.motion_into(state, bench, &mut motion);
        motion
    }

    /// The same in the place of another.
    #[inline(always)]
    pub(crate) fn motion_into(
        &self,
        state: &State<R, N>,
        bench: &mut Bench<R::Sum, N>,
        motion: &mut Motion<R, N>,
    ) {
        let drive = self.drive(state);
        let constraint_set = ConstraintSet {
            active: &self.active,
            drive: &drive,
            recovery: R::splat(self.recovery),
            ahead: 0.0,
            any: self.mode.any,
        };
        let articulated = &mut motion.articulated;
        articulated.renew(self.model, self.legs, state, &constraint_set);
        let mut accelerations = articulated.accelerations();
        let mut dissipated = articulated.chain.friction_power();
        if !self.mode.contacts.is_empty() {
            self.stand(
                state,
                articulated,
                &mut accelerations,
                bench,
                &mut dissipated,
            );
        }
        motion.forces = self.feel(articulated, &accelerations, &drive);
        motion.slope = self.slope(state, articulated, &accelerations, &drive, &motion.forces);
        motion.slope.dissipated = dissipated;
        motion.drive = drive;
    }

    /// How the state changes with these accelerations; what friction takes is left open.
    #[inline(always)]
    pub(crate) fn slope(
        &self,
        state: &State<R, N>,
        articulated: &Articulated<R, N>,
        accelerations: &Accelerations<R, N>,
        drive: &Driven<R>,
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
        drive: &Driven<R>,
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

    /// Forces of what holds, and torques of the motors.
    #[inline(always)]
    pub(crate) fn feel(
        &self,
        articulated: &Articulated<R, N>,
        accelerations: &Accelerations<R, N>,
        drive: &Driven<R>,
    ) -> LegForces<R> {
        self.feel_legs(&articulated.give, accelerations, drive)
    }

    #[inline(always)]
    fn feel_legs(
        &self,
        give: &Give<R, N>,
        accelerations: &Accelerations<R, N>,
        drive: &Driven<R>,
    ) -> LegForces<R> {
        let zero = R::zero();
        let mut forces = LegForces {
            forces: [zero; CONSTRAINTS],
            hip_torque: zero,
            knee_torque: zero,
        };
        if self.mode.any.contains(&true) {
            forces.forces = give.forces(&accelerations.torques);
        }
        match &self.model.drives {
            None => {}
            Some(Fitted::Motors(motors)) => {
                forces.hip_torque = drive.hip_torque;
                forces.knee_torque = R::splat(motors.knee.inertia()) * drive.pulley_acceleration;
            }
            Some(Fitted::Servos(servos)) => {
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
                    + greatest(&servos.knee, hip.pulley_saturated, drive.pulley_rate);
            }
        }
        forces
    }

    /// The feet on the ground: their forces, and what those change.
    fn stand(
        &self,
        state: &State<R, N>,
        articulated: &Articulated<R, N>,
        accelerations: &mut Accelerations<R, N>,
        bench: &mut Bench<R::Sum, N>,
        dissipated: &mut R,
    ) {
        let Some(ground) = &self.model.ground else {
            return;
        };
        let friction = <R::Sum as Real>::splat(ground.friction);
        let upright = articulated.rotation();
        bench.rows.clear();
        bench.pushes.clear();
        bench.responses.clear();
        bench.forces.clear();
        bench.lifts.clear();
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
                let push = match contact.slides {
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
                let back = <R::Sum as Real>::splat(self.recovery);
                let mut missing = -(free + footing.bias[k]) - back * footing.velocity[k];
                if k == 0 {
                    missing -= back * (footing.velocity[0] + back * footing.gap);
                }
                bench.responses.push(articulated.response(&push));
                bench.rows.push(row);
                bench.pushes.push(push);
                bench.forces.push(missing);
                bench
                    .lifts
                    .push(if contact.slides.is_some() { 0.0 } else { 1.0 });
            }
        }
        bench.fill(articulated, self.model.contact_compliance());
        solve(&mut bench.matrix, &mut bench.forces);
        let mut trunk = accelerations.trunk;
        let mut torques = articulated.torques;
        for ((push, response), &force) in
            bench.pushes.iter().zip(&bench.responses).zip(&bench.forces)
        {
            for (a, r) in trunk.iter_mut().zip(&response.trunk) {
                *a += *r * force;
            }
            for (torque, arm) in torques.iter_mut().zip(&push.links) {
                let own = torque.lane(push.leg) + *arm * force;
                *torque = torque.with_lane(push.leg, own);
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
                let taken = friction * bench.forces[next] * speed;
                let own = dissipated.lane(contact.leg) + taken;
                *dissipated = dissipated.with_lane(contact.leg, own);
            }
            next += if contact.slides.is_some() { 1 } else { 3 };
        }
    }
}

impl<T: Real, const N: usize> Bench<T, N> {
    /// The matrix: accelerations along every row by a unit of every force.
    fn fill<R: Wide<Sum = T>>(&mut self, articulated: &Articulated<R, N>, compliance: f64) {
        let n = self.rows.len();
        self.matrix.clear();
        for row in 0..n {
            let response = articulated.response(&self.rows[row]);
            for column in 0..n {
                let mut entry = between(
                    &self.rows[row],
                    &response.pull,
                    &self.pushes[column],
                    &self.responses[column],
                );
                if row == column {
                    if self.lifts[row] == 0.0 {
                        let (upright, pull) = (&self.rows[row], &response.pull);
                        let own = between(upright, pull, upright, &response);
                        self.lifts[row] = entry.plain() / own.plain();
                    }
                    // Constraints that say the same thing twice share their force; one that nothing moves has none.
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
    /// Rotation from trunk to world; none for a trunk that is held.
    pub(crate) fn rotation(&self) -> [[R::Sum; 3]; 3] {
        let (zero, one) = (<R::Sum as Real>::zero(), <R::Sum as Real>::splat(1.0));
        self.base.as_ref().map_or(
            [[one, zero, zero], [zero, one, zero], [zero, zero, one]],
            |base| base.rotation,
        )
    }
}

/// Acceleration along a row, velocities aside.
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

/// The direction in which a foot slides, in the ground's tangents; `last` where it hardly moves, and beyond where a slide
/// has come to its end, so that its end shows.
pub(crate) fn sliding<T: Real>(footing: &Footing<T>, last: [f64; 2]) -> [T; 2] {
    /// Slower than this a foot has no direction of its own \[m/s\].
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
