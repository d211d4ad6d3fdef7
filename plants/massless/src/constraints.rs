//! The one-sided constraints of a step: stops, cables and contacts within reach, and the impulses that keep them.

use twinrig_contact::{Bound, Method, Problem, Solution, Unsolved};
use twinrig_leg::Stop;
use twinrig_legged::{LEGS, Slide, taken_by_friction};

use crate::midpoint::{Midpoint, Placement};
use crate::mobility::{Mobility, Motion, Response};
use crate::model::Model;
use crate::rows::Row;
use crate::state::State;

/// Share γ of a gap that a step takes away, or of an overlap that it gives back, where a constraint holds. The positions
/// move by the mean of the velocities at both ends of a step, so that an overlap goes as g ← g − γ (g + g₋)/2, whose roots
/// λ² − (1 − γ/2) λ + γ/2 = 0 are real, and the overlap does not swing, up to γ = 6 − √32 ≈ 0.343; at 1/3 they are 1/2, 1/3.
const RECOVERY: f64 = 1.0 / 3.0;

/// Approach below which an impact gives nothing back, and the speed at which overlaps are \[m/s\].
const RESTING: f64 = 0.05;

/// Impulses of a leg's constraints in the last step, per second: stops in the order of [`Stop::ALL`], the ankle's, then the
/// ground's along normal and tangents \[N\].
pub(crate) type LegForces = [f64; GROUND + 3];

/// Where the ankle's force is in [`LegForces`].
const ANKLE: usize = Stop::ALL.len();

/// Where the ground's forces begin in [`LegForces`].
pub(crate) const GROUND: usize = ANKLE + 1;

/// What a row stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    Stop(Stop),
    /// The ankle folds up no farther than hip angle and foot tell the pose.
    Ankle,
    Normal,
    First,
    Second,
}

impl Role {
    /// Its place among the forces of its leg.
    const fn place(self) -> usize {
        match self {
            Self::Stop(stop) => stop as usize,
            Self::Ankle => ANKLE,
            Self::Normal => GROUND,
            Self::First => GROUND + 1,
            Self::Second => GROUND + 2,
        }
    }
}

/// A constraint within reach.
#[derive(Debug, Clone, Copy)]
struct Entry {
    row: Row,
    role: Role,
    /// Gap at the start of the step.
    gap: f64,
    /// Rate of the gap at the start of the step.
    rate: f64,
}

/// The constraints of one step, with the memory they need.
#[derive(Debug, Clone, Default)]
pub(crate) struct Constraints {
    entries: Vec<Entry>,
    responses: Vec<Response>,
    problem: Problem,
    pub(crate) sweeps: u64,
    pub(crate) factorisations: u64,
}

impl Constraints {
    /// Finds the constraints that the step may reach. `motion` is the acceleration without any.
    pub(crate) fn find(
        &mut self,
        model: &Model,
        before: &State,
        start: &Placement,
        middle: &Midpoint,
        motion: &Motion,
        seconds: f64,
    ) {
        self.entries.clear();
        for (i, leg) in middle.legs.iter().enumerate() {
            let constants = &model.legs[i];
            let cable = constants.pantograph.cable_length(before.pulley(i));
            for stop in Stop::ALL {
                // There is no cable without a drive that winds it.
                if stop == Stop::Cable && model.drives.is_none() {
                    continue;
                }
                let gap = constants.pantograph.gap(&start.poses[i], stop, cable);
                let rate = leg.gap_rate(constants, stop, before.pulley_rate(i));
                if gap + seconds * rate < REACH {
                    let row = leg.stop_row(constants, stop, i);
                    self.consider(&[(row, Role::Stop(stop))], gap, before, motion, seconds);
                }
            }
            let pose = &start.poses[i];
            if pose.along[1].dot(&pose.along[2]) < FOLDING {
                let gap = constants.pantograph.unfolded(pose);
                let rows = [(leg.ankle_row(constants, i), Role::Ankle)];
                self.consider(&rows, gap, before, motion, seconds);
            }
            let surface = &start.surfaces[i];
            if surface.gap < REACH_OF_FOOT {
                let [normal, first, second] = leg.contact_rows(surface, &middle.rotation, i);
                let rows = [
                    (normal, Role::Normal),
                    (first, Role::First),
                    (second, Role::Second),
                ];
                self.consider(&rows, surface.gap, before, motion, seconds);
            }
        }
    }

