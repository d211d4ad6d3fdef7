//! One step in time: fixed-point iteration for its end.

use twinrig_legged::LEGS;

use crate::drives::DriveStep;
use crate::flow::{Flow, ground_force};
use crate::flow_error::FlowError;
use crate::midpoint::advance_positions;
use crate::mobility::Mobility;
use crate::model::Method;
use crate::motion::Motion;
use crate::state::State;

/// Maximum number of iterates of a step's end. The error of each is (ωh/2)² times that of the one
/// before: a hundredth for the stiffest mode of the leg at a step of 2 ms.
const ITERATES_MAX: u32 = 12;

/// Tolerance of the springs' energy defect, as a share of the robot's weight times its leg length:
/// 2e-8 J for Cheetah-cub, which exchanges 0.03 J in a millisecond of trot. The next step
/// compensates the defect, so defects do not accumulate.
const ENERGY_TOLERANCE: f64 = 1e-8;

/// Tolerance of the distance of an iterate from the limit of the iteration, as a share of the
/// robot's leg length: 0.4 µm for Cheetah-cub. The energy defect is no measure of the error of
/// friction where springs hardly move.
const DISTANCE_TOLERANCE: f64 = 3e-6;

/// Multiples of [`ENERGY_TOLERANCE`] and [`DISTANCE_TOLERANCE`] that are accepted after the last
/// iterate; beyond these the step is subdivided.
const ENERGY_EXCESS_MAX: f64 = 1e3;
const DISTANCE_EXCESS_MAX: f64 = 10.0;

/// Limit of the extrapolated distance, in units of the last increment: an iteration that contracts
/// by less than a tenth may oscillate.
const EXTRAPOLATION_MAX: f64 = 10.0;

/// Stiffness of the joints' friction ([`Flow::stiffness`]) above which it becomes a part of the
/// inertia, and below which it is iterated again. With the friction of the robot file it is at most
/// 0.14 in a trot at 2 ms.
const STIFFNESS_ON: f64 = 0.2;
const STIFFNESS_OFF: f64 = 0.15;

/// Steps between two evaluations of the stiffness; a pose changes little in these.
const STIFFNESS_INTERVAL: u64 = 8;

/// Stiffness of the force that compensates energy defects, as a share of the robot's weight over
/// its leg length.
const CORRECTION_STIFFNESS: f64 = 0.1;

/// Greatest penetration of a landing foot in a step of the plant, over the length of the step
/// \[m/s\]. Positions advance by the mean of the velocities before and after, so a foot that
/// arrives at twice this speed penetrates by as much.
const PENETRATION_RATE_MAX: f64 = 0.05;

/// Shortest step for a landing: the plant's step over this number.
const LANDING_SUBDIVISIONS_MAX: f64 = 64.0;

/// Convergence of the iteration.
#[derive(Debug, Clone, Copy, Default)]
struct Convergence {
    /// Energy defect of the springs, in units of its tolerance.
    energy_defect: f64,
    /// Increment of the last iterate, in leg lengths.
    increment: f64,
    /// Extrapolated distance to the limit, in units of its tolerance.
    distance: f64,
}

impl Convergence {
    /// Next state of convergence, for an energy defect and the increment of the next iterate, in
    /// leg lengths.
    fn next(self, energy_defect: f64, increment: f64) -> Self {
        // The remaining distance is the sum of a geometric series.
        let ratio = increment / self.increment;
        let factor = if ratio < 1.0 {
            (ratio / (1.0 - ratio)).min(EXTRAPOLATION_MAX)
        } else {
            EXTRAPOLATION_MAX
        };
        Self {
            energy_defect,
            increment,
            distance: if increment == 0.0 {
                0.0
            } else {
                increment * factor / DISTANCE_TOLERANCE
            },
        }
    }

    fn is_converged(self) -> bool {
        self.energy_defect < 1.0 && self.distance < 1.0
    }

    fn is_acceptable(self) -> bool {
        self.energy_defect <= ENERGY_EXCESS_MAX && self.distance <= DISTANCE_EXCESS_MAX
    }
}

/// Converged end of a step.
pub(crate) struct StepEnd {
    pub(crate) after: State,
    pub(crate) energy_defect: [f64; LEGS],
    pub(crate) torques: [[f64; 2]; LEGS],
}

