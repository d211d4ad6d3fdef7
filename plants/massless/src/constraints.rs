//! Unilateral constraints of a step (stops, cables, contacts within reach) and their impulses.

mod losses;
mod rates;

use twinrig_contact::{Bound, Method, Problem, Solution, SolveError};
use twinrig_legged::LEGS;
use twinrig_robot::leg::Stop;

use crate::midpoint::{Midpoint, Placement};
use crate::mobility::{Mobility, Response};
use crate::model::Model;
use crate::motion::Motion;
use crate::rows::Row;
use crate::state::State;

/// Share γ of a gap that a step closes, or of an overlap that it removes, while a constraint is
/// active. Positions advance by the mean of the velocities at both ends of a step, so an overlap g
/// follows g ← g − γ (g + g₋)/2. The roots of λ² − (1 − γ/2) λ + γ/2 = 0 are real, and the overlap
/// does not oscillate, up to γ = 6 − √32 ≈ 0.343; at 1/3 they are 1/2 and 1/3.
const RECOVERY: f64 = 1.0 / 3.0;

/// Approach speed below which an impact does not rebound, and limit of the speed at which overlaps
/// are removed \[m/s\].
const RESTING_SPEED: f64 = 0.05;

/// Residual that is accepted where no method converges further \[m/s\]: a hundredth of a micrometre
/// over a step of a millisecond, which the next step removes.
const RESIDUAL_ACCEPTED: f64 = 1e-5;

/// Impulses of a leg's constraints in the last step, per second \[N\]: stops in the order of
/// [`Stop::ALL`], the ankle's, then the ground's along normal and tangents.
pub(crate) type LegForces = [f64; GROUND + 3];

/// Index of the ankle's force in [`LegForces`].
const ANKLE: usize = Stop::ALL.len();

/// Index of the first of the ground's forces in [`LegForces`].
pub(crate) const GROUND: usize = ANKLE + 1;

/// Constraint that a row represents.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    Stop(Stop),
    /// Limit of the ankle's flexion: hip angle and foot position determine the pose only up to
    /// there.
    Ankle,
    Normal,
    First,
    Second,
}

impl Role {
    /// Index among the forces of its leg.
    const fn index(self) -> usize {
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
    /// Gap at the start of the step \[m\].
    gap: f64,
    /// Rate of the gap at the start of the step \[m/s\].
    rate: f64,
    /// Rates of the gap at the end of the step to which a positive impulse leads, without and with
    /// the removal of overlaps \[m/s\]. To the first an impulse does no work.
    lossless: f64,
    recovering: f64,
    /// Whether friction acts against the mean velocity of the step instead of that at its end.
    mean: bool,
}

/// Constraints of one step and the workspace of their solution.
#[derive(Debug, Clone, Default)]
pub(crate) struct Constraints {
    entries: Vec<Entry>,
    responses: Vec<Response>,
    problem: Problem,
    /// Energy of the overlaps \[J\]: what impulses took as they left an overlap, up to the work
    /// that removes it at their force. The removal gives at most this energy back; the rest is lost
    /// with the contact. It is one sum, as the work of redundant constraints is unique only
    /// together.
    pub(crate) overlap: f64,
    /// Share of the removal of overlaps in this step.
    share: f64,
    /// Impulses projected onto their bounds, before these are polished.
    projected: Vec<f64>,
    pub(crate) sweeps: u64,
    pub(crate) factorisations: u64,
}

impl Constraints {
    /// Collects the constraints that may close in the step. `motion` is the acceleration without
    /// constraints.
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
        self.share = 1.0;
        for (i, leg) in middle.legs.iter().enumerate() {
            let constants = &model.legs[i];
            let cable = constants.pantograph.cable_length(before.pulley(i));
            for stop in Stop::ALL {
                // Without a drive that winds it there is no cable.
                if stop == Stop::Cable && model.drives.is_none() {
                    continue;
                }
                let gap = constants.pantograph.gap(&start.poses[i], stop, cable);
                let rate = leg.gap_rate(constants, stop, before.pulley_rate(i));
                if gap + seconds * rate < REACH {
                    let row = leg.stop_row(constants, stop, i);
                    self.add_if_closing(&[(row, Role::Stop(stop))], gap, before, motion, seconds);
                }
            }
            let pose = &start.poses[i];
            if pose.along[1].dot(&pose.along[2]) < FOLDING {
                let gap = constants.pantograph.unfolded(pose);
                let rows = [(leg.ankle_row(constants, i), Role::Ankle)];
                self.add_if_closing(&rows, gap, before, motion, seconds);
            }
            let surface = &start.surfaces[i];
            if surface.gap < FOOT_REACH {
                let [normal, first, second] = leg.contact_rows(surface, &middle.rotation, i);
                let rows = [
                    (normal, Role::Normal),
                    (first, Role::First),
                    (second, Role::Second),
                ];
                self.add_if_closing(&rows, surface.gap, before, motion, seconds);
            }
        }
    }

    /// Adds a constraint whose gap would close by the end of the step, at the present velocity or
    /// with the velocity change due to the springs. The latter alone is not sufficient: another
    /// constraint may balance the springs.
    fn add_if_closing(
        &mut self,
        rows: &[(Row, Role)],
        gap: f64,
        before: &State,
        motion: &Motion,
        seconds: f64,
    ) {
        let rate = rows[0].0.rate(before);
        let velocity_change = 0.5 * seconds * motion.along(&rows[0].0);
        if gap + seconds * (rate + velocity_change.min(0.0)) < TOUCHING {
            self.entries.extend(rows.iter().map(|&(row, role)| Entry {
                row,
                role,
                gap,
                rate: row.rate(before),
                lossless: 0.0,
                recovering: 0.0,
                mean: false,
            }));
        }
    }

