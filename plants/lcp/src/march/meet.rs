//! What is done where a step begins and where an event ends it: motors obey, what strikes strikes, and what holds is chosen.

use twinrig_legged::Fitted;

use super::{ALL, AT_ONCE_MAX, AT_REST, Due, Halt, Progress, SHORTEST, TOUCHING, Track};
use crate::drives::wanted;
use crate::flow::{Flow, FlowError};
use crate::guards::{GUARDS, Guard, kind};
use crate::motors::Effort;
use crate::real::Real;

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
        let mut mode = self.mode;
        let mut instant = core::mem::take(&mut self.instant);
        let scene = self.scene(recovery);
        let settled = instant.settle(&scene, &self.state, &ALL[legs], &mut mode);
        self.instant = instant;
        (self.counts.solver_iterations, self.counts.factorisations) =
            (self.instant.iterations, self.instant.factorisations);
        settled?;
        self.note_events(&mode, self.now_s);
        self.mode = mode;
        Ok(())
    }

    /// Meets the events that are due; says whether there were any.
    pub(super) fn meet_all(
        &mut self,
        due: &[Option<Due>; 4],
        progress: &mut Progress,
        recovery: f64,
        seconds: f64,
    ) -> Result<bool, Halt> {
        let mut met = false;
        for (i, (island, due)) in self.islands().zip(due).enumerate() {
            let Some(due) = due.filter(|due| due.met) else {
                continue;
            };
            met = true;
            self.counts.events += 1;
            progress.events[i] += 1;
            progress.at_once = if due.at < SHORTEST {
                progress.at_once + 1
            } else {
                0
            };
            if progress.at_once > AT_ONCE_MAX || progress.events[i] > self.events_max {
                return Err(Halt::Crowded);
            }
            let at_s = self.now_s + (seconds - progress.remaining.lane(due.leg));
            self.meet(island, recovery, at_s)?;
        }
        Ok(met)
    }

    /// Impact and change of mode of these legs.
    pub(super) fn meet(
        &mut self,
        legs: core::ops::Range<usize>,
        recovery: f64,
        at_s: f64,
    ) -> Result<(), FlowError> {
        let (mut state, mut mode) = (self.state, self.mode);
        let mut instant = core::mem::take(&mut self.instant);
        let scene = self.scene(recovery);
        let legs = &ALL[legs];
        let toll = instant.impact(&scene, &mut state, legs);
        let settled = toll.and_then(|toll| {
            instant.settle(&scene, &state, legs, &mut mode)?;
            Ok(toll)
        });
        self.instant = instant;
        (self.counts.solver_iterations, self.counts.factorisations) =
            (self.instant.iterations, self.instant.factorisations);
        let toll = settled?;
        self.note_events(&mode, at_s);
        (self.state, self.mode) = (state, mode);
        self.ledger.impact += toll.impact;
        self.ledger.dissipated += toll.friction;
        self.tally.push(&toll.ground);
        Ok(())
    }

    /// Takes up new commands: motors that have their torque again, motors that have none left.
    pub(crate) fn obey(&mut self) {
        /// A motor that changes its mind more often is on the border of its torque; either answer is right there.
        const CHANGES_MAX: usize = 4;
        let Some(Fitted::Servos(servos)) = self.model.drives else {
            return;
        };
        if servos
            .both()
            .iter()
            .all(|servo| servo.torque().is_infinite())
        {
            return;
        }
        for _ in 0..CHANGES_MAX {
            let state = self.state;
            let motion = self.motion(&state, 0.0);
            let commands = &self.mode.commands;
            let effort = Effort {
                torques: [motion.felt.hip_torque, motion.felt.knee_torque],
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
            if !self.tire(&effort) {
                return;
            }
        }
    }
}