impl Flow {
    /// Advances by a step of the midpoint rule: energy-conserving springs, constraints at velocity
    /// level, friction by the velocity at the end.
    pub(crate) fn step(&mut self, seconds: f64) -> Result<(), FlowError> {
        if !self.damped {
            let iterated = self.iterate(seconds, false);
            match iterated.and_then(|end| self.finish(&end, seconds)) {
                Ok(()) => {
                    if self.counts.steps.is_multiple_of(STIFFNESS_INTERVAL) {
                        self.damped = self.stiffness(seconds) > STIFFNESS_ON;
                    }
                    return Ok(());
                }
                Err(error) if !self.is_friction_stiff(seconds) => return Err(error),
                Err(_) => {}
            }
        }
        let end = self.iterate(seconds, true)?;
        self.finish(&end, seconds)?;
        if self.counts.steps.is_multiple_of(STIFFNESS_INTERVAL) && self.model.drives.is_some() {
            self.damped = self.stiffness(seconds) > STIFFNESS_OFF;
        }
        Ok(())
    }

    /// Whether the friction of the joints may have prevented convergence.
    fn is_friction_stiff(&mut self, seconds: f64) -> bool {
        let state = self.state;
        let placed = self.middle.place(&self.model, &state, &state, seconds);
        placed.is_ok() && self.stiffness(seconds) > STIFFNESS_OFF
    }

    /// Contraction factor of the iteration due to the joints' friction, the largest of all legs, in
    /// the pose of the last midpoint: at one or more the iteration does not converge.
    fn stiffness(&self, seconds: f64) -> f64 {
        let legs = self.middle.legs.iter().zip(&self.model.legs).enumerate();
        let each = legs.map(|(i, (leg, model))| {
            let [hip, _] = self.model.drive_inertias(i);
            let joints = leg.joint_gradients(model).into_iter();
            let resistances = joints.map(|(friction, rate)| {
                friction * (rate.foot.norm_squared() / model.mass + rate.hip * rate.hip / hip)
            });
            0.5 * seconds * resistances.sum::<f64>()
        });
        each.fold(0.0, f64::max)
    }

    /// Iterates the end of a step, each time from the midpoint of the last iterate. `damped`: the
    /// friction of the joints is a part of the inertia instead of being iterated.
    fn iterate(&mut self, seconds: f64, damped: bool) -> Result<StepEnd, FlowError> {
        let before = self.state;
        let legs = self.model.legs.len();
        let mut end = StepEnd {
            after: before,
            energy_defect: self.energy_defect,
            torques: self.torques,
        };
        self.middle.load = self.mean_load(seconds);
        let mut drives = DriveStep::new(&self.model, &before, &self.inputs, seconds);
        let mut mobility = Mobility::new(&self.model, &[]);
        let mut convergence = Convergence::default();
        for iteration in 0..ITERATES_MAX {
            self.counts.evaluations += 1;
            self.middle
                .place(&self.model, &before, &end.after, seconds)?;
            if iteration == 0 {
                mobility = Mobility::new(&self.model, &self.middle.legs);
            } else {
                let released = std::array::from_fn(|i| {
                    self.placement.springs[i] - self.next_placement.springs[i]
                });
                // A leg without a drive comes to rest between friction and springs, where an
                // infinitely stiff correction would have almost no displacement to act along.
                let stiffness_max = if damped {
                    self.stiffness_max()
                } else {
                    f64::INFINITY
                };
                let after = &end.after;
                self.middle.conserve(
                    &self.model,
                    &before,
                    after,
                    &released,
                    &self.energy_defect,
                    stiffness_max,
                );
            }
            if damped {
                mobility.damp(&self.model, &self.middle.legs, seconds);
            }
            let motion =
                self.constrained_motion(&mut drives, &mut mobility, iteration == 0, seconds)?;
            let last = end.after;
            end.after = before;
            motion.apply(&mut end.after, seconds, legs);
            let mut mean = self.middle.state;
            mean.set_mean_velocities(&before, &end.after, legs);
            let advanced = advance_positions(&self.model, &before, &mean, seconds);
            end.after.copy_positions(&advanced, legs);
            self.next_placement.place(&self.model, &end.after)?;
            end.energy_defect = self.energy_defects(&before, &end.after);
            convergence = convergence.next(
                self.defect_ratio(&end.energy_defect),
                self.leg_distance(&last, &end.after),
            );
            if iteration > 0 && convergence.is_converged() {
                break;
            }
        }
        if !convergence.is_acceptable() {
            return Err(FlowError::NotConverged {
                seconds,
                energy: convergence.energy_defect * self.model.energy_scale * ENERGY_TOLERANCE,
                metres: convergence.distance * DISTANCE_TOLERANCE * self.model.reach,
            });
        }
        end.torques = drives.torques;
        Ok(end)
    }

