//! One step in time: estimates of its end, until they agree.

use twinrig_legged::LEGS;

use crate::drives::DriveStep;
use crate::flow::{Flow, FlowError, ground_force};
use crate::midpoint::carried;
use crate::mobility::{Mobility, Motion};
use crate::state::State;

/// Estimates of a step's end, at most. Each is (ωh/2)² times nearer than the one before: a hundredth, where the stiffest
/// mode of the leg meets a step of 2 ms.
const ESTIMATES_MAX: u32 = 12;

/// What a step's springs may lose or gain unaccounted for, as a share of the robot's weight times its leg's length:
/// 2e-8 J for Cheetah-cub, which exchanges 0.03 J in a millisecond of trot. The next step makes up for it, so that it does
/// not add up.
const UNACCOUNTED: f64 = 1e-8;

/// Distance of an estimate from the end that the estimates lead to, as a share of the robot's leg length: 0.4 µm for
/// Cheetah-cub. Springs that hardly move say nothing of what friction does.
const SETTLED: f64 = 3e-6;

/// Times [`UNACCOUNTED`] and [`SETTLED`] that a step may leave after its last estimate; a shorter one is tried where it
/// leaves more.
const OPEN_MAX: f64 = 1e3;
const UNSETTLED_MAX: f64 = 10.0;

/// Estimates that come nearer by less than a tenth each may be going to and fro.
const DISTANCE_MAX: f64 = 10.0;

/// Stiffness of the joints' friction ([`Flow::stiffness`]) above which it becomes a part of the inertia, and below which it is
/// repeated again. With the friction of the robot file it is 0.14 at most in a trot at 2 ms.
const STIFF: f64 = 0.2;
const NO_LONGER_STIFF: f64 = 0.15;

/// The stiffness is looked at every so many steps, in which a pose does not change by much.
const LOOKS: u64 = 8;

/// Stiffness of what makes up for the energy that springs owe, as a share of the robot's weight over its leg length.
const STIFFEST: f64 = 0.1;

/// How deep a foot may land in the ground in a step of the plant, over the length of that \[m/s\]: positions move by the mean of
/// the velocities before and after, so that a foot which comes with twice this speed goes so deep.
const DEPTH_RATE: f64 = 0.45;

/// A landing is taken in no shorter steps than this share of the plant's.
const SHORTEST_LANDING: f64 = 16.0;

/// How near the estimates have come.
#[derive(Debug, Clone, Copy, Default)]
struct Agreement {
    /// Energy that springs leave open \[J\], as a share of what they may.
    open: f64,
    /// From the last estimate to this one, in leg lengths.
    moved: f64,
    /// Distance to where the estimates lead, as a share of what it may be.
    distance: f64,
}

impl Agreement {
    /// With the energy that is open and the way from the last estimate to the next, in leg lengths.
    fn next(self, open: f64, moved: f64) -> Self {
        // The way that is left is a geometric series.
        let ratio = moved / self.moved;
        let factor = if ratio < 1.0 {
            (ratio / (1.0 - ratio)).min(DISTANCE_MAX)
        } else {
            DISTANCE_MAX
        };
        Self {
            open,
            moved,
            distance: if moved == 0.0 {
                0.0
            } else {
                moved * factor / SETTLED
            },
        }
    }

    fn is_reached(self) -> bool {
        self.open < 1.0 && self.distance < 1.0
    }

    fn will_do(self) -> bool {
        self.open <= OPEN_MAX && self.distance <= UNSETTLED_MAX
    }
}

/// The end of a step that estimates agree on.
struct End {
    after: State,
    owed: [f64; LEGS],
    torques: [[f64; 2]; LEGS],
}

impl Flow {
    /// A step of the midpoint rule: energy-conserving springs, constraints at velocity level, friction by the velocity at
    /// the end.
    pub(crate) fn step(&mut self, seconds: f64) -> Result<(), FlowError> {
        if !self.damped {
            let repeated = self.estimate(seconds, false);
            match repeated.and_then(|end| self.finish(&end, seconds)) {
                Ok(()) => {
                    if self.counts.steps.is_multiple_of(LOOKS) {
                        self.damped = self.stiffness(seconds) > STIFF;
                    }
                    return Ok(());
                }
                Err(error) if !self.is_stiff_here(seconds) => return Err(error),
                Err(_) => {}
            }
        }
        let end = self.estimate(seconds, true)?;
        self.finish(&end, seconds)?;
        if self.counts.steps.is_multiple_of(LOOKS) && self.model.drives.is_some() {
            self.damped = self.stiffness(seconds) > NO_LONGER_STIFF;
        }
        Ok(())
    }

    /// Whether the friction of the joints may be what kept estimates apart.
    fn is_stiff_here(&mut self, seconds: f64) -> bool {
        let here = self.state;
        let placed = self.middle.place(&self.model, &here, &here, seconds);
        placed.is_ok() && self.stiffness(seconds) > NO_LONGER_STIFF
    }

