//! The plant in motion.

use twinrig_contact::Unsolved;
use twinrig_legged::{Fitted, Ledger, NegativeDissipation, Stored};
use twinrig_runtime::WorkCounts;

use crate::articulated::{into_world, stored_in};
use crate::chain::Chain;
use crate::event_driven::{Halt, Stepper, Track};
use crate::events::Instant;
use crate::log::EventKind;
use crate::mode::Mode;
use crate::model::Model;
use crate::moreau::Pushed;
use crate::motion::{Bench, LegForces, Motion, Scene};
use crate::options::Method;
use crate::real::{Lanes, Real};
use crate::site::Site;
use crate::state::{Slope, State};

/// Why time cannot go on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum FlowError {
    #[error(transparent)]
    Unsolved(#[from] Unsolved),
    #[error(
        "a foot is pressed into the ground by its own friction, and no impulse keeps it out: {0}"
    )]
    Jammed(Unsolved),
    #[error("the state is not a number")]
    NotFinite,
    #[error("what is to be closed is open by {by:.3e} m: no forces can close it")]
    Apart { by: f64 },
    #[error(
        "the foot of leg {} is {depth:.3e} m below the ground and sinks: nothing holds it",
        leg + 1
    )]
    Sinks { leg: usize, depth: f64 },
    #[error("a step of {seconds:e} s would have to be shorter than a billionth of a second")]
    TooStiff { seconds: f64 },
    #[error(
        "the iteration for the rates of a step of {seconds:e} s does not converge: it turns links by too much"
    )]
    Unsettled { seconds: f64 },
    #[error("steps of {seconds} s are unstable: they have made {gained:.3e} J out of nothing")]
    Gained { seconds: f64, gained: f64 },
    #[error("steps of {seconds} s are unstable: {why}")]
    Dissipation {
        seconds: f64,
        why: NegativeDissipation,
    },
    #[error("steps of {seconds} s are too long: they have lost {lost:.3e} J into nothing")]
    Lost { seconds: f64, lost: f64 },
}

/// What has been felt, summed over time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ImpulseSums {
    /// Of hip motor, knee motor and cable: ∫ τ dt, ∫ F dt.
    pub(crate) hip: Lanes,
    pub(crate) knee: Lanes,
    pub(crate) cable: Lanes,
    /// Impulses of the ground on each leg, world frame \[N·s\].
    pub(crate) ground: [[f64; 3]; 4],
}

impl ImpulseSums {
    pub(crate) fn new() -> Self {
        let zero = Lanes::zero();
        Self {
            hip: zero,
            knee: zero,
            cable: zero,
            ground: [[0.0; 3]; 4],
        }
    }

    pub(crate) fn add(&mut self, other: &Self) {
        self.hip += other.hip;
        self.knee += other.knee;
        self.cable += other.cable;
        self.push(&other.ground);
    }

    /// Adds impulses of the ground.
    pub(crate) fn push(&mut self, ground: &[[f64; 3]; 4]) {
        for (sum, part) in self
            .ground
            .iter_mut()
            .flatten()
            .zip(ground.iter().flatten())
        {
            *sum += part;
        }
    }
}

/// Events of an island in a step, beyond which they crowd: of the default method, and of one that is
/// chosen for stiff scenes.
const EVENTS_PER_STEP_MAX: u32 = 8;
const CROWD_MAX: u32 = 24;

/// Length of a fallback in steps: the first, and at most. A try costs as much as some ten steps of a fallback.
const BACKOFF: u32 = 25;
const BACKOFF_MAX: u32 = 200;

/// How often its steps are halved there.
const HALVINGS_MAX: u32 = 7;

/// What is to be closed and is open by more than this cannot be closed \[m\].
const APART_MAX: f64 = 1e-3;