    /// Greatest stiffness of the force that compensates energy defects. It acts along the
    /// displacement of a leg; where that is short, the force would be large and change direction
    /// with every iterate. The defect that remains is carried over.
    fn stiffness_max(&self) -> f64 {
        CORRECTION_STIFFNESS * self.model.energy_scale / (self.model.reach * self.model.reach)
    }

    /// Greatest energy defect of a leg, in units of its tolerance.
    fn defect_ratio(&self, energy_defect: &[f64; LEGS]) -> f64 {
        let greatest = energy_defect
            .iter()
            .fold(0.0_f64, |greatest, energy| greatest.max(energy.abs()));
        // A trunk without legs has neither a length scale nor energy defects.
        if greatest > 0.0 {
            greatest / (self.model.energy_scale * ENERGY_TOLERANCE)
        } else {
            greatest
        }
    }

    /// Greatest distance of legs in two states, in leg lengths; a radian of the hip counts as one.
    fn leg_distance(&self, one: &State, other: &State) -> f64 {
        let mut greatest = 0.0_f64;
        for i in 0..self.model.legs.len() {
            let foot = (other.foot(i) - one.foot(i)).norm() / self.model.reach;
            greatest = greatest.max(foot).max((other.hip(i) - one.hip(i)).abs());
        }
        greatest
    }

    /// Accelerations of the step, with constraint impulses and the torque limits of the drives. The
    /// first iterate collects the constraints; later ones only solve for them again.
    pub(crate) fn constrained_motion(
        &mut self,
        drives: &mut DriveStep,
        mobility: &mut Mobility,
        first: bool,
        seconds: f64,
    ) -> Result<Motion, FlowError> {
        /// A drive that changes its limit more often is at the boundary of its torque; both states
        /// are right there.
        const LIMIT_CHANGES_MAX: usize = 6;
        /// Tolerances of the impulses, relative to the greatest speed and in m/s, of later iterates
        /// (a tenth of a nanometre a step) and of the first, which is only a start.
        const TOLERANCES: [[f64; 2]; 2] = [[1e-6, 1e-7], [1e-3, 1e-5]];
        let damped = mobility.damping.is_some();
        let mut reassemble = first || damped;
        let mut free = Motion::zero();
        for change in 0.. {
            if damped || change == 0 {
                self.middle.begin_friction(&self.state, mobility);
                free = self.middle.free_motion(&self.model, mobility);
            }
            let mut motion = free;
            // The matrix is assembled again where the drives reached or left their limits after its
            // assembly: in the last change that is followed, or at the end of the last iterate.
            let assembled_for = mobility.drive;
            drives.impose(&self.model, &self.middle, mobility, &mut motion);
            reassemble |= mobility.drive != assembled_for;
            if damped {
                let factored = mobility.factor(&self.model);
                factored.ok_or(FlowError::NotFinite)?;
                mobility.apply_damping(&mut motion, self.model.legs.len());
            }
            if first && change == 0 {
                let Self {
                    model,
                    state,
                    placement,
                    middle,
                    constraints,
                    ..
                } = self;
                constraints.find(model, state, placement, middle, &motion, seconds);
            }
            if reassemble {
                self.constraints
                    .prepare(&self.model, mobility, &self.forces, seconds);
            }
            let coarse = first && self.model.method == Method::Midpoint;
            let tolerance = TOLERANCES[usize::from(coarse)];
            let solved =
                self.constraints
                    .solve(&self.model, mobility, &mut motion, seconds, tolerance);
            (self.counts.solver_iterations, self.counts.factorisations) =
                (self.constraints.sweeps, self.constraints.factorisations);
            solved?;
            self.middle.end_friction(&motion, mobility);
            reassemble =
                drives.update_limits(&self.model, &self.middle, &self.constraints, &motion);
            if !reassemble || change == LIMIT_CHANGES_MAX {
                return Ok(motion);
            }
        }
        unreachable!("the loop returns")
    }

