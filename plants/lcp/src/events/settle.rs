//! What holds from an instant on: the closed constraints whose forces push.

use twinrig_contact::{Bound, Method, Problem, Unsolved};

use super::Instant;
use super::closed::{Entry, PLACES, Role, Stop, touching};
use crate::articulated::Articulated;
use crate::hold::Driven;
use crate::mode::{Contact, Mode};
use crate::motion::Scene;
use crate::real::{Lanes, Real};
use crate::state::State;

/// Gaps of constraints that part or close slower than this stay closed; of those that have held, what an impact adds to the
/// rate by which they drifted \[m/s\].
const AT_REST: f64 = 1e-7;
const PARTING: f64 = 1e-6;

/// A stop that is knocked open and would close again within this has not been open \[s\].
const HOP: f64 = 1e-6;

/// A constraint without force.
const OPEN: Bound = Bound::Between {
    low: 0.0,
    high: 0.0,
};

/// Accelerations of what is to hold that are taken for none where no better is found \[m/s²\].
const SETTLED: f64 = 1e-4;

impl<const N: usize> Instant<N> {
    /// What holds from here on: finds the forces of the closed constraints, and notes in the mode which of them push.
    pub(crate) fn settle(
        &mut self,
        scene: &Scene<'_, Lanes, N>,
        state: &State<Lanes, N>,
        legs: &[usize],
        mode: &mut Mode,
    ) -> Result<(), Unsolved> {
        let (articulated, drive) = motors_only(scene, state);
        self.find(scene, state, &articulated, &drive, legs, true, &touching);
        let drifts = self.drifts.take();
        let mut kept = false;
        self.entries.retain_mut(|entry| {
            // A foot's tangents stand behind its normal, and stay or go with it: whether they stick or slide is not a matter
            // of gaps.
            if entry.role.is_tangent() {
                return kept;
            }
            let drift = |drifts: [[f64; PLACES]; 4]| drifts[entry.row.leg][entry.role.place()];
            let rests = if entry.held {
                drifts.is_none_or(|drifts| entry.rate - drift(drifts) < PARTING)
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
                let holds = stop.of(mode);
                *holds = holds.with_lane(leg, 0.0);
            }
        }
        mode.contacts.retain(|contact| !legs.contains(&contact.leg));
        if self.entries.is_empty() {
            mode.recount();
            return Ok(());
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
        self.solve(SETTLED, Method::Newton, Problem::solve_by)?;
        if self.catch_hops() {
            self.solve(SETTLED, Method::Newton, Problem::solve_by)?;
        }
        self.note(mode, friction, scene.model.least_force());
        mode.recount();
        Ok(())
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
                    let holds = stop.of(mode);
                    *holds = holds.with_lane(leg, 1.0);
                }
                Role::Normal { links, slides } => {
                    let slides = slides.or_else(|| {
                        // A foot at rest whose friction is used up starts to slide against it.
                        let t = [
                            self.problem.unknowns()[i + 1],
                            self.problem.unknowns()[i + 2],
                        ];
                        let size = libm::hypot(t[0], t[1]);
                        let spent = size >= friction * force * (1.0 - 1e-9);
                        let accelerates = libm::hypot(self.problem.w(i + 1), self.problem.w(i + 2));
                        (spent && accelerates > 1e-6).then(|| [-t[0] / size, -t[1] / size])
                    });
                    mode.contacts.push(Contact { leg, links, slides });
                }
                Role::Tangent { .. } => {}
            }
        }
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