    /// Takes up a constraint whose gap would close by the end of the step, be it at the present velocity or with what the
    /// springs would do to it. The springs alone do not tell: another constraint may hold them off.
    fn consider(
        &mut self,
        rows: &[(Row, Role)],
        gap: f64,
        before: &State,
        motion: &Motion,
        seconds: f64,
    ) {
        let rate = rows[0].0.rate(before);
        let pushed = 0.5 * seconds * motion.along(&rows[0].0);
        if gap + seconds * (rate + pushed.min(0.0)) < TOUCHING {
            self.entries.extend(rows.iter().map(|&(row, role)| Entry {
                row,
                role,
                gap,
                rate: row.rate(before),
            }));
        }
    }

    /// Prepares the problem's matrix; the forces of the last step are the first guess.
    pub(crate) fn prepare(
        &mut self,
        model: &Model,
        mobility: &Mobility,
        last: &[LegForces; LEGS],
        seconds: f64,
    ) {
        let friction = model.ground.as_ref().map_or(0.0, |ground| ground.friction);
        self.problem.reset(self.entries.len());
        self.responses.clear();
        self.responses.extend(
            self.entries
                .iter()
                .map(|entry| mobility.response(&entry.row)),
        );
        for (i, entry) in self.entries.iter().enumerate() {
            for (j, (other, response)) in self
                .entries
                .iter()
                .zip(&self.responses)
                .enumerate()
                .take(i + 1)
            {
                let mobile = mobility.between(&entry.row, &other.row, response);
                self.problem.set(i, j, mobile);
                self.problem.set(j, i, mobile);
            }
            match entry.role {
                Role::Stop(_) | Role::Ankle | Role::Normal => {
                    self.problem.bound(i, Bound::NonNegative);
                }
                Role::First => self.problem.bound(
                    i,
                    Bound::Disc {
                        normal: i - 1,
                        friction,
                    },
                ),
                Role::Second => {}
            }
            self.problem
                .guess(i, last[entry.row.leg][entry.role.place()] * seconds);
        }
        self.problem.soften(model.compliance);
    }

    /// Solves the problem: by pivoting where Newton's method gets nowhere, and nearly where neither gets there.
    fn impulses(&mut self, [relative, absolute]: [f64; 2]) -> Result<Solution, Unsolved> {
        /// Violation that is accepted where no method comes nearer \[m/s\]: over a step of a millisecond a hundredth of a
        /// micrometre, which the next step gives back.
        const ENOUGH: f64 = 1e-5;
        let solved = self.problem.solve_within(relative, absolute);
        let Err(Unsolved::Violated { .. }) = solved else {
            return solved;
        };
        match self.problem.solve_by(Method::Direct) {
            Err(Unsolved::Violated { residual, .. }) if residual <= ENOUGH => {
                Ok(Solution::default())
            }
            pivoted => pivoted,
        }
    }