/// What a step starts from, kept without asking for memory: all that it changes.
pub(crate) struct Before<const N: usize> {
    state: State<Lanes, N>,
    mode: Mode,
    pub(crate) ledger: Ledger,
    pub(crate) impulse_sums: ImpulseSums,
    stride: Lanes,
    pushed: Pushed,
    rattles: u32,
    backoff: u32,
    calm: u32,
    counts: WorkCounts,
    gained: f64,
    events: usize,
}

/// The plant in motion.
#[derive(Debug, Clone)]
pub(crate) struct Flow<const N: usize> {
    pub(crate) model: Model<N>,
    pub(crate) state: State<Lanes, N>,
    pub(crate) mode: Mode,
    pub(crate) ledger: Ledger,
    pub(crate) counts: WorkCounts,
    pub(crate) impulse_sums: ImpulseSums,
    /// The sums before the last run, and how long that was \[s\].
    pub(crate) impulse_sums_before: ImpulseSums,
    pub(crate) tallied: f64,
    /// The step that each island found good last \[s\].
    pub(crate) stride: Lanes,
    pub(crate) method: Method,
    /// Error that a step may make \[m\].
    pub(crate) tolerance: f64,
    pub(crate) bench: Bench<f64, N>,
    pub(crate) instant: Instant<N>,
    /// Impulses of the last step of [`Method::Moreau`], the first guess of the next; and rates without them.
    pub(crate) pushed: Pushed,
    pub(crate) free_rates: Vec<f64>,
    /// The memory of such a step; gone while there is one.
    pub(crate) midpoint: Option<Box<crate::moreau::Memory<N>>>,
    /// Steps that are left to Moreau's rule, since events crowd.
    pub(crate) rattles: u32,
    pub(crate) backoff: u32,
    /// Steps since the last fallback.
    pub(crate) calm: u32,
    /// Events of an island in a step, beyond which they crowd.
    pub(crate) events_max: u32,
    /// Time at the start of the step \[s\], and what happened since somebody wanted to know.
    pub(crate) now_s: f64,
    pub(crate) logs: bool,
    pub(crate) log: Vec<EventKind>,
    pub(crate) rodas4: crate::rodas4::Memory<N>,
    /// The memory of a march; gone while there is one.
    pub(crate) track: Option<Box<Track<N>>>,
    /// By how much a foot may be wrong after the last step, as the step itself says \[m\].
    pub(crate) estimate: f64,
    /// Energy that steps have made out of nothing of late \[J\].
    pub(crate) gained: f64,
    /// Whether it is where another plant was, and what holds there is still to be found.
    pub(crate) fresh: bool,
}

impl<const N: usize> Flow<N> {
    pub(crate) fn new(
        model: Model<N>,
        state: State<Lanes, N>,
        method: Method,
        tolerance: f64,
    ) -> Self {
        let mut mode = Mode::free();
        match model.drives {
            None => {}
            Some(Fitted::Servos(_)) => {
                mode.active.hip = Lanes::splat(1.0);
                mode.recount();
            }
            Some(Fitted::Motors(_)) => {
                mode.commands.hip_saturated = Lanes::splat(1.0);
                mode.commands.pulley_saturated = Lanes::splat(1.0);
            }
        }
        let mut flow = Self {
            model,
            state,
            mode,
            ledger: Ledger::default(),
            counts: WorkCounts::default(),
            impulse_sums: ImpulseSums::new(),
            impulse_sums_before: ImpulseSums::new(),
            tallied: 0.0,
            stride: Lanes::splat(f64::INFINITY),
            method,
            tolerance,
            bench: Bench::default(),
            instant: Instant::default(),
            pushed: Pushed::default(),
            free_rates: Vec::new(),
            midpoint: None,
            rattles: 0,
            backoff: BACKOFF,
            calm: 0,
            events_max: if method == Method::Rk4 {
                EVENTS_PER_STEP_MAX
            } else {
                CROWD_MAX
            },
            now_s: 0.0,
            logs: false,
            log: Vec::new(),
            rodas4: crate::rodas4::Memory::default(),
            track: None,
            estimate: 0.0,
            gained: 0.0,
            fresh: false,
        };
        flow.ledger = Ledger::opened(flow.stored());
        flow
    }