    /// Assembles the problem's matrix; the forces of the last step are the initial guess.
    pub(crate) fn prepare(
        &mut self,
        model: &Model,
        mobility: &Mobility,
        last: &[LegForces; LEGS],
        seconds: f64,
    ) {
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
                let mobile = mobility.delassus_entry(&entry.row, &other.row, response);
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
                        friction: model.friction[entry.row.leg],
                    },
                ),
                Role::Second => {}
            }
            self.problem
                .guess(i, last[entry.row.leg][entry.role.index()] * seconds);
        }
        self.problem.soften(model.compliance);
    }

    /// Solves the problem: by pivoting where Newton's method fails, and approximately where both
    /// fail.
    fn impulses(&mut self, [relative, absolute]: [f64; 2]) -> Result<Solution, SolveError> {
        let solved = self.problem.solve_within(relative, absolute);
        let Err(SolveError::Violated { .. }) = solved else {
            return solved;
        };
        match self.problem.solve_by(Method::Direct) {
            Err(SolveError::Violated { residual, .. }) if residual <= RESIDUAL_ACCEPTED => {
                Ok(Solution::default())
            }
            pivoted => pivoted,
        }
    }

    /// Computes the impulses and adds their effect to the motion (per second of the step). The
    /// tolerances are relative to the greatest speed, and absolute in m/s.
    pub(crate) fn solve(
        &mut self,
        model: &Model,
        mobility: &Mobility,
        motion: &mut Motion,
        seconds: f64,
        tolerance: [f64; 2],
    ) -> Result<(), SolveError> {
        /// Passes after which no overlap is removed.
        const PASSES_MAX: usize = 4;
        self.set_rates(model, seconds);
        for pass in 1.. {
            self.set_offsets(motion, self.share, seconds);
            let solution = self.impulses(tolerance)?;
            self.sweeps += u64::from(solution.sweeps);
            self.factorisations += u64::from(solution.factorisations);
            self.polish(tolerance);
            let possible = self.recovery_share(self.share);
            if !self.average_slides() && possible >= self.share {
                break;
            }
            self.share = if pass < PASSES_MAX { possible } else { 0.0 };
        }
        for ((entry, response), &impulse) in self
            .entries
            .iter()
            .zip(&self.responses)
            .zip(self.problem.unknowns())
        {
            motion.add_force(&entry.row, response, mobility, impulse / seconds);
        }
        Ok(())
    }

    /// Projects the impulses onto their bounds, and repeats the solution with a finer tolerance
    /// where that changes them, so that clamping causes no creep. Where the finer solution is not
    /// found, its last iterate may violate every condition; the projected impulses remain.
    fn polish(&mut self, tolerance: [f64; 2]) {
        if !self.problem.project_onto_bounds() {
            return;
        }
        self.projected.clear();
        self.projected.extend_from_slice(self.problem.unknowns());
        let [relative, absolute] = tolerance.map(|tolerance| 1e-4 * tolerance);
        match self.problem.solve_within(relative, absolute) {
            Ok(polished) => {
                self.sweeps += u64::from(polished.sweeps);
                self.factorisations += u64::from(polished.factorisations);
                self.problem.project_onto_bounds();
            }
            Err(_) => {
                for (row, &impulse) in self.projected.iter().enumerate() {
                    self.problem.guess(row, impulse);
                }
            }
        }
    }

    /// Torque impulse of the constraints on a drive (0: hip, 1: pulley) \[N·m·s\].
    pub(crate) fn drive_impulse(&self, leg: usize, drive: usize) -> f64 {
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

    /// Number of constraints that became active in this step: touch-downs, stops reached, cables
    /// pulled taut.
    pub(crate) fn activations(&self, before: &[LegForces; LEGS]) -> u64 {
        let activated =
            self.entries
                .iter()
                .zip(self.problem.unknowns())
                .filter(|(entry, impulse)| {
                    let gap = matches!(entry.role, Role::Stop(_) | Role::Ankle | Role::Normal);
                    gap && **impulse > 0.0 && before[entry.row.leg][entry.role.index()] <= 0.0
                });
        activated.count() as u64
    }

    /// Mean forces over the step \[N\].
    pub(crate) fn forces(&self, seconds: f64) -> [LegForces; LEGS] {
        let mut forces = [LegForces::default(); LEGS];
        for (entry, &impulse) in self.entries.iter().zip(self.problem.unknowns()) {
            forces[entry.row.leg][entry.role.index()] = impulse / seconds;
        }
        forces
    }
}

/// Gaps predicted to fall below this count as closing \[m\].
const TOUCHING: f64 = 1e-6;

/// Gaps predicted to exceed this after a step are skipped \[m\].
const REACH: f64 = 2e-3;

/// Cosine of the angle from the second to the third segment above which an ankle cannot fold up in
/// a step.
const FOLDING: f64 = -0.8;

/// Height above which a foot cannot reach the ground in a step \[m\].
const FOOT_REACH: f64 = 2e-2;
