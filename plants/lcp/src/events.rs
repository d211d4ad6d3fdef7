//! What happens at an instant: impacts, and what holds afterwards.
//!
//! Both are complementarity problems over the constraints that are closed at that instant ([`twinrig_contact::Problem`]):
//!
//! ```text
//! impulses   q̇⁺ = q̇⁻ + H⁻¹ Jᵀ P    0 ≤ Pₙ ⊥ ġ⁺ + e ġ⁻ ≥ 0    |Pₜ| ≤ µ Pₙ
//! forces     q̈  = a + H⁻¹ Jᵀ λ     0 ≤ λₙ ⊥ g̈ ≥ 0             |λₜ| ≤ µ λₙ
//! ```

pub(crate) mod constrained;

use core::mem;

use twinrig_contact::{Bound, Method, Problem, Restitution, Solution, Unsolved};
use twinrig_legged::Fitted;

use crate::articulated::{Articulated, Response, Row, between_links};
use crate::hold::{Driven, Hold, Holding};
use crate::mode::{Contact, Mode};
use crate::motion::Scene;
use crate::real::{Lanes, Real};
use crate::site::{Footing, Site};
use crate::state::State;

/// Gaps below this are closed \[m\].
const CLOSED: f64 = 1e-8;

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

/// Feet that slide slower than this hold \[m/s\].
const HOLDING: f64 = 1e-7;

/// Accelerations of what is to hold that are taken for none where no better is found \[m/s²\].
const SETTLED: f64 = 1e-4;

/// Approach below which an impact gives nothing back \[m/s\].
const RESTING: f64 = 0.05;

/// Share of a row's mobility that others must leave it, or it says what they say.
const INDEPENDENT: f64 = 1e-9;

/// Directions that are worked on side by side.
const ABREAST: usize = 4;

/// A one-sided constraint inside a leg, in the order of the guards.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stop {
    Closed,
    Open,
    Extended,
    Bottomed,
    Cable,
}

impl Stop {
    pub(crate) const ALL: [Self; 5] = [
        Self::Closed,
        Self::Open,
        Self::Extended,
        Self::Bottomed,
        Self::Cable,
    ];

    /// Where it holds, as a mode has it.
    pub(crate) fn held(self, mode: &Mode) -> Lanes {
        let holds = &mode.holds;
        match self {
            Self::Closed => holds.closed,
            Self::Open => holds.open,
            Self::Extended => holds.extended,
            Self::Bottomed => holds.bottomed,
            Self::Cable => holds.cable,
        }
    }

    /// Where a mode notes that it holds.
    pub(crate) fn of(self, mode: &mut Mode) -> &mut Lanes {
        let holds = &mut mode.holds;
        match self {
            Self::Closed => &mut holds.closed,
            Self::Open => &mut holds.open,
            Self::Extended => &mut holds.extended,
            Self::Bottomed => &mut holds.bottomed,
            Self::Cable => &mut holds.cable,
        }
    }
}

/// Whether a gap is closed.
fn touching(gap: f64, _: f64) -> bool {
    gap < CLOSED
}

/// What a row of a problem stands for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Role {
    Stop(Stop),
    /// Normal of a foot; where it slides, its friction comes with it.
    Normal {
        links: usize,
        slides: Option<[f64; 2]>,
    },
    /// The first or second tangent of such a foot.
    Tangent {
        links: usize,
        which: usize,
    },
}

impl Role {
    /// Its place among the forces on a leg.
    pub(crate) const fn place(self) -> usize {
        match self {
            Self::Stop(stop) => stop as usize,
            Self::Normal { links, .. } => 5 + 3 * (links - 3),
            Self::Tangent { links, which } => 5 + 3 * (links - 3) + which,
        }
    }

    pub(crate) const fn is_tangent(self) -> bool {
        matches!(self, Self::Tangent { .. })
    }
}

/// Forces on a leg that may be there at once, by [`Role::place`].
pub(crate) const PLACES: usize = 11;

/// A closed constraint.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry<const N: usize> {
    pub(crate) role: Role,
    pub(crate) row: Row<f64, N>,
    /// The direction of its force: the row, but for feet that slide.
    pub(crate) push: Row<f64, N>,
    pub(crate) gap: f64,
    /// Whether it has held so far, and whether it parts.
    held: bool,
    parts: bool,
    /// Rate of the gap, and its acceleration while everything moves evenly.
    pub(crate) rate: f64,
    pub(crate) bias: f64,
    /// What a pulley does to the gap of its cable \[m/s²\], and its mobility at the cable's end \[1/kg\].
    pub(crate) winding: f64,
    compliance: f64,
    /// Where a foot is pushed to, world frame.
    pub(crate) direction: [f64; 3],
}