    /// Moves on by `seconds`, or stays where it is.
    pub(crate) fn step(&mut self, seconds: f64) -> Result<(), FlowError> {
        if self.fresh && self.reactivate().is_err() {
            // Nothing that holds is to be found, so nothing is known to hold.
            self.fresh = false;
        }
        let before = self.saved();
        let moved = match self.method {
            Method::Rk4 => self.run(Stepper::RungeKutta, &before, seconds),
            Method::Rodas4 => self.run(Stepper::Rosenbrock, &before, seconds),
            Method::Moreau => self.run_moreau(seconds),
            Method::SemiImplicit => self.run_semi_implicit(seconds),
            Method::ExplicitEuler => self.run_explicit_euler(seconds),
            Method::Thesis => self.run_thesis(seconds),
        };
        let moved = moved.and_then(|()| self.watch(&before, seconds));
        if moved.is_err() {
            self.back_to(&before);
            (self.stride, self.pushed) = (before.stride, before.pushed);
            (self.rattles, self.backoff) = (before.rattles, before.backoff);
            self.calm = before.calm;
            (self.counts, self.gained) = (before.counts, before.gained);
            self.instant.iterations = self.counts.solver_iterations;
            self.instant.factorisations = self.counts.factorisations;
        }
        moved
    }

    /// Steps between events, unless they are too short for what is stiff: then of the other kind; or too many for what
    /// rattles, or without an answer at one of them: then steps by Moreau's rule, which always has one.
    fn run(&mut self, stepper: Stepper, before: &Before<N>, seconds: f64) -> Result<(), FlowError> {
        if self.rattles > 0 {
            self.rattles -= 1;
            self.fresh = self.rattles == 0;
            return self.moreau_after_chatter(before, seconds);
        }
        match self.event_driven(stepper, seconds) {
            Ok(()) if self.is_unbalanced(&before.ledger) || self.is_restless(before) => {
                self.counts.steps = before.counts.steps;
                self.fall_back();
                self.moreau_after_chatter(before, seconds)
            }
            Ok(()) => {
                self.reset_backoff();
                Ok(())
            }
            Err(Halt::Failed(error @ FlowError::NotFinite)) => Err(error),
            Err(Halt::Stiff | Halt::Failed(_)) if stepper == Stepper::RungeKutta => {
                self.back_to(before);
                self.counts.fallbacks += 1;
                self.run(Stepper::Rosenbrock, before, seconds)
            }
            Err(_) => {
                self.fall_back();
                self.moreau_after_chatter(before, seconds)
            }
        }
    }

    /// Leaves the next steps to Moreau's rule: twice as many each time, as long as the method itself gets nowhere.
    fn fall_back(&mut self) {
        self.rattles = self.backoff;
        self.backoff = (2 * self.backoff).min(BACKOFF_MAX);
        self.calm = 0;
    }

    /// Whether a first step after a fallback has had events. Then their cause is not gone, and what Moreau's rule has left
    /// overlapping has been made an impact of.
    fn is_restless(&self, before: &Before<N>) -> bool {
        self.backoff > BACKOFF && self.calm == 0 && self.counts.events > before.counts.events
    }

    /// Halves the length of the next fallback after as many steps without one.
    fn reset_backoff(&mut self) {
        self.calm += 1;
        if self.calm.is_multiple_of(self.backoff) {
            self.backoff = (self.backoff / 2).max(BACKOFF);
        }
    }

    /// Moreau's rule in the place of another method, in as many steps as it takes to make no energy.
    fn moreau_after_chatter(&mut self, before: &Before<N>, seconds: f64) -> Result<(), FlowError> {
        self.counts.fallbacks += 1;
        for halvings in 0..=HALVINGS_MAX {
            let pieces = 1 << halvings;
            self.back_to(before);
            self.pushed = before.pushed;
            for _ in 0..pieces {
                self.run_moreau(seconds / f64::from(pieces))?;
            }
            if !self.overshot(&before.ledger) {
                if halvings > 0 && self.open() > APART_MAX {
                    return Err(FlowError::Apart { by: self.open() });
                }
                return Ok(());
            }
        }
        Ok(())
    }

