//! What is done where a step begins and where an event ends it: motors obey, what strikes strikes, and what holds is chosen.

use twinrig_legged::Fitted;

use super::{ALL, AT_ONCE_MAX, AT_REST, Due, Halt, Progress, SHORTEST, TOUCHING, Track};
use crate::drives::wanted;
use crate::events::{Instant, STOPPED, Settled, Toll};
use crate::flow::{Flow, FlowError};
use crate::guards::{GUARDS, Guard, kind, links_of};
use crate::mode::Mode;
use crate::motion::Scene;
use crate::motors::Effort;
use crate::real::{Lanes, Real};
use crate::state::State;

/// Impacts without collision, and motors that give way to them, at one instant, at most.
const JAMS_MAX: u32 = 8;

/// An event while it is resolved.
struct Event<const N: usize> {
    state: State<Lanes, N>,
    /// The constraints that were active before, and the drives.
    before: Mode,
    /// Those that are active after it.
    mode: Mode,
    toll: Toll,
}

impl<const N: usize> Flow<N> {
    /// The motion and the guards at the start, in a mode that has something to it.
    pub(super) fn start(&mut self, recovery: f64, track: &mut Track<N>) -> Result<(), Halt> {
        let state = self.state;
        if track.known.is_none() || track.known != self.known(recovery) {
            self.motion_into(&state, recovery, &mut track.start);
            self.guard(&state, &track.start, &mut track.guards);
        }
        let guards = &track.guards;
        let tolerances = self.tolerances();
        let near: [f64; GUARDS] = std::array::from_fn(|place| match kind(place) {
            Guard::Gap => -TOUCHING,
            _ => tolerances[place],
        });
        if !guards.alarmed(&near) {
            return Ok(());
        }
        // What was let go at that very instant may be caught again by new commands.
        let resting = |place: usize, leg: usize| {
            let [gap, rate] = [&guards.values, &guards.rates].map(|of| of[place].lane(leg));
            gap < TOUCHING && rate.abs() < AT_REST
        };
        let mut news = false;
        for island in self.islands() {
            let alarmed = |leg: usize| {
                (0..GUARDS).any(|place| match kind(place) {
                    Guard::Gap => resting(place, leg),
                    _ => guards.values[place].lane(leg) < -tolerances[place],
                })
            };
            if island.clone().any(alarmed) {
                news = true;
                self.choose(island, recovery)?;
            }
        }
        if news {
            let state = self.state;
            self.motion_into(&state, recovery, &mut track.start);
            self.guard(&state, &track.start, &mut track.guards);
        }
        Ok(())
    }

    /// Chooses anew what holds of these legs, where nothing has struck.
    pub(crate) fn choose(
        &mut self,
        legs: core::ops::Range<usize>,
        recovery: f64,
    ) -> Result<(), FlowError> {
        self.resolve(legs, recovery, self.now_s, false)
    }

    /// Meets the events that are due; says whether there were any.
    pub(super) fn handle_all(
        &mut self,
        next_event: &[Option<Due>; 4],
        progress: &mut Progress,
        recovery: f64,
        seconds: f64,
    ) -> Result<bool, Halt> {
        let mut met = false;
        for (i, (island, next_event)) in self.islands().zip(next_event).enumerate() {
            let Some(next_event) = next_event.filter(|next_event| next_event.met) else {
                continue;
            };
            met = true;
            if kind(next_event.place) == Guard::Slide && self.turns(&next_event) {
                continue;
            }
            self.counts.events += 1;
            progress.events[i] += 1;
            progress.at_once = if next_event.at < SHORTEST {
                progress.at_once + 1
            } else {
                0
            };
            if progress.at_once > AT_ONCE_MAX || progress.events[i] > self.events_max {
                return Err(Halt::Crowded);
            }
            let at_s = self.now_s + (seconds - progress.remaining.lane(next_event.leg));
            self.handle(island, recovery, at_s)?;
        }
        Ok(met)
    }

    /// Whether a slide that has come to an end along the direction it had goes on along another one, which is then noted.
    /// That is no event: friction follows the slide, and no velocity is zero.
    fn turns(&mut self, next_event: &Due) -> bool {
        let links = links_of(next_event.place);
        let Some(footing) = self.footing(next_event.leg, links) else {
            return false;
        };
        let [_, a, b] = footing.velocity;
        let speed = libm::hypot(a, b);
        if speed < STOPPED {
            return false;
        }
        let mut contacts = self.mode.contacts.iter_mut();
        let contact = contacts.find(|c| (c.leg, c.links) == (next_event.leg, links));
        if let Some(contact) = contact {
            contact.slides = Some([a / speed, b / speed]);
        }
        true
    }