/// The memory of impacts and changes of mode.
#[derive(Debug, Clone, Default)]
pub(crate) struct Instant<const N: usize> {
    pub(crate) entries: Vec<Entry<N>>,
    rows: Vec<Response<f64, N>>,
    pub(crate) pushes: Vec<Response<f64, N>>,
    pub(crate) problem: Problem,
    /// The pushes' responses of the trunk, some side by side, component by component.
    trunks: Vec<[[f64; ABREAST]; 6]>,
    before: Vec<f64>,
    /// Rates of closed gaps before the impact that the next choice of what holds comes after; none if there was no impact.
    drifts: Option<[[f64; PLACES]; 4]>,
    coefficients: Vec<f64>,
    pub(crate) iterations: u64,
    pub(crate) factorisations: u64,
}

/// What an impact took: by normal impulses, by friction \[J\], and the ground's impulses on each leg, world frame \[N·s\].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Toll {
    pub(crate) impact: f64,
    pub(crate) friction: f64,
    pub(crate) ground: [[f64; 3]; 4],
}

impl<const N: usize> Instant<N> {
    /// Finds the constraints of these legs that are closed. Feet that slide push along their friction where `sliding` says
    /// that they go on to.
    #[expect(
        clippy::too_many_arguments,
        reason = "what a step is about, each by its name"
    )]
    pub(crate) fn find(
        &mut self,
        scene: &Scene<'_, Lanes, N>,
        state: &State<Lanes, N>,
        articulated: &Articulated<Lanes, N>,
        drive: &Driven<Lanes>,
        legs: &[usize],
        sliding: bool,
        closed: &dyn Fn(f64, f64) -> bool,
    ) {
        self.entries.clear();
        let chain = &articulated.chain;
        let stops = [
            chain.closed(scene.legs, &state.angles),
            chain.open(scene.legs),
            chain.extended(scene.legs),
            chain.bottomed(scene.legs),
            chain.taut(scene.legs, drive),
        ];
        let radius = scene.legs.pulley_radius;
        for &leg in legs {
            for (stop, hold) in Stop::ALL.into_iter().zip(&stops) {
                if stop == Stop::Cable && scene.model.drives.is_none() {
                    continue;
                }
                let (gap, rate) = (hold.gap.lane(leg), hold.rate.lane(leg));
                let held = stop.held(scene.mode).lane(leg) != 0.0;
                if !held && !closed(gap, rate) {
                    continue;
                }
                let (mut compliance, mut winding) = (0.0, 0.0);
                if stop == Stop::Cable {
                    let r = radius.lane(leg);
                    compliance = r * r * drive.pulley_mobility.lane(leg);
                    winding = -r * drive.pulley_acceleration.lane(leg);
                }
                let row = stop_row(hold, leg);
                self.entries.push(Entry {
                    role: Role::Stop(stop),
                    row,
                    push: row,
                    gap,
                    held,
                    parts: false,
                    rate,
                    bias: hold.curvature.lane(leg),
                    winding,
                    compliance,
                    direction: [0.0; 3],
                });
            }
            self.find_feet(scene, state, articulated, leg, sliding, closed);
        }
    }

    fn find_feet(
        &mut self,
        scene: &Scene<'_, Lanes, N>,
        state: &State<Lanes, N>,
        articulated: &Articulated<Lanes, N>,
        leg: usize,
        sliding: bool,
        closed: &dyn Fn(f64, f64) -> bool,
    ) {
        let Some(ground) = &scene.model.ground else {
            return;
        };
        let rotation = articulated.rotation();
        for links in 3..=N {
            let site = Site::new(scene.legs, &articulated.chain, state, leg, links);
            let footing = site.footing(ground, state.position, &rotation);
            let held = scene.mode.contacts.iter();
            let held = held.clone().any(|c| (c.leg, c.links) == (leg, links));
            if !held && !closed(footing.gap, footing.velocity[0]) {
                continue;
            }
            let [_, a, b] = footing.velocity;
            let speed = libm::hypot(a, b);
            let slides = if speed > HOLDING {
                Some([a / speed, b / speed])
            } else {
                // On ice there is nothing to hold.
                (ground.friction == 0.0).then_some([1.0, 0.0])
            };
            let slides = slides.filter(|_| sliding);
            let [n, along, across] = footing.directions;
            let [forward, sideways] = footing.surface.tangents();
            let world = [footing.surface.normal, forward, sideways].map(<[f64; 3]>::from);
            let push = slides.map_or(n, |s| {
                std::array::from_fn(|i| {
                    n[i] - ground.friction * (s[0] * along[i] + s[1] * across[i])
                })
            });
            let entry = |k: usize, role, push| Entry {
                role,
                row: site.row(footing.directions[k]),
                push,
                gap: footing.gap,
                held,
                parts: false,
                rate: footing.velocity[k],
                bias: footing.bias[k],
                winding: 0.0,
                compliance: 0.0,
                direction: world[k],
            };
            self.entries
                .push(entry(0, Role::Normal { links, slides }, site.row(push)));
            if slides.is_none() {
                for k in 1..3 {
                    let own = site.row(footing.directions[k]);
                    self.entries
                        .push(entry(k, Role::Tangent { links, which: k }, own));
                }
            }
        }
    }

    /// Fills the problem's matrix and bounds.
    pub(crate) fn prepare(&mut self, articulated: &Articulated<Lanes, N>, friction: f64) {
        let n = self.entries.len();
        self.problem.reset(n);
        self.rows.clear();
        self.pushes.clear();
        for entry in &self.entries {
            let row = articulated.response(&entry.row);
            self.rows.push(row);
            self.pushes.push(match entry.role {
                Role::Normal {
                    slides: Some(_), ..
                } => articulated.response(&entry.push),
                _ => row,
            });
        }
        self.trunks.clear();
        for pushes in self.pushes.chunks(ABREAST) {
            self.trunks.push(std::array::from_fn(|k| {
                std::array::from_fn(|j| pushes.get(j).map_or(0.0, |push| push.trunk[k]))
            }));
        }
        for (i, (entry, row)) in self.entries.iter().zip(&self.rows).enumerate() {
            let mut sums = [0.0; ABREAST];
            for (j, (other, push)) in self.entries.iter().zip(&self.pushes).enumerate() {
                if j % ABREAST == 0 {
                    sums = by_trunk(&row.pull, &self.trunks[j / ABREAST]);
                }
                let by_trunk = sums[j % ABREAST];
                let mut mobility = between_links(by_trunk, &entry.row, &other.push, push);
                if i == j {
                    mobility = mobility * (1.0 + INDEPENDENT) + entry.compliance;
                }
                self.problem.set(i, j, mobility);
            }
            match entry.role {
                Role::Stop(_) | Role::Normal { .. } => self.problem.bound(i, Bound::NonNegative),
                Role::Tangent { which: 1, .. } => {
                    let normal = i - 1;
                    self.problem.bound(i, Bound::Disc { normal, friction });
                }
                Role::Tangent { .. } => {}
            }
        }
    }

    /// Solves the problem that was prepared. What neither the method nor pivoting solves is taken as it is where it violates
    /// no condition by more than `enough`, in units of w: two feet that hold and can only move as one have no solution where
    /// they are at odds about the last digits.
    fn solve(
        &mut self,
        enough: f64,
        method: Method,
        solve_by: impl Fn(&mut Problem, Method) -> Result<Solution, Unsolved>,
    ) -> Result<(), Unsolved> {
        let swept = matches!(method, Method::GaussSeidel { .. });
        let mut solved = solve_by(&mut self.problem, method);
        for last in [false, true] {
            match solved {
                Ok(solution) => {
                    self.count(&solution);
                    return Ok(());
                }
                Err(Unsolved::Violated {
                    sweeps, residual, ..
                }) => {
                    self.iterations += u64::from(sweeps);
                    // Sweeps that were cut short are taken for what they are.
                    if residual <= enough || swept && residual.is_finite() {
                        return Ok(());
                    }
                }
                Err(_) => {}
            }
            if !last {
                solved = solve_by(&mut self.problem, Method::Direct);
            }
        }
        solved.map(|_| ())
    }

    pub(crate) fn count(&mut self, solution: &Solution) {
        self.iterations += u64::from(solution.sweeps + solution.pivots);
        self.factorisations += u64::from(solution.factorisations);
    }

    /// The impact of these legs: impulses at every closed constraint that would close further.
    pub(crate) fn impact(
        &mut self,
        scene: &Scene<'_, Lanes, N>,
        state: &mut State<Lanes, N>,
        legs: &[usize],
    ) -> Result<Toll, Unsolved> {
        let (articulated, drive) = slack(scene, state);
        self.find(scene, state, &articulated, &drive, legs, false, &touching);
        let mut toll = Toll::default();
        let mut drifts = [[0.0; PLACES]; 4];
        for entry in &self.entries {
            drifts[entry.row.leg][entry.role.place()] = entry.rate;
        }
        self.drifts = Some(drifts);
        if !self.entries.iter().any(|e| e.is_normal() && e.rate < 0.0) {
            return Ok(toll);
        }
        let (friction, restitution) = scene
            .model
            .ground
            .as_ref()
            .map_or((0.0, 0.0), |ground| (ground.friction, ground.restitution));
        self.prepare(&articulated, friction);
        self.before.clear();
        self.before
            .extend(self.entries.iter().map(|entry| entry.rate));
        self.coefficients.clear();
        self.coefficients
            .extend(self.entries.iter().map(|entry| match entry.role {
                Role::Normal { .. } if entry.rate < -RESTING => restitution,
                _ => 0.0,
            }));
        let Self {
            before,
            coefficients,
            ..
        } = self;
        let (before, coefficients) = (mem::take(before), mem::take(coefficients));
        let law = Restitution::Poisson;
        let solved = self.solve(HOLDING, Method::Newton, |problem, method| {
            problem.impact(law, &before, &coefficients, method)
        });
        (self.before, self.coefficients) = (before, coefficients);
        solved?;
        let mut trunk = [0.0; 6];
        let mut torques = [Lanes::zero(); N];
        for (i, (entry, &impulse)) in self.entries.iter().zip(self.problem.unknowns()).enumerate() {
            let work = 0.5 * impulse * (entry.rate + self.problem.w(i));
            match entry.role {
                Role::Tangent { .. } => toll.friction -= work,
                _ => toll.impact -= work,
            }
            for (a, r) in trunk.iter_mut().zip(&self.pushes[i].trunk) {
                *a += r * impulse;
            }
            for (torque, arm) in torques.iter_mut().zip(&entry.push.links) {
                let own = torque.lane(entry.row.leg) + arm * impulse;
                *torque = torque.with_lane(entry.row.leg, own);
            }
            if entry.role == Role::Stop(Stop::Cable) {
                let leg = entry.row.leg;
                let back = drive.pulley_mobility.lane(leg) * scene.legs.pulley_radius.lane(leg);
                let rate = state.pulley_rate.lane(leg) - back * impulse;
                state.pulley_rate = state.pulley_rate.with_lane(leg, rate);
            }
        }
        articulated.give_way(state, trunk, torques);
        toll.ground = self.ground();
        Ok(toll)
    }

    /// The ground's impulses on each leg, world frame.
    pub(crate) fn ground(&self) -> [[f64; 3]; 4] {
        let mut ground = [[0.0; 3]; 4];
        for (entry, impulse) in self.entries.iter().zip(self.problem.unknowns()) {
            for (sum, d) in ground[entry.row.leg].iter_mut().zip(&entry.direction) {
                *sum += impulse * d;
            }
        }
        ground
    }

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
        self.entries.retain_mut(|entry| {
            let drift = |drifts: [[f64; PLACES]; 4]| drifts[entry.row.leg][entry.role.place()];
            let rests = if entry.held {
                drifts.is_none_or(|drifts| entry.rate - drift(drifts) < PARTING)
            } else {
                entry.rate.abs() < AT_REST
            };
            entry.parts = !rests;
            // A stop that was knocked open may close again before anything else can happen.
            let hops = entry.held && matches!(entry.role, Role::Stop(_));
            !entry.is_normal() || rests || hops
        });
        self.drop_orphans();
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

    /// Takes out the tangents of feet that are not there any more.
    fn drop_orphans(&mut self) {
        let mut kept = false;
        self.entries.retain(|entry| match entry.role {
            Role::Normal { slides, .. } => {
                kept = slides.is_none();
                true
            }
            Role::Tangent { .. } => kept,
            Role::Stop(_) => {
                kept = false;
                true
            }
        });
    }

    /// Notes what pushes with more than `least`, leaving out what others imply. What has come to its end pushes with next to
    /// nothing; if it were to go on, it would end at once, and again.
    fn note(&self, mode: &mut Mode, friction: f64, least: f64) {
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

/// What forces along some directions move along a row by way of the trunk: Σₖ pull[k] · trunks[k], for the directions side by
/// side.
#[inline(always)]
fn by_trunk(pull: &[f64; 6], trunks: &[[f64; ABREAST]; 6]) -> [f64; ABREAST] {
    let mut sums = [0.0; ABREAST];
    for (pull, trunk) in pull.iter().zip(trunks) {
        for (sum, trunk) in sums.iter_mut().zip(trunk) {
            *sum += pull * trunk;
        }
    }
    sums
}

impl<const N: usize> Entry<N> {
    fn is_normal(&self) -> bool {
        !self.role.is_tangent()
    }
}

fn stop_row<const N: usize>(hold: &Hold<Lanes, N>, leg: usize) -> Row<f64, N> {
    Row {
        leg,
        trunk: [0.0; 6],
        links: hold.gradient.map(|g| g.lane(leg)),
    }
}

/// The robot as an impact finds it: a motor of limited torque has none to set against an impulse, one without limits stands
/// like a rock.
fn slack<const N: usize>(
    scene: &Scene<'_, Lanes, N>,
    state: &State<Lanes, N>,
) -> (Articulated<Lanes, N>, Driven<Lanes>) {
    let mut mode = scene.mode.clone_without_stops();
    let mut drive = Driven::none();
    if let Some(drives) = &scene.model.drives {
        let limited = match drives {
            Fitted::Servos(servos) => servos.both().map(|servo| servo.torque().is_finite()),
            Fitted::Motors(_) => [true; 2],
        };
        let [at_hip, at_pulley] = drives.inertias();
        drive.pulley = state.pulley;
        drive.pulley_rate = state.pulley_rate;
        mode.holds.hip = Lanes::splat(1.0);
        if limited[0] {
            mode.holds.hip = Lanes::zero();
            drive.hip_inertia = Lanes::splat(at_hip);
        }
        if limited[1] {
            drive.pulley_mobility = Lanes::splat(1.0 / at_pulley);
        }
    }
    mode.recount();
    (scene.articulated(state, &mode, &drive), drive)
}

/// The robot with its motors at work and nothing else that holds.
fn motors_only<const N: usize>(
    scene: &Scene<'_, Lanes, N>,
    state: &State<Lanes, N>,
) -> (Articulated<Lanes, N>, Driven<Lanes>) {
    let mut mode = scene.mode.clone_without_stops();
    mode.recount();
    let drive = scene.drive(state);
    (scene.articulated(state, &mode, &drive), drive)
}

impl<const N: usize> Scene<'_, Lanes, N> {
    fn articulated(
        &self,
        state: &State<Lanes, N>,
        mode: &Mode,
        drive: &Driven<Lanes>,
    ) -> Articulated<Lanes, N> {
        let holding = Holding {
            holds: &mode.holds,
            drive,
            recovery: Lanes::zero(),
            ahead: 0.0,
            any: mode.any,
        };
        Articulated::new(self.model, self.legs, state, &holding)
    }
}

impl<const N: usize> Articulated<Lanes, N> {
    /// Changes the velocities by what impulses do.
    fn give_way(&self, state: &mut State<Lanes, N>, trunk: [f64; 6], mut torques: [Lanes; N]) {
        if let Some(base) = &self.base {
            for (torque, column) in torques.iter_mut().zip(&base.carried.columns) {
                for (c, &row) in column.iter().zip(&crate::carried::COUPLED) {
                    *torque -= *c * Lanes::splat(trunk[row]);
                }
            }
            for i in 0..3 {
                state.velocity[i] += trunk[i];
                state.turning[i] += trunk[3 + i];
            }
        }
        for i in 0..N {
            for j in 0..N {
                state.rates[i] += self.give.mobility[i][j] * torques[j];
            }
        }
    }
}

/// The direction of a slide now, for a foot that goes on sliding.
pub(crate) fn direction(footing: &Footing<f64>, last: [f64; 2]) -> [f64; 2] {
    crate::motion::sliding(footing, last)
}
