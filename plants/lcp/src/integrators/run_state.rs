//! State of a run: what every method advances.

use twinrig_legged::{DriveModels, ExternalLoad, Ledger, StepLoad, Stored};
use twinrig_runtime::WorkCounts;

use super::impulse_sums::ImpulseSums;
use super::step_error::StepError;
use crate::constraints::log::EventLog;
use crate::constraints::mode::Mode;
use crate::constraints::motion::Dynamics;
use crate::model::Model;
use crate::model::chain::Chain;
use crate::model::energy::stored_in;
use crate::model::real::{Lanes, Real};
use crate::model::rotation::rotation;
use crate::model::site::{Footing, Site};
use crate::model::state::State;

/// Continuous and discrete state, and the sums over a run. Methods advance it and own nothing in
/// it.
#[derive(Debug, Clone)]
pub(crate) struct RunState<const N: usize> {
    pub(crate) state: State<Lanes, N>,
    pub(crate) mode: Mode,
    pub(crate) ledger: Ledger,
    pub(crate) impulse_sums: ImpulseSums,
    pub(crate) counts: WorkCounts,
    pub(crate) log: EventLog,
    /// Time at the start of the step \[s\].
    pub(crate) now_s: f64,
    /// Time since the start of the step of methods that hold a mean load \[s\].
    pub(crate) elapsed_s: f64,
    /// Load of pushes in the step.
    load: StepLoad,
}

/// Part of a [`RunState`] that a step changes, saved without heap allocation.
pub(crate) struct Checkpoint<const N: usize> {
    state: State<Lanes, N>,
    mode: Mode,
    pub(crate) ledger: Ledger,
    pub(crate) impulse_sums: ImpulseSums,
    pub(crate) counts: WorkCounts,
    events: usize,
}

impl<const N: usize> RunState<N> {
    /// Starts a run in a state, without active constraints.
    pub(crate) fn new(model: &Model<N>, state: State<Lanes, N>) -> Self {
        let mut mode = Mode::free();
        match model.drives {
            None => {}
            Some(DriveModels::Servos(_)) => {
                mode.active.hip = Lanes::splat(1.0);
                mode.update_any();
            }
            Some(DriveModels::Motors(_)) => {
                mode.commands.hip_saturated = Lanes::splat(1.0);
                mode.commands.pulley_saturated = Lanes::splat(1.0);
            }
        }
        let mut run = Self {
            state,
            mode,
            ledger: Ledger::default(),
            impulse_sums: ImpulseSums::new(),
            counts: WorkCounts::default(),
            log: EventLog::default(),
            now_s: 0.0,
            elapsed_s: 0.0,
            load: StepLoad::default(),
        };
        run.ledger = Ledger::opened(run.stored(model));
        run
    }

