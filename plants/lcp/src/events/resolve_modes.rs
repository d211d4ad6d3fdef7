//! What holds from an instant on: the closed constraints whose forces push.

use twinrig_contact::{Bound, Method, Problem, Unsolved};

use super::Instant;
use super::closed::{Entry, Feet, PARTING, Role, Stop, touching};
use super::impact::Struck;
use crate::articulated::Articulated;
use crate::constraints::Driven;
use crate::mode::{Contact, Mode};
use crate::motion::Scene;
use crate::real::{Lanes, Real};
use crate::state::State;

/// Gaps that part or close slower than this stay closed \[m/s\]; where they have held, [`PARTING`] decides.
const AT_REST: f64 = 1e-7;

/// A stop that is knocked open and would close again within this has not been open \[s\].
const HOP: f64 = 1e-6;

/// A constraint without force.
const OPEN: Bound = Bound::Between {
    low: 0.0,
    high: 0.0,
};

/// Accelerations of what is to hold that are taken for none where no better is found \[m/s²\].
const SETTLED: f64 = 1e-4;

/// Tolerances of the accelerations, relative to the greatest and in m/s².
const FINE: [f64; 2] = [1e-12, 1e-9];

/// Accelerations towards the ground that are none \[m/s²\].
const SINKING: f64 = 1e-7;

/// Whether contact modes were found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Settled {
    Done,
    /// A foot that slides is pressed down by its own friction, so that no forces keep it out of the ground; which it is, the
    /// [`Instant`] knows. An impulse has to ([`Instant::unjam`]). Either there is no solution, or the one that is noted in
    /// the mode lets it sink by next to nothing.
    Jammed(Option<Unsolved>),
}

