//! Handling of the start of a step and of events: saturation of motors, impacts, and selection of
//! the active constraints.

use twinrig_legged::DriveModels;

use super::buffers::{Buffers, motion_key};
use super::{
    AT_ONCE_MAX, AT_REST, EventDriven, Halt, LocatedEvent, Progress, SHORTEST, TOUCHING, tolerances,
};
use crate::constraints::events::{ImpactTotals, Instant, ModeResolution, STOPPED};
use crate::constraints::guards::{GUARDS, Guard, kind, links_of};
use crate::constraints::mode::Mode;
use crate::constraints::motion::Dynamics;
use crate::integrators::run_state::RunState;
use crate::integrators::step_error::StepError;
use crate::model::Model;
use crate::model::constants::ALL;
use crate::model::real::{Lanes, Real};
use crate::model::state::State;

/// Maximum number of impacts without collision and of resulting motor saturations at one instant.
const JAMS_MAX: u32 = 8;

/// State of an event during its resolution.
struct Event<const N: usize> {
    state: State<Lanes, N>,
    /// Active constraints before the event, and the drives.
    before: Mode,
    /// Active constraints after the event.
    mode: Mode,
    totals: ImpactTotals,
}

impl<const N: usize> EventDriven<N> {
    /// Computes motion and guards at the start, in a consistent mode.
    pub(super) fn start(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        recovery: f64,
        buffers: &mut Buffers<N>,
    ) -> Result<(), Halt> {
        let state = run.state;
        if buffers.key.is_none() || buffers.key != motion_key(run, recovery) {
            self.rhs
                .motion_into(model, run, &state, recovery, &mut buffers.start);
            self.rhs
                .update_guards(model, run, &state, &buffers.start, &mut buffers.guards);
        }
        let guards = &buffers.guards;
        let tolerances = tolerances(model);
        let near: [f64; GUARDS] = std::array::from_fn(|index| match kind(index) {
            Guard::Gap => -TOUCHING,
            _ => tolerances[index],
        });
        if !guards.any_below(&near) {
            return Ok(());
        }
        // A constraint deactivated at this instant may become active again under new commands.
        let resting = |index: usize, leg: usize| {
            let [gap, rate] = [&guards.values, &guards.rates].map(|of| of[index].lane(leg));
            gap < TOUCHING && rate.abs() < AT_REST
        };
        let mut changed = false;
        for island in model.islands() {
            let violated = |leg: usize| {
                (0..GUARDS).any(|index| match kind(index) {
                    Guard::Gap => resting(index, leg),
                    _ => guards.values[index].lane(leg) < -tolerances[index],
                })
            };
            if island.clone().any(violated) {
                changed = true;
                self.select_modes(model, run, island, recovery, run.now_s)?;
            }
        }
        if changed {
            let state = run.state;
            self.rhs
                .motion_into(model, run, &state, recovery, &mut buffers.start);
            self.rhs
                .update_guards(model, run, &state, &buffers.start, &mut buffers.guards);
        }
        Ok(())
    }

    /// Selects the active constraints of these legs anew at this time \[s\], without an impact.
    pub(crate) fn select_modes(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        legs: core::ops::Range<usize>,
        recovery: f64,
        at_s: f64,
    ) -> Result<(), StepError> {
        self.resolve_event(model, run, legs, recovery, at_s, false)
    }

    /// Handles the located events; returns whether there were any.
    pub(super) fn handle_events(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        events: &[Option<LocatedEvent>; 4],
        progress: &mut Progress,
    ) -> Result<bool, Halt> {
        let mut handled = false;
        for (i, (island, event)) in model.islands().zip(events).enumerate() {
            let Some(event) = event.filter(|event| event.is_event) else {
                continue;
            };
            handled = true;
            if kind(event.index) == Guard::TangentialImpulse && slide_continues(model, run, &event)
            {
                continue;
            }
            run.counts.events += 1;
            progress.events[i] += 1;
            progress.at_once = if event.at < SHORTEST {
                progress.at_once + 1
            } else {
                0
            };
            if progress.at_once > AT_ONCE_MAX || progress.events[i] > self.events_max {
                return Err(Halt::TooManyEvents);
            }
            let at_s = run.now_s + (progress.seconds - progress.remaining.lane(event.leg));
            self.handle_event(model, run, island, progress.recovery, at_s)?;
        }
        Ok(handled)
    }