    /// Finds the impulses, and adds what they do to the motion (per second of the step). The tolerances are relative to the
    /// greatest speed, and in m/s.
    pub(crate) fn solve(
        &mut self,
        model: &Model,
        mobility: &Mobility,
        motion: &mut Motion,
        seconds: f64,
        tolerance: [f64; 2],
    ) -> Result<(), Unsolved> {
        let restitution = model
            .ground
            .as_ref()
            .map_or(0.0, |ground| ground.restitution);
        for (i, entry) in self.entries.iter().enumerate() {
            let free = entry.rate + seconds * motion.along(&entry.row);
            // An overlap is given back slowly, or an impact would rebound with what its step overlapped.
            let recovered = (RECOVERY * entry.gap / seconds).max(-RESTING);
            let allowed = match entry.role {
                Role::First | Role::Second => 0.0,
                Role::Normal if restitution > 0.0 && entry.rate < -RESTING => {
                    (restitution * entry.rate).min(recovered)
                }
                Role::Stop(_) | Role::Ankle | Role::Normal => recovered,
            };
            self.problem.offset(i, free + allowed);
        }
        let solution = self.impulses(tolerance)?;
        if self.problem.keep_within_bounds() {
            // More exactly, so that what is cut off is no creep.
            let finer = tolerance.map(|tolerance| 1e-4 * tolerance);
            let polished = self.problem.solve_within(finer[0], finer[1]);
            self.problem.keep_within_bounds();
            let further = polished.unwrap_or_default();
            self.sweeps += u64::from(further.sweeps);
            self.factorisations += u64::from(further.factorisations);
        }
        self.sweeps += u64::from(solution.sweeps);
        self.factorisations += u64::from(solution.factorisations);
        for ((entry, response), &impulse) in self
            .entries
            .iter()
            .zip(&self.responses)
            .zip(self.problem.unknowns())
        {
            motion.push(&entry.row, response, mobility, impulse / seconds);
        }
        Ok(())
    }

    /// Torque impulse of the constraints on a drive (0 the hip, 1 the pulley).
    pub(crate) fn on_drive(&self, leg: usize, drive: usize) -> f64 {
        self.entries
            .iter()
            .zip(self.problem.unknowns())
            .filter(|(entry, _)| entry.row.leg == leg)
            .map(|(entry, impulse)| {
                impulse
                    * if drive == 0 {
                        entry.row.hip
                    } else {
                        entry.row.pulley
                    }
            })
            .sum()
    }

    /// Energy that impacts and sliding have taken in the step, from the velocities at its end \[J\].
    pub(crate) fn losses(&self, after: &State) -> (f64, f64) {
        let (mut impact, mut sliding) = (0.0, 0.0);
        let impulses = self.problem.unknowns();
        let slide = |row: usize| {
            let entry = &self.entries[row];
            Slide {
                impulse: impulses[row],
                before: entry.rate,
                after: entry.row.rate(after),
            }
        };
        for (i, entry) in self.entries.iter().enumerate() {
            match entry.role {
                Role::Stop(_) | Role::Ankle | Role::Normal => impact += slide(i).taken(),
                Role::First => {
                    let (taken, rest) = taken_by_friction([slide(i), slide(i + 1)]);
                    sliding += taken;
                    impact += rest;
                }
                Role::Second => {}
            }
        }
        (impact, sliding)
    }

    /// How many constraints push that did not in the step before: touch-downs, stops reached, cables pulled taut.
    pub(crate) fn met(&self, before: &[LegForces; LEGS]) -> u64 {
        let met = self
            .entries
            .iter()
            .zip(self.problem.unknowns())
            .filter(|(entry, impulse)| {
                let gap = matches!(entry.role, Role::Stop(_) | Role::Ankle | Role::Normal);
                gap && **impulse > 0.0 && before[entry.row.leg][entry.role.place()] <= 0.0
            });
        met.count() as u64
    }

    /// Mean forces over the step.
    pub(crate) fn forces(&self, seconds: f64) -> [LegForces; LEGS] {
        let mut forces = [LegForces::default(); LEGS];
        for (entry, &impulse) in self.entries.iter().zip(self.problem.unknowns()) {
            forces[entry.row.leg][entry.role.place()] = impulse / seconds;
        }
        forces
    }
}

/// Gaps that come nearer than this count as closing \[m\].
const TOUCHING: f64 = 1e-6;

/// Gaps farther from closing than this after a step are not looked at \[m\].
const REACH: f64 = 2e-3;

/// Ankles with a greater cosine from the second to the third segment are not folded up in a step.
const FOLDING: f64 = -0.8;

/// Feet higher than this cannot reach the ground in a step \[m\].
const REACH_OF_FOOT: f64 = 2e-2;