    /// The share of its error in the friction of the joints that an estimate leaves to the next, at worst, in the pose of the
    /// last middle: from one on, repetition comes no nearer.
    fn stiffness(&self, seconds: f64) -> f64 {
        let legs = self.middle.legs.iter().zip(&self.model.legs).enumerate();
        let each = legs.map(|(i, (leg, model))| {
            let [hip, _] = self.model.turning(i);
            let joints = leg.joint_gradients(model).into_iter();
            let resistances = joints.map(|(friction, rate)| {
                friction * (rate.foot.norm_squared() / model.mass + rate.hip * rate.hip / hip)
            });
            0.5 * seconds * resistances.sum::<f64>()
        });
        each.fold(0.0, f64::max)
    }

    /// Estimates the end of a step, time and again: each from the middle that the last one had. `damped`: the friction of the
    /// joints counts as a part of the inertia, instead of being repeated, too.
    fn estimate(&mut self, seconds: f64, damped: bool) -> Result<End, FlowError> {
        let before = self.state;
        let legs = self.model.legs.len();
        let mut end = End {
            after: before,
            owed: self.owed,
            torques: self.torques,
        };
        let mut drives = DriveStep::new(&self.model, &before, &self.inputs, seconds);
        let mut mobility = Mobility::new(&self.model, &[]);
        let mut agreement = Agreement::default();
        for estimate in 0..ESTIMATES_MAX {
            self.counts.evaluations += 1;
            self.middle
                .place(&self.model, &before, &end.after, seconds)?;
            if estimate == 0 {
                mobility = Mobility::new(&self.model, &self.middle.legs);
            } else {
                let lost = std::array::from_fn(|i| self.here.springs[i] - self.there.springs[i]);
                // A leg without a drive comes to rest between friction and springs, and next to nothing moves it.
                let stiffest = if damped {
                    self.stiffest()
                } else {
                    f64::INFINITY
                };
                let after = &end.after;
                self.middle
                    .conserve(&self.model, &before, after, &lost, &self.owed, stiffest);
            }
            if damped {
                mobility.damp(&self.model, &self.middle.legs, seconds);
            }
            let motion =
                self.constrained_motion(&mut drives, &mut mobility, estimate == 0, seconds)?;
            let last = end.after;
            end.after = before;
            motion.apply(&mut end.after, seconds, legs);
            let mut mean = self.middle.state;
            mean.take_mean_velocities(&before, &end.after, legs);
            let moved = carried(&self.model, &before, &mean, seconds);
            end.after.take_positions(&moved, legs);
            self.there.place(&self.model, &end.after)?;
            end.owed = self.unpaid(&before, &end.after);
            agreement = agreement.next(self.share_open(&end.owed), self.apart(&last, &end.after));
            if estimate > 0 && agreement.is_reached() {
                break;
            }
        }
        if !agreement.will_do() {
            return Err(FlowError::NotConverged {
                seconds,
                energy: agreement.open * self.model.energy_scale * UNACCOUNTED,
                metres: agreement.distance * SETTLED * self.model.reach,
            });
        }
        end.torques = drives.torques;
        Ok(end)
    }

    /// How stiff the force may be that makes up for what springs owe. It acts along the way that a leg moves, whichever that
    /// is: where that is short, it would be great and turn with every estimate. What it leaves stays owed.
    fn stiffest(&self) -> f64 {
        STIFFEST * self.model.energy_scale / (self.model.reach * self.model.reach)
    }

    /// The most that the springs of a leg leave open, as a share of what they may.
    fn share_open(&self, owed: &[f64; LEGS]) -> f64 {
        let most = owed
            .iter()
            .fold(0.0_f64, |most, energy| most.max(energy.abs()));
        // A trunk without legs has no length to measure by, and nothing to measure.
        if most > 0.0 {
            most / (self.model.energy_scale * UNACCOUNTED)
        } else {
            most
        }
    }

    /// How far legs are apart in two states, at worst, in leg lengths; a radian of the hip counts as one.
    fn apart(&self, one: &State, other: &State) -> f64 {
        let mut most = 0.0_f64;
        for i in 0..self.model.legs.len() {
            let foot = (other.foot(i) - one.foot(i)).norm() / self.model.reach;
            most = most.max(foot).max((other.hip(i) - one.hip(i)).abs());
        }
        most
    }