impl<const N: usize> Instant<N> {
    /// What holds from here on: finds the forces of the closed constraints, and notes in the mode which of them push.
    pub(crate) fn resolve_modes(
        &mut self,
        scene: &Scene<'_, Lanes, N>,
        state: &State<Lanes, N>,
        legs: &[usize],
        mode: &mut Mode,
    ) -> Result<Settled, Unsolved> {
        let (articulated, drive) = motors_only(scene, state);
        let feet = Feet::AfterEvent;
        self.find(scene, state, &articulated, &drive, legs, feet, &touching);
        let struck = self.struck.take();
        let mut kept = false;
        self.entries.retain_mut(|entry| {
            // A foot's tangents come behind its normal, and stay or go with it: whether they stick or slide is not a matter
            // of gaps.
            if entry.role.is_tangent() {
                return kept;
            }
            let before = |struck: Struck| struck.rates[entry.row.leg][entry.role.place()];
            let rests = if entry.held {
                struck.is_none_or(|struck| entry.rate - before(struck) < PARTING)
            } else {
                entry.rate.abs() < AT_REST
            };
            entry.parts = !rests;
            // A stop that was knocked open may close again before anything else can happen.
            let hops = entry.held && matches!(entry.role, Role::Stop(_));
            kept = rests || hops;
            kept
        });
        for &leg in legs {
            for stop in Stop::ALL {
                let active = stop.of(mode);
                *active = active.with_lane(leg, 0.0);
            }
        }
        mode.contacts.retain(|contact| !legs.contains(&contact.leg));
        if self.entries.is_empty() {
            mode.recount();
            return Ok(Settled::Done);
        }
        let friction = scene.model.ground.as_ref().map_or(0.0, |g| g.friction);
        self.prepare(&articulated, friction);
        let free = articulated.accelerations();
        for (i, entry) in self.entries.iter().enumerate() {
            // With what takes errors back, so that what is found to push here pushes in the motion, too.
            let back = scene.recovery;
            let mut acceleration = entry.bias + entry.winding + back * entry.rate;
            if !entry.role.is_tangent() {
                acceleration += back * (entry.rate + back * entry.gap);
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
            .filter(|(_, entry)| entry.parts)
        {
            self.problem.bound(i, OPEN);
        }
        // So finely that constraints that say the same thing twice share their force as they do in the motion.
        let finely = |problem: &mut Problem, method: Method| match method {
            Method::Newton => problem.solve_within(FINE[0], FINE[1]),
            _ => problem.solve_by(method),
        };
        let mut solved = self.solve(SETTLED, Method::Newton, finely);
        if solved.is_ok() && self.catch_hops() {
            solved = self.solve(SETTLED, Method::Newton, finely);
        }
        if let Err(unsolved) = solved {
            let jams = self.jams(true);
            return jams
                .then_some(Settled::Jammed(Some(unsolved)))
                .ok_or(unsolved);
        }
        let jams = self.jams(false);
        self.note(mode, friction, scene.model.least_force());
        mode.recount();
        Ok(if jams {
            Settled::Jammed(None)
        } else {
            Settled::Done
        })
    }

    /// Marks the feet that slide and may jam: where there is no solution, all of them; else those that are let go although
    /// they sink. Says whether there are any.
    fn jams(&mut self, unsolved: bool) -> bool {
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
            if unsolved || sinks && !entry.parts {
                self.jammed[entry.row.leg][links - 3] = true;
                any = true;
            }
        }
        any
    }

    /// Whether a foot of this leg jams while the leg's cable is closed.
    pub(crate) fn jams_against_cable(&self, leg: usize) -> bool {
        let cable =
            |entry: &Entry<N>| entry.role == Role::Stop(Stop::Cable) && entry.row.leg == leg;
        self.jammed[leg].contains(&true) && self.entries.iter().any(cable)
    }

    /// Lets stops hold that would close again next to at once; says whether there are any.
    fn catch_hops(&mut self) -> bool {
        let mut caught = false;
        for (i, entry) in self
            .entries
            .iter()
            .enumerate()
            .filter(|(_, entry)| entry.parts)
        {
            let closing = -self.problem.w(i);
            if 2.0 * entry.rate < closing * HOP {
                self.problem.bound(i, Bound::NonNegative);
                caught = true;
            }
        }
        caught
    }

    /// Notes what pushes with more than `least`, leaving out what others imply. What has come to its end pushes with next to
    /// nothing; if it were to go on, it would end at once, and again.
    pub(super) fn note(&self, mode: &mut Mode, friction: f64, least: f64) {
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
                    let active = stop.of(mode);
                    *active = active.with_lane(leg, 1.0);
                }
                Role::Normal { links, slides } => {
                    let slides = slides.or_else(|| self.slips(i, friction * force, least));
                    mode.contacts.push(Contact { leg, links, slides });
                }
                Role::Tangent { .. } => {}
            }
        }
    }

    /// The direction in which a foot at rest starts to slide: against its friction, where that is
    /// used up to within `least`. A foot that comes to its limit in a motion does not accelerate yet,
    /// and would be beyond it at once.
    fn slips(&self, normal: usize, limit: f64, least: f64) -> Option<[f64; 2]> {
        let rows = [normal + 1, normal + 2];
        let t = rows.map(|row| self.problem.unknowns()[row]);
        let w = rows.map(|row| self.problem.w(row));
        let size = libm::hypot(t[0], t[1]);
        let saturated = size > 0.0 && size >= limit * (1.0 - 1e-9) - least;
        let starts = least > 0.0 || libm::hypot(w[0], w[1]) > 1e-6;
        (saturated && starts).then(|| [-t[0] / size, -t[1] / size])
    }

    /// Whether a stop says nothing that its leg's taut cable does not.
    fn implied_by_cable(&self, stop: usize) -> bool {
        let own = &self.entries[stop];
        self.entries.iter().enumerate().any(|(j, other)| {
            let same = other.row.leg == own.row.leg && other.role == Role::Stop(Stop::Cable);
            if !same || self.problem.unknowns()[j] <= 0.0 || other.compliance > 0.0 {
                return false;
            }
            let of = |a: &Entry<N>, i: usize| {
                let mut sum = 0.0;
                for k in 0..N {
                    sum += a.row.links[k] * self.rows[i].links[k];
                }
                sum
            };
            let (aa, bb, ab) = (of(own, stop), of(other, j), of(own, j));
            aa * bb - ab * ab <= 1e-6 * aa * bb
        })
    }
}

/// The robot with its motors at work and nothing else that holds.
pub(super) fn motors_only<const N: usize>(
    scene: &Scene<'_, Lanes, N>,
    state: &State<Lanes, N>,
) -> (Articulated<Lanes, N>, Driven<Lanes>) {
    let mut mode = scene.mode.clone_without_stops();
    mode.recount();
    let drive = scene.drive(state);
    (scene.articulated(state, &mode, &drive), drive)
}
