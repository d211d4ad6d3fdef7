//! Active constraints after an instant: the closed constraints with compressive forces.

use twinrig_contact::{Bound, Method, Problem, SolveError};
use twinrig_legged::LEGS;

use super::Instant;
use super::closed::{SEPARATION, touching};
use super::entry::{Entry, Feet, Role, Stop};
use super::impact_record::ImpactRecord;
use crate::constraints::contacts::Contact;
use crate::constraints::mode::Mode;
use crate::constraints::motion::Dynamics;
use crate::model::articulated::Articulated;
use crate::model::leg_constraints::DriveAction;
use crate::model::real::{Lanes, Real};
use crate::model::state::State;

/// Rate below which a gap stays closed \[m/s\]; for active constraints [`SEPARATION`] applies.
const AT_REST: f64 = 1e-7;

/// A stop that an impact opens and that would close again within this time stays active \[s\].
const HOP_SECONDS: f64 = 1e-6;

/// Bound of a constraint without force.
const OPEN: Bound = Bound::Between {
    low: 0.0,
    high: 0.0,
};

/// Acceleration of an active constraint that is accepted as zero if no better solution is found
/// \[m/s²\].
const ACCELERATION_ACCEPTED: f64 = 1e-4;

/// Tolerances of the accelerations, relative to the maximum, and in m/s².
const ACCELERATION_TOLERANCE: [f64; 2] = [1e-12, 1e-9];

/// Acceleration towards the ground that counts as zero \[m/s²\].
const SINKING: f64 = 1e-7;

/// Result of the resolution of contact modes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ModeResolution {
    Resolved,
    /// A sliding foot is pressed down by its own friction, so that no forces keep it out of the
    /// ground; the [`Instant`] stores which foot. An impulse is required
    /// ([`Instant::resolve_jam`]). Either there is no solution, or the solution in the mode lets
    /// the foot sink minimally.
    Jammed(Option<SolveError>),
}

impl<const N: usize> Instant<N> {
    /// Finds the forces of the closed constraints and stores those that push as active in the mode.
    pub(crate) fn resolve_modes(
        &mut self,
        dynamics: &Dynamics<'_, Lanes, N>,
        state: &State<Lanes, N>,
        legs: &[usize],
        mode: &mut Mode,
    ) -> Result<ModeResolution, SolveError> {
        let (articulated, drive) = motors_only(dynamics, state);
        let feet = Feet::AfterEvent;
        self.find_entries(dynamics, state, &articulated, &drive, legs, feet, &touching);
        let last_impact = self.last_impact.take();
        let mut retained = false;
        self.entries.retain_mut(|entry| {
            // The tangents of a foot follow its normal and are retained or dropped with it:
            // sticking and sliding do not depend on gaps.
            if entry.role.is_tangent() {
                return retained;
            }
            let before =
                |last_impact: ImpactRecord| last_impact.rates[entry.row.leg][entry.role.slot()];
            let stays = if entry.was_active {
                last_impact.is_none_or(|last_impact| entry.rate - before(last_impact) < SEPARATION)
            } else {
                entry.rate.abs() < AT_REST
            };
            entry.separates = !stays;
            // A stop opened by an impact may close again before any other event.
            let may_close_again = entry.was_active && matches!(entry.role, Role::Stop(_));
            retained = stays || may_close_again;
            retained
        });
        for &leg in legs {
            for stop in Stop::ALL {
                let active = stop.active_mut(mode);
                *active = active.with_lane(leg, 0.0);
            }
        }
        mode.contacts.retain(|contact| !legs.contains(&contact.leg));
        if self.entries.is_empty() {
            mode.update_any();
            return Ok(ModeResolution::Resolved);
        }
        let friction = &dynamics.model.friction;
        self.prepare(&articulated, friction);
        let free = articulated.accelerations();
        for (i, entry) in self.entries.iter().enumerate() {
            // Includes the stabilisation terms, so that a constraint that pushes here also pushes
            // in the motion.
            let recovery = dynamics.recovery;
            let mut acceleration = entry.bias + entry.winding + recovery * entry.rate;
            if !entry.role.is_tangent() {
                acceleration += recovery * (entry.rate + recovery * entry.gap);
            }
            for (j, a) in entry.row.trunk.iter().zip(&free.trunk) {
                acceleration += j * a;
            }
            for (j, a) in entry.row.links.iter().zip(&free.links) {
                acceleration += j * a.lane(entry.row.leg);
            }
            self.problem.offset(i, acceleration);
        }
        for (i, _) in self
            .entries
            .iter()
            .enumerate()
            .filter(|(_, entry)| entry.separates)
        {
            self.problem.bound(i, OPEN);
        }
        // Tight tolerances, so that redundant constraints share their force as in the motion.
        let to_tolerance = |problem: &mut Problem, method: Method| match method {
            Method::Newton => {
                problem.solve_within(ACCELERATION_TOLERANCE[0], ACCELERATION_TOLERANCE[1])
            }
            _ => problem.solve_by(method),
        };
        let mut solved = self.solve(ACCELERATION_ACCEPTED, Method::Newton, to_tolerance);
        if solved.is_ok() && self.activate_hops() {
            solved = self.solve(ACCELERATION_ACCEPTED, Method::Newton, to_tolerance);
        }
        if let Err(unsolved) = solved {
            let jams = self.mark_jammed(true);
            return jams
                .then_some(ModeResolution::Jammed(Some(unsolved)))
                .ok_or(unsolved);
        }
        let jams = self.mark_jammed(false);
        self.mark_active(mode, friction, dynamics.model.least_force());
        mode.update_any();
        Ok(if jams {
            ModeResolution::Jammed(None)
        } else {
            ModeResolution::Resolved
        })
    }