    /// The step's accelerations, with the impulses of the constraints and the torque limits of the drives in them. The first
    /// estimate finds the constraints; the later ones only solve for them again.
    fn constrained_motion(
        &mut self,
        drives: &mut DriveStep,
        mobility: &mut Mobility,
        first: bool,
        seconds: f64,
    ) -> Result<Motion, FlowError> {
        /// A drive that changes its mind more often is on the border of its torque; either answer is right there.
        const CHANGES_MAX: usize = 6;
        /// Tolerances of the impulses, relative to the greatest speed and in m/s: a tenth of a nanometre a step. The first
        /// estimate is on the way to another.
        const TOLERANCES: [[f64; 2]; 2] = [[1e-6, 1e-7], [1e-3, 1e-5]];
        let damped = mobility.damping.is_some();
        let mut fresh = first || damped;
        let mut free = Motion::zero();
        for change in 0.. {
            if damped || change == 0 {
                self.middle.begin_friction(&self.state, mobility);
                free = self.middle.free_motion(&self.model, mobility);
            }
            let mut motion = free;
            drives.impose(&self.model, &self.middle, mobility, &mut motion);
            if damped {
                let factored = mobility.factor(&self.model);
                factored.ok_or(FlowError::NotFinite)?;
                mobility.hold_back(&mut motion, self.model.legs.len());
            }
            if first && change == 0 {
                let Self {
                    model,
                    state,
                    here,
                    middle,
                    constraints,
                    ..
                } = self;
                constraints.find(model, state, here, middle, &motion, seconds);
            }
            if fresh {
                self.constraints
                    .prepare(&self.model, mobility, &self.forces, seconds);
            }
            let tolerance = TOLERANCES[usize::from(first)];
            let solved =
                self.constraints
                    .solve(&self.model, mobility, &mut motion, seconds, tolerance);
            (self.counts.solver_iterations, self.counts.factorisations) =
                (self.constraints.sweeps, self.constraints.factorisations);
            solved?;
            self.middle.end_friction(&motion, mobility);
            fresh = drives.exhausted(&self.model, &self.middle, &self.constraints, &motion);
            if !fresh || change == CHANGES_MAX {
                return Ok(motion);
            }
        }
        unreachable!("the loop returns")
    }

    /// What the springs of each leg will have lost beyond the work they did \[J\].
    fn unpaid(&self, before: &State, after: &State) -> [f64; LEGS] {
        let mut owed = [0.0; LEGS];
        for (i, leg) in self.middle.legs.iter().enumerate() {
            let work = -leg.spring.foot.dot(&(after.foot(i) - before.foot(i)))
                - leg.spring.hip * (after.hip(i) - before.hip(i));
            owed[i] = self.owed[i] + self.here.springs[i] - self.there.springs[i] - work;
        }
        owed
    }

    /// Refuses a step in which a foot that lands goes deep, as long as a shorter one may help: a foot that steps across an edge
    /// of the ground is as deep after any.
    fn check_depth(&self, seconds: f64) -> Result<(), FlowError> {
        if seconds < self.model.step / SHORTEST_LANDING {
            return Ok(());
        }
        let most = -DEPTH_RATE * self.model.step;
        let legs = self.here.surfaces.iter().zip(&self.there.surfaces);
        let mut deep = legs.filter(|(before, after)| after.gap < most && after.gap < before.gap);
        match deep.next() {
            None => Ok(()),
            Some((_, after)) => Err(FlowError::Deep {
                seconds,
                metres: -after.gap,
            }),
        }
    }

    /// Takes the step's end as the present and writes up what has flowed; or leaves all as it is.
    fn finish(&mut self, end: &End, seconds: f64) -> Result<(), FlowError> {
        let (before, after) = (self.state, &end.after);
        if !after.is_finite() {
            return Err(FlowError::NotFinite);
        }
        self.check_depth(seconds)?;
        let mut ledger = self.ledger;
        let (impact, sliding) = self.constraints.losses(after);
        ledger.impact += impact;
        ledger.dissipated += sliding;
        for (i, leg) in self.middle.legs.iter().enumerate() {
            let turned = [
                after.hip(i) - before.hip(i),
                after.pulley(i) - before.pulley(i),
            ];
            // By the law of friction, at the velocities that the step has come to have; a force that was any other is missing
            // in the balance.
            let foot = after.foot(i) - before.foot(i);
            ledger.dissipated += leg.friction_loss(&self.model.legs[i], foot, turned[0], seconds);
            ledger.actuator += end.torques[i][0] * turned[0] + end.torques[i][1] * turned[1];
        }
        let checked = ledger.check();
        checked.map_err(|why| FlowError::Dissipation { seconds, why })?;
        self.ledger = ledger;
        (self.owed, self.torques) = (end.owed, end.torques);
        self.counts.events += self.constraints.met(&self.forces);
        self.forces = self.constraints.forces(seconds);
        for i in 0..self.middle.legs.len() {
            let surface = &self.here.surfaces[i];
            let [along, across] = surface.tangents();
            let [normal, first, second] = ground_force(&self.forces[i]);
            let impulse = (surface.normal * normal + along * first + across * second) * seconds;
            for (sum, part) in self.impulses[i].iter_mut().zip(impulse.iter()) {
                *sum += part;
            }
        }
        self.state = *after;
        std::mem::swap(&mut self.here, &mut self.there);
        self.counts.steps += 1;
        self.ledger.close_step(self.stored());
        Ok(())
    }
}