    /// Whether every number of the state is one.
    pub(crate) fn finite(&self) -> Result<(), FlowError> {
        let legs = self.model.legs.len();
        let rates = self.state.rates.iter().chain(&self.state.angles);
        let sum = rates.fold(self.state.pulley, |sum, rate| sum + *rate);
        let trunk = self.state.velocity.iter().chain(&self.state.turning);
        let trunk = trunk.chain(&self.state.position).sum::<f64>();
        if trunk.is_finite() && sum.to_array()[..legs].iter().all(|x| x.is_finite()) {
            Ok(())
        } else {
            Err(FlowError::NotFinite)
        }
    }

    /// The part of the flow that a step changes.
    fn saved(&self) -> Before<N> {
        Before {
            state: self.state,
            mode: self.mode,
            ledger: self.ledger,
            impulse_sums: self.impulse_sums,
            stride: self.stride,
            pushed: self.pushed,
            rattles: self.rattles,
            backoff: self.backoff,
            calm: self.calm,
            counts: self.counts,
            gained: self.gained,
            events: self.log.len(),
        }
    }

    fn back_to(&mut self, before: &Before<N>) {
        self.state = before.state;
        self.mode = before.mode;
        (self.ledger, self.impulse_sums) = (before.ledger, before.impulse_sums);
        self.log.truncate(before.events);
        self.stride = Lanes::splat(f64::INFINITY);
    }

    /// How far constraints that hold are open \[m\].
    pub(crate) fn open(&self) -> f64 {
        let scene = Scene::new(&self.model, &self.model.side_by_side, &self.mode, 0.0);
        let chain = Chain::new(scene.legs, &self.state.angles, &self.state.rates);
        let drive = scene.drive(&self.state);
        let active = &self.mode.active;
        let mut worst = 0.0_f64;
        for (constraint, active) in [
            (chain.closed(scene.legs, &self.state.angles), active.closed),
            (chain.open(scene.legs), active.open),
            (chain.extended(scene.legs), active.extended),
            (chain.bottomed(scene.legs), active.bottomed),
            (chain.taut(scene.legs, &drive), active.cable),
        ] {
            for leg in 0..self.model.legs.len() {
                worst = worst.max((constraint.gap * active).lane(leg).abs());
            }
        }
        worst
    }

    /// What moves by itself: the robot, or each of its legs where the trunk is held. Legs, one after the other.
    pub(crate) fn islands(&self) -> impl Iterator<Item = core::ops::Range<usize>> + use<N> {
        let (legs, free) = (self.model.legs.len(), self.model.is_free());
        let islands = if free { 1 } else { legs };
        (0..islands).map(move |i| if free { 0..legs } else { i..i + 1 })
    }

    /// The right-hand side in a state, without what it was made from. Adds what is felt to sums, as many seconds of it.
    #[inline(never)]
    pub(crate) fn stage(
        &mut self,
        state: &State<Lanes, N>,
        recovery: f64,
        felt_for: Option<(Lanes, &mut ImpulseSums)>,
    ) -> Slope<Lanes, N> {
        if !self.mode.contacts.is_empty() {
            let motion = self.motion(state, recovery);
            if let Some((seconds, impulse_sums)) = felt_for {
                self.feel(state, &motion, seconds, impulse_sums);
            }
            return motion.slope;
        }
        self.counts.evaluations += 1;
        let scene = Scene::new(&self.model, &self.model.side_by_side, &self.mode, recovery);
        let (slope, forces) = scene.slope_aloft(state);
        if let Some((seconds, impulse_sums)) = felt_for {
            self.feel_motors(&forces, seconds, impulse_sums);
        }
        slope
    }