    /// Resolves the impact and the change of mode of these legs.
    pub(super) fn handle_event(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        legs: core::ops::Range<usize>,
        recovery: f64,
        at_s: f64,
    ) -> Result<(), StepError> {
        self.resolve_event(model, run, legs, recovery, at_s, true)
    }

    /// Computes velocities and contact modes of these legs after an event, with or without an
    /// impact.
    fn resolve_event(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        legs: core::ops::Range<usize>,
        recovery: f64,
        at_s: f64,
        with_impact: bool,
    ) -> Result<(), StepError> {
        let mut event = Event {
            state: run.state,
            before: run.mode,
            mode: run.mode,
            totals: ImpactTotals::default(),
        };
        let instant = &mut self.instant;
        let resolved = event.solve(instant, model, &ALL[legs], recovery, with_impact);
        self.instant.drain_counts(&mut run.counts);
        resolved?;
        run.log_changes(model, &event.mode, at_s);
        (run.state, run.mode) = (event.state, event.mode);
        run.ledger.impact += event.totals.impact;
        run.ledger.dissipated += event.totals.friction;
        run.impulse_sums.add_ground(&event.totals.ground);
        Ok(())
    }
}

impl<const N: usize> Event<N> {
    /// Computes impulses and contact modes of an event. Where no forces solve the contacts, a
    /// sliding foot jams: an impact without collision stops it, or a motor that cannot hold against
    /// it saturates.
    fn solve(
        &mut self,
        instant: &mut Instant<N>,
        model: &Model<N>,
        legs: &[usize],
        recovery: f64,
        with_impact: bool,
    ) -> Result<(), StepError> {
        let Self {
            state,
            before,
            mode,
            totals,
        } = self;
        instant.begin_event();
        if with_impact {
            let dynamics = Dynamics::new(model, &model.side_by_side, before, recovery);
            *totals = instant.impact(&dynamics, state, legs)?;
        }
        for jams in 0.. {
            let dynamics = Dynamics::new(model, &model.side_by_side, before, recovery);
            let unsolved = match instant.resolve_modes(&dynamics, state, legs, mode)? {
                ModeResolution::Resolved => break,
                ModeResolution::Jammed(unsolved) => unsolved,
            };
            let jam_impact = if jams < JAMS_MAX {
                instant.resolve_jam(&dynamics, state, legs)?
            } else {
                None
            };
            if let Some(additional) = jam_impact {
                totals.add(&additional);
                continue;
            }
            let Some(unsolved) = unsolved else { break };
            if jams >= JAMS_MAX || !saturate_jammed(model, instant, before) {
                return Err(StepError::Jammed(unsolved));
            }
            (mode.commands, mode.active.hip) = (before.commands, before.active.hip);
        }
        Ok(())
    }
}

/// Returns whether a slide that ends along its last direction continues along another one, and
/// stores the new direction. That is no event: friction follows the slide, and the speed is not
/// zero.
fn slide_continues<const N: usize>(
    model: &Model<N>,
    run: &mut RunState<N>,
    event: &LocatedEvent,
) -> bool {
    let links = links_of(event.index);
    let Some(footing) = run.footing(model, event.leg, links) else {
        return false;
    };
    let [_, a, b] = footing.velocity;
    let speed = libm::hypot(a, b);
    if speed < STOPPED {
        return false;
    }
    let mut contacts = run.mode.contacts.iter_mut();
    let contact = contacts.find(|c| (c.leg, c.links) == (event.leg, links));
    if let Some(contact) = contact {
        contact.slides = Some([a / speed, b / speed]);
    }
    true
}

/// Saturates the servos of legs with a jammed foot, since the jamming force exceeds every
/// limit; returns whether any servo changed.
fn saturate_jammed<const N: usize>(
    model: &Model<N>,
    instant: &Instant<N>,
    mode: &mut Mode,
) -> bool {
    let Some(DriveModels::Servos(servos)) = model.drives else {
        return false;
    };
    let mut changed = false;
    for leg in 0..model.legs.len() {
        let taut = instant.is_jammed_against_cable(leg) && servos.knee.torque().is_finite();
        let saturated = mode.commands.pulley_saturated;
        if taut && saturated.lane(leg) <= 0.0 {
            mode.commands.pulley_saturated = saturated.with_lane(leg, 1.0);
            changed = true;
        }
    }
    changed
}

#[cfg(test)]
mod tests;
