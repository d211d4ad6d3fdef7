//! Which constraints are closed at an instant, and along which directions they push.

use super::Instant;
use crate::articulated::{Articulated, Row};
use crate::constraints::{Constraint, Driven};
use crate::mode::{Contact, Mode};
use crate::motion::Scene;
use crate::real::{Lanes, Real};
use crate::site::{Footing, Site};
use crate::state::State;

/// Gaps below this are closed \[m\].
const CLOSED: f64 = 1e-8;

/// Feet that slide slower than this hold \[m/s\].
pub(super) const HOLDING: f64 = 1e-7;

/// Slides slower than this have stopped, after an event \[m/s\].
pub(crate) const STOPPED: f64 = 1e-6;

/// An impact that adds less than this to the rate of a constraint that has held has left it where it was \[m/s\].
pub(super) const PARTING: f64 = 1e-6;

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
        let active = &mode.active;
        match self {
            Self::Closed => active.closed,
            Self::Open => active.open,
            Self::Extended => active.extended,
            Self::Bottomed => active.bottomed,
            Self::Cable => active.cable,
        }
    }

    /// Where a mode notes that it holds.
    pub(crate) fn of(self, mode: &mut Mode) -> &mut Lanes {
        let active = &mut mode.active;
        match self {
            Self::Closed => &mut active.closed,
            Self::Open => &mut active.open,
            Self::Extended => &mut active.extended,
            Self::Bottomed => &mut active.bottomed,
            Self::Cable => &mut active.cable,
        }
    }
}

/// Whether a gap is closed.
pub(super) fn touching(gap: f64, _: f64) -> bool {
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

/// The rows of feet on the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Feet {
    /// Normal and two tangents: friction is part of the problem.
    Held,
    /// A foot that slides faster than [`HOLDING`] has its normal alone, which its friction comes with.
    BySpeed,
    /// The same after an event: a foot that stuck goes on to, unless the impact has moved it.
    AfterEvent,
}

/// A closed constraint.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry<const N: usize> {
    pub(crate) role: Role,
    pub(crate) row: Row<f64, N>,
    /// The direction of its force: the row, but for feet that slide.
    pub(crate) push: Row<f64, N>,
    pub(crate) gap: f64,
    /// Whether it has held so far, and whether it parts.
    pub(super) held: bool,
    pub(super) parts: bool,
    /// Rate of the gap, and its acceleration while everything moves evenly.
    pub(crate) rate: f64,
    pub(crate) bias: f64,
    /// What a pulley does to the gap of its cable \[m/s²\], and its mobility at the cable's end \[1/kg\].
    pub(crate) winding: f64,
    pub(super) compliance: f64,
    /// Where a foot is pushed to, world frame.
    pub(crate) direction: [f64; 3],
}

impl<const N: usize> Entry<N> {
    pub(super) fn is_normal(&self) -> bool {
        !self.role.is_tangent()
    }
}

impl<const N: usize> Instant<N> {
    /// Finds the constraints of these legs that are closed.
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
        feet: Feet,
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
            for (stop, constraint) in Stop::ALL.into_iter().zip(&stops) {
                if stop == Stop::Cable && scene.model.drives.is_none() {
                    continue;
                }
                let (gap, rate) = (constraint.gap.lane(leg), constraint.rate.lane(leg));
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
                let row = stop_row(constraint, leg);
                self.entries.push(Entry {
                    role: Role::Stop(stop),
                    row,
                    push: row,
                    gap,
                    held,
                    parts: false,
                    rate,
                    bias: constraint.curvature.lane(leg),
                    winding,
                    compliance,
                    direction: [0.0; 3],
                });
            }
            self.find_feet(scene, state, articulated, leg, feet, closed);
        }
    }

    fn find_feet(
        &mut self,
        scene: &Scene<'_, Lanes, N>,
        state: &State<Lanes, N>,
        articulated: &Articulated<Lanes, N>,
        leg: usize,
        feet: Feet,
        closed: &dyn Fn(f64, f64) -> bool,
    ) {
        let Some(ground) = &scene.model.ground else {
            return;
        };
        let rotation = articulated.rotation();
        for links in 3..=N {
            let site = Site::new(scene.legs, &articulated.chain, state, leg, links);
            let footing = site.footing(ground, state.position, &rotation);
            let mut contacts = scene.mode.contacts.iter();
            let contact = contacts.find(|c| (c.leg, c.links) == (leg, links));
            let held = contact.is_some();
            if !held && !closed(footing.gap, footing.velocity[0]) {
                continue;
            }
            let slides = match feet {
                Feet::Held => None,
                // On ice there is nothing to hold.
                _ if ground.friction == 0.0 => {
                    Some(direction(&footing, HOLDING).unwrap_or([1.0, 0.0]))
                }
                Feet::AfterEvent if self.sticks(contact, &footing, [leg, links]) => None,
                Feet::BySpeed => direction(&footing, HOLDING),
                Feet::AfterEvent => direction(&footing, STOPPED),
            };
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
                compliance: scene.model.contact_compliance(),
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
}

impl<const N: usize> Instant<N> {
    /// Whether a foot that touches the ground is at rest on it, whatever is left of its speed in the last digits: the impact
    /// stopped it, or it stuck before and nothing has moved it.
    fn sticks(
        &self,
        contact: Option<&Contact>,
        footing: &Footing<f64>,
        [leg, links]: [usize; 2],
    ) -> bool {
        let stuck = contact.is_some_and(|contact| contact.slides.is_none());
        let Some(struck) = &self.struck else {
            return stuck;
        };
        let [_, a, b] = footing.velocity;
        let [before_a, before_b] = struck.tangential(leg, links);
        let moved = libm::hypot(a - before_a, b - before_b) >= PARTING;
        struck.stopped[leg][links - 3] || stuck && !moved
    }
}

/// The direction in which a foot slides, in the ground's tangents; none for one that holds.
fn direction(footing: &Footing<f64>, least: f64) -> Option<[f64; 2]> {
    let [_, a, b] = footing.velocity;
    let speed = libm::hypot(a, b);
    (speed > least).then(|| [a / speed, b / speed])
}

fn stop_row<const N: usize>(constraint: &Constraint<Lanes, N>, leg: usize) -> Row<f64, N> {
    Row {
        leg,
        trunk: [0.0; 6],
        links: constraint.gradient.map(|g| g.lane(leg)),
    }
}