    /// Returns the dynamics in the present mode, with this decay rate of constraint errors \[1/s\].
    #[inline(always)]
    pub(crate) fn dynamics<'a>(
        &'a self,
        model: &'a Model<N>,
        recovery: f64,
    ) -> Dynamics<'a, Lanes, N> {
        Dynamics::new(model, &model.side_by_side, &self.mode, recovery)
    }

    /// Sets the load of pushes in the next step.
    pub(crate) fn set_load(&mut self, load: &StepLoad) {
        self.load.copy_from(load);
        self.mode.load = (!load.is_empty()).then(|| load.at(0.0));
    }

    /// Sets the load of the present stage to that after some time of the step \[s\].
    pub(crate) fn set_load_at(&mut self, model: &Model<N>, times: Lanes) {
        self.set_stage_load(model, |load, leg| load.at(times.lane(leg)));
    }

    /// Sets the load of the present stage to its mean between two times of the step \[s\].
    pub(crate) fn set_mean_load(&mut self, model: &Model<N>, [from, to]: [Lanes; 2]) {
        self.set_stage_load(model, |load, leg| load.mean(from.lane(leg), to.lane(leg)));
    }

    /// Sets the mean load over the next `seconds` of a method of fixed steps.
    pub(crate) fn hold_mean_load(&mut self, model: &Model<N>, seconds: f64) {
        let ends = [self.elapsed_s, self.elapsed_s + seconds];
        self.set_mean_load(model, ends.map(Lanes::splat));
    }

    /// Legs on a fixed trunk have times of their own.
    fn set_stage_load(
        &mut self,
        model: &Model<N>,
        of_leg: impl Fn(&StepLoad, usize) -> ExternalLoad,
    ) {
        if self.load.is_empty() {
            return;
        }
        let mut load = of_leg(&self.load, 0);
        if !model.is_free() {
            for (leg, force) in load.feet.iter_mut().enumerate() {
                *force = of_leg(&self.load, leg).feet[leg];
            }
        }
        self.mode.load = Some(load);
    }

    /// Returns kinetic, spring and gravity energy \[J\].
    pub(crate) fn stored(&self, model: &Model<N>) -> Stored {
        stored_in(model, &model.side_by_side, &self.state)
    }

    /// Returns an error if a number of the state is not finite.
    pub(crate) fn check_finite(&self, model: &Model<N>) -> Result<(), StepError> {
        let legs = model.legs.len();
        let rates = self.state.rates.iter().chain(&self.state.angles);
        let sum = rates.fold(self.state.pulley, |sum, rate| sum + *rate);
        let trunk = self.state.velocity.iter().chain(&self.state.turning);
        let trunk = trunk.chain(&self.state.position).sum::<f64>();
        if trunk.is_finite() && sum.to_array()[..legs].iter().all(|x| x.is_finite()) {
            Ok(())
        } else {
            Err(StepError::NotFinite)
        }
    }

    /// Returns the maximum violation of the active constraints \[m\].
    pub(crate) fn violation(&self, model: &Model<N>) -> f64 {
        let dynamics = self.dynamics(model, 0.0);
        let chain = Chain::new(dynamics.legs, &self.state.angles, &self.state.rates);
        let drive = dynamics.drive(&self.state);
        let active = &self.mode.active;
        let mut worst = 0.0_f64;
        for (constraint, active) in [
            (
                chain.closed(dynamics.legs, &self.state.angles),
                active.closed,
            ),
            (chain.open(dynamics.legs), active.open),
            (chain.extended(dynamics.legs), active.extended),
            (chain.bottomed(dynamics.legs), active.bottomed),
            (chain.taut(dynamics.legs, &drive), active.cable),
        ] {
            for leg in 0..model.legs.len() {
                worst = worst.max((constraint.gap * active).lane(leg).abs());
            }
        }
        worst
    }

    /// Returns a contact point of one leg; computes this leg only.
    pub(crate) fn site_of(
        state: &State<Lanes, N>,
        model: &Model<N>,
        leg: usize,
        links: usize,
    ) -> Site<f64, N> {
        let of = |lanes: &[Lanes; N]| lanes.map(|lane| lane.lane(leg));
        let turns = of(&state.angles).map(Real::sin_cos);
        let (sines, cosines) = (turns.map(|(sine, _)| sine), turns.map(|(_, cosine)| cosine));
        Site::from_turns(
            &model.legs[leg].constants,
            [&sines, &cosines, &of(&state.rates)],
            [state.velocity, state.turning],
            0,
            links,
        )
    }

    /// Returns gap and velocity of a contact point relative to the ground; none without ground.
    pub(crate) fn footing(
        &self,
        model: &Model<N>,
        leg: usize,
        links: usize,
    ) -> Option<Footing<f64>> {
        Self::footing_of(&self.state, model, leg, links)
    }

    /// Returns the same in another state.
    pub(crate) fn footing_of(
        state: &State<Lanes, N>,
        model: &Model<N>,
        leg: usize,
        links: usize,
    ) -> Option<Footing<f64>> {
        let ground = model.ground.as_ref()?;
        let upright = rotation(state.attitude);
        let site = Self::site_of(state, model, leg, links);
        Some(site.footing(ground, state.position, &upright))
    }

    /// Logs the differences between the present mode and `next`.
    pub(crate) fn log_changes(&mut self, model: &Model<N>, next: &Mode, at_s: f64) {
        self.log
            .record(model.legs.len(), N, [&self.mode, next], at_s);
    }

    /// Saves the values that a step changes.
    pub(crate) fn checkpoint(&self) -> Checkpoint<N> {
        Checkpoint {
            state: self.state,
            mode: self.mode,
            ledger: self.ledger,
            impulse_sums: self.impulse_sums,
            counts: self.counts,
            events: self.log.events.len(),
        }
    }

    /// Restores these values, except the counts: discarded work was done.
    pub(crate) fn roll_back(&mut self, before: &Checkpoint<N>) {
        self.state = before.state;
        self.mode = before.mode;
        (self.ledger, self.impulse_sums) = (before.ledger, before.impulse_sums);
        self.log.events.truncate(before.events);
        self.elapsed_s = 0.0;
    }
}