    /// Marks the sliding feet that may jam: all of them without a solution, otherwise those that
    /// are inactive although they sink. Returns whether there are any.
    fn mark_jammed(&mut self, unsolved: bool) -> bool {
        self.jammed = [[false; 2]; 4];
        let mut any = false;
        for (i, entry) in self.entries.iter().enumerate() {
            let Role::Normal {
                links,
                slides: Some(_),
            } = entry.role
            else {
                continue;
            };
            let sinks = self.problem.unknowns()[i] <= 0.0 && self.problem.w(i) < -SINKING;
            if unsolved || sinks && !entry.separates {
                self.jammed[entry.row.leg][links - 3] = true;
                any = true;
            }
        }
        any
    }

    /// Returns whether a foot of this leg jams while the leg's cable is closed.
    pub(crate) fn is_jammed_against_cable(&self, leg: usize) -> bool {
        let cable =
            |entry: &Entry<N>| entry.role == Role::Stop(Stop::Cable) && entry.row.leg == leg;
        self.jammed[leg].contains(&true) && self.entries.iter().any(cable)
    }

    /// Activates stops that would close again within [`HOP_SECONDS`]; returns whether there are
    /// any.
    fn activate_hops(&mut self) -> bool {
        let mut activated = false;
        for (i, entry) in self
            .entries
            .iter()
            .enumerate()
            .filter(|(_, entry)| entry.separates)
        {
            let closing = -self.problem.w(i);
            if 2.0 * entry.rate < closing * HOP_SECONDS {
                self.problem.bound(i, Bound::NonNegative);
                activated = true;
            }
        }
        activated
    }

    /// Stores the constraints with forces above `least` as active, except those implied by others.
    /// A contact at its end has almost no force; if it stayed active, it would end again at once,
    /// repeatedly.
    pub(super) fn mark_active(&self, mode: &mut Mode, friction: &[f64; LEGS], least: f64) {
        for (i, entry) in self.entries.iter().enumerate() {
            let force = self.problem.unknowns()[i];
            if force <= least {
                continue;
            }
            let leg = entry.row.leg;
            match entry.role {
                Role::Stop(stop) => {
                    if stop != Stop::Cable && self.implied_by_cable(i) {
                        continue;
                    }
                    let active = stop.active_mut(mode);
                    *active = active.with_lane(leg, 1.0);
                }
                Role::Normal { links, slides } => {
                    let limit = friction[leg] * force;
                    let slides = slides.or_else(|| self.slip_direction(i, limit, least));
                    mode.contacts.push(Contact { leg, links, slides });
                }
                Role::Tangent { .. } => {}
            }
        }
    }

    /// Returns the direction in which a sticking foot starts to slide: against its friction, where
    /// that reaches its limit within `least`. A foot that reaches its limit during motion does not
    /// accelerate yet, and would exceed it at once.
    fn slip_direction(&self, normal: usize, limit: f64, least: f64) -> Option<[f64; 2]> {
        let rows = [normal + 1, normal + 2];
        let t = rows.map(|row| self.problem.unknowns()[row]);
        let w = rows.map(|row| self.problem.w(row));
        let size = libm::hypot(t[0], t[1]);
        let saturated = size > 0.0 && size >= limit * (1.0 - 1e-9) - least;
        let starts = least > 0.0 || libm::hypot(w[0], w[1]) > 1e-6;
        (saturated && starts).then(|| [-t[0] / size, -t[1] / size])
    }

    /// Returns whether a stop is implied by the taut cable of its leg.
    fn implied_by_cable(&self, stop: usize) -> bool {
        let entry = &self.entries[stop];
        self.entries.iter().enumerate().any(|(j, other)| {
            let is_cable = other.row.leg == entry.row.leg && other.role == Role::Stop(Stop::Cable);
            if !is_cable || self.problem.unknowns()[j] <= 0.0 || other.compliance > 0.0 {
                return false;
            }
            let of = |a: &Entry<N>, i: usize| {
                let mut sum = 0.0;
                for k in 0..N {
                    sum += a.row.links[k] * self.row_responses[i].links[k];
                }
                sum
            };
            let (aa, bb, ab) = (of(entry, stop), of(other, j), of(entry, j));
            aa * bb - ab * ab <= 1e-6 * aa * bb
        })
    }
}

/// Returns the robot with its motors and without any other active constraint.
pub(super) fn motors_only<const N: usize>(
    dynamics: &Dynamics<'_, Lanes, N>,
    state: &State<Lanes, N>,
) -> (Articulated<Lanes, N>, DriveAction<Lanes>) {
    let mut mode = dynamics.mode.drives_only();
    mode.update_any();
    let drive = dynamics.drive(state);
    (dynamics.articulated(state, &mode, &drive), drive)
}