    /// The right-hand side in a state.
    #[inline(never)]
    pub(crate) fn motion(&mut self, state: &State<Lanes, N>, recovery: f64) -> Motion<Lanes, N> {
        self.counts.evaluations += 1;
        let scene = Scene::new(&self.model, &self.model.side_by_side, &self.mode, recovery);
        scene.motion(state, &mut self.bench)
    }

    /// The same in the place of another.
    #[inline(never)]
    pub(crate) fn motion_into(
        &mut self,
        state: &State<Lanes, N>,
        recovery: f64,
        motion: &mut Motion<Lanes, N>,
    ) {
        self.counts.evaluations += 1;
        let scene = Scene::new(&self.model, &self.model.side_by_side, &self.mode, recovery);
        scene.motion_into(state, &mut self.bench, motion);
    }

    /// Kinetic, spring and gravity energy \[J\].
    pub(crate) fn stored(&self) -> Stored {
        stored_in(&self.model, &self.model.side_by_side, &self.state)
    }

    /// Adds what a motion feels to sums, `weight` seconds of it. The feet's forces are those on the bench.
    #[inline(always)]
    pub(crate) fn feel(
        &self,
        state: &State<Lanes, N>,
        motion: &Motion<Lanes, N>,
        weight: Lanes,
        impulse_sums: &mut ImpulseSums,
    ) {
        self.feel_motors(&motion.forces, weight, impulse_sums);
        self.feel_ground(state, motion, weight, impulse_sums);
    }

    #[inline(always)]
    pub(crate) fn feel_motors(
        &self,
        forces: &LegForces<Lanes>,
        weight: Lanes,
        impulse_sums: &mut ImpulseSums,
    ) {
        if self.model.drives.is_some() {
            impulse_sums.hip += weight * forces.hip_torque;
            impulse_sums.knee += weight * forces.knee_torque;
            // A motion ends past an event by the error of its time. Nothing pushes there.
            let tension = forces.forces[crate::constraints::CABLE];
            impulse_sums.cable +=
                weight * tension.clamped(Lanes::zero(), Lanes::splat(f64::INFINITY));
        }
    }

    pub(crate) fn feel_ground(
        &self,
        state: &State<Lanes, N>,
        motion: &Motion<Lanes, N>,
        weight: Lanes,
        impulse_sums: &mut ImpulseSums,
    ) {
        let Some(ground) = &self.model.ground else {
            return;
        };
        if self.mode.contacts.is_empty() {
            return;
        }
        let rotation = motion.articulated.rotation();
        let mut forces = self.bench.forces.as_slice();
        for contact in &self.mode.contacts {
            let legs = &self.model.side_by_side;
            let site = Site::new(
                legs,
                &motion.articulated.chain,
                state,
                contact.leg,
                contact.links,
            );
            let footing = site.footing(ground, state.position, &rotation);
            let [n, a, b] = footing.directions;
            let rows = if contact.slides.is_some() { 1 } else { 3 };
            let (of_contact, others) = forces.split_at(rows);
            forces = others;
            if of_contact[0] <= 0.0 {
                // The motion ends past an event by the error of its time. Nothing pulls.
                continue;
            }
            let own: [f64; 3] = if let Some(last) = contact.slides {
                let s = crate::motion::sliding(&footing, last);
                let along = |i: usize| s[0] * a[i] + s[1] * b[i];
                std::array::from_fn(|i| of_contact[0] * (n[i] - ground.friction * along(i)))
            } else {
                std::array::from_fn(|i| {
                    of_contact[0] * n[i] + of_contact[1] * a[i] + of_contact[2] * b[i]
                })
            };
            let seconds = weight.lane(contact.leg);
            for (sum, part) in impulse_sums.ground[contact.leg]
                .iter_mut()
                .zip(into_world(&rotation, own))
            {
                *sum += seconds * part;
            }
        }
    }
}

#[cfg(test)]
#[path = "flow_tests.rs"]
mod tests;