    /// Energy that the springs of each leg release beyond their work, with the defect of earlier
    /// steps \[J\].
    fn energy_defects(&self, before: &State, after: &State) -> [f64; LEGS] {
        let mut energy_defect = [0.0; LEGS];
        for (i, leg) in self.middle.legs.iter().enumerate() {
            let work = -leg.spring.foot.dot(&(after.foot(i) - before.foot(i)))
                - leg.spring.hip * (after.hip(i) - before.hip(i));
            energy_defect[i] = self.energy_defect[i] + self.placement.springs[i]
                - self.next_placement.springs[i]
                - work;
        }
        energy_defect
    }

    /// Rejects a step in which a landing foot penetrates too far, as long as a shorter one may
    /// help: a foot that crosses an edge of the terrain is as deep after any step. Steps of
    /// explicit Euler are not divided.
    fn check_penetration(&self, seconds: f64) -> Result<(), FlowError> {
        let is_fixed = self.model.method == Method::ExplicitEuler;
        if is_fixed || seconds < self.model.step / LANDING_SUBDIVISIONS_MAX {
            return Ok(());
        }
        let limit = -PENETRATION_RATE_MAX * self.model.step;
        let legs = self
            .placement
            .surfaces
            .iter()
            .zip(&self.next_placement.surfaces);
        let mut deep = legs.filter(|(before, after)| after.gap < limit && after.gap < before.gap);
        match deep.next() {
            None => Ok(()),
            Some((_, after)) => Err(FlowError::Penetration {
                seconds,
                metres: -after.gap,
            }),
        }
    }

    /// Accepts the end of the step and accounts for energies, forces and impulses; the state is
    /// unchanged on error.
    pub(crate) fn finish(&mut self, end: &StepEnd, seconds: f64) -> Result<(), FlowError> {
        let (before, after) = (self.state, &end.after);
        if !after.is_finite() {
            return Err(FlowError::NotFinite);
        }
        self.check_penetration(seconds)?;
        let mut ledger = self.ledger;
        let losses = self.constraints.losses(after, seconds)?;
        ledger.impact += losses.impact;
        ledger.dissipated += losses.sliding;
        for (i, leg) in self.middle.legs.iter().enumerate() {
            let travel = [
                after.hip(i) - before.hip(i),
                after.pulley(i) - before.pulley(i),
            ];
            // By the law of friction, at the displacement of the accepted step; a friction force
            // that deviates from it appears in the residual of the balance.
            let foot = after.foot(i) - before.foot(i);
            ledger.dissipated += leg.friction_loss(&self.model.legs[i], foot, travel[0], seconds);
            ledger.actuator += end.torques[i][0] * travel[0] + end.torques[i][1] * travel[1];
        }
        if let Some(pushed) = self.middle.pushed(&self.model) {
            let mut mean = before;
            mean.set_mean_velocities(&before, after, self.middle.legs.len());
            ledger.external += seconds * pushed.power(&self.middle.legs, &mean);
        }
        let checked = ledger.check();
        checked.map_err(|why| FlowError::Dissipation { seconds, why })?;
        (self.ledger, self.constraints.overlap) = (ledger, losses.overlap);
        (self.energy_defect, self.torques) = (end.energy_defect, end.torques);
        self.counts.events += self.constraints.activations(&self.forces);
        self.forces = self.constraints.forces(seconds);
        for i in 0..self.middle.legs.len() {
            let surface = &self.placement.surfaces[i];
            let [along, across] = surface.tangents();
            let [normal, first, second] = ground_force(&self.forces[i]);
            let impulse = (surface.normal * normal + along * first + across * second) * seconds;
            for (sum, part) in self.impulses[i].iter_mut().zip(impulse.iter()) {
                *sum += part;
            }
        }
        self.state = *after;
        std::mem::swap(&mut self.placement, &mut self.next_placement);
        self.counts.steps += 1;
        self.elapsed_s += seconds;
        self.ledger.close_step(self.stored());
        Ok(())
    }
}