    /// Impact and change of mode of these legs.
    pub(super) fn handle(
        &mut self,
        legs: core::ops::Range<usize>,
        recovery: f64,
        at_s: f64,
    ) -> Result<(), FlowError> {
        self.resolve(legs, recovery, at_s, true)
    }

    /// Velocities and contact modes of these legs after an event, in which something may have struck.
    fn resolve(
        &mut self,
        legs: core::ops::Range<usize>,
        recovery: f64,
        at_s: f64,
        strikes: bool,
    ) -> Result<(), FlowError> {
        let mut event = Event {
            state: self.state,
            before: self.mode,
            mode: self.mode,
            toll: Toll::default(),
        };
        let mut instant = core::mem::take(&mut self.instant);
        let resolved = self.resolved(&mut instant, &mut event, &ALL[legs], recovery, strikes);
        self.instant = instant;
        (self.counts.solver_iterations, self.counts.factorisations) =
            (self.instant.iterations, self.instant.factorisations);
        resolved?;
        self.note_events(&event.mode, at_s);
        (self.state, self.mode) = (event.state, event.mode);
        self.ledger.impact += event.toll.impact;
        self.ledger.dissipated += event.toll.friction;
        self.impulse_sums.push(&event.toll.ground);
        Ok(())
    }

    /// Impulses and contact modes of an event. Where no forces solve the contacts, a foot that slides jams: an impact without
    /// collision stops it, or a motor that cannot hold against that gives way.
    fn resolved(
        &self,
        instant: &mut Instant<N>,
        event: &mut Event<N>,
        legs: &[usize],
        recovery: f64,
        strikes: bool,
    ) -> Result<(), FlowError> {
        let Event {
            state,
            before,
            mode,
            toll,
        } = event;
        if strikes {
            let scene = Scene::new(&self.model, &self.model.side_by_side, before, recovery);
            *toll = instant.impact(&scene, state, legs)?;
        }
        for jams in 0.. {
            let scene = Scene::new(&self.model, &self.model.side_by_side, before, recovery);
            let unsolved = match instant.resolve_modes(&scene, state, legs, mode)? {
                Settled::Done => break,
                Settled::Jammed(unsolved) => unsolved,
            };
            let helped = if jams < JAMS_MAX {
                instant.unjam(&scene, state, legs)?
            } else {
                None
            };
            if let Some(further) = helped {
                toll.add(&further);
                continue;
            }
            let Some(unsolved) = unsolved else { break };
            if jams >= JAMS_MAX || !self.give_way(instant, before) {
                return Err(FlowError::Jammed(unsolved));
            }
            (mode.commands, mode.active.hip) = (before.commands, before.active.hip);
        }
        Ok(())
    }

    /// Notes that the servos of legs whose feet jam are used up, for what jams pushes beyond all measure; says whether that
    /// is news.
    fn give_way(&self, instant: &Instant<N>, mode: &mut Mode) -> bool {
        let Some(Fitted::Servos(servos)) = self.model.drives else {
            return false;
        };
        let mut news = false;
        for leg in 0..self.model.legs.len() {
            let taut = instant.jams_against_cable(leg) && servos.knee.torque().is_finite();
            let saturated = mode.commands.pulley_saturated;
            if taut && saturated.lane(leg) <= 0.0 {
                mode.commands.pulley_saturated = saturated.with_lane(leg, 1.0);
                news = true;
            }
        }
        news
    }

    /// Takes up new commands, or what an event has changed: motors that have their torque again, motors that have none left.
    /// Says whether there are any.
    pub(crate) fn follow_command(&mut self) -> bool {
        /// A motor that changes its mind more often is on the border of its torque; either answer is right there.
        const CHANGES_MAX: usize = 4;
        let Some(Fitted::Servos(servos)) = self.model.drives else {
            return false;
        };
        if servos
            .both()
            .iter()
            .all(|servo| servo.torque().is_infinite())
        {
            return false;
        }
        for changes in 0..CHANGES_MAX {
            let state = self.state;
            let motion = self.motion(&state, 0.0);
            let commands = &self.mode.commands;
            let effort = Effort {
                torques: [motion.forces.hip_torque, motion.forces.knee_torque],
                given: [motion.slope.rates[0], motion.slope.pulley_rate],
                rates: [state.rates[0], state.pulley_rate],
                wanted: [
                    wanted(&servos.hip, commands.hip, state.angles[0], state.rates[0]),
                    wanted(
                        &servos.knee,
                        commands.pulley,
                        state.pulley,
                        state.pulley_rate,
                    ),
                ],
            };
            if !self.saturate(&effort) {
                return changes > 0;
            }
        }
        true
    }
}

#[cfg(test)]
#[path = "event_handling_tests.rs"]
mod tests;
