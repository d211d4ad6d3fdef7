//! Closed constraints at an instant, and the directions of their forces.

use super::Instant;
use crate::constraints::mode::{Contact, Mode};
use crate::constraints::motion::Dynamics;
use crate::model::articulated::{Articulated, Row};
use crate::model::leg_constraints::{Constraint, DriveAction};
use crate::model::real::{Lanes, Real};
use crate::model::site::{Footing, Site};
use crate::model::state::State;

/// Gap below which a constraint is closed \[m\].
const CLOSED: f64 = 1e-8;

/// Speed below which a foot sticks \[m/s\].
pub(super) const STICKING: f64 = 1e-7;

/// Speed below which a slide has stopped after an event \[m/s\].
pub(crate) const STOPPED: f64 = 1e-6;

/// Minimum change of the rate of an active constraint by an impact that separates it \[m/s\].
pub(super) const SEPARATION: f64 = 1e-6;

/// Unilateral constraint inside a leg, in the order of the guards.
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

    /// Returns the name used in events and messages.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Closed => "closed",
            Self::Open => "open",
            Self::Extended => "extended",
            Self::Bottomed => "bottomed",
            Self::Cable => "cable",
        }
    }

    /// Returns the lanes in which the stop is active.
    pub(crate) fn active_in(self, mode: &Mode) -> Lanes {
        let active = &mode.active;
        match self {
            Self::Closed => active.closed,
            Self::Open => active.open,
            Self::Extended => active.extended,
            Self::Bottomed => active.bottomed,
            Self::Cable => active.cable,
        }
    }

    /// Returns the lanes in which the stop is active, for modification.
    pub(crate) fn active_mut(self, mode: &mut Mode) -> &mut Lanes {
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

/// Returns whether a gap is closed.
pub(super) fn touching(gap: f64, _: f64) -> bool {
    gap < CLOSED
}

/// Meaning of a row of the problem.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Role {
    Stop(Stop),
    /// Normal of a foot; where it slides, its friction is included.
    Normal {
        links: usize,
        slides: Option<[f64; 2]>,
    },
    /// First or second tangent of a sticking foot.
    Tangent {
        links: usize,
        which: usize,
    },
}

impl Role {
    /// Returns the index among the forces on a leg.
    pub(crate) const fn slot(self) -> usize {
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

/// Number of possible forces on a leg, indexed by [`Role::slot`].
pub(crate) const SLOTS: usize = 11;

/// Selection of the rows of feet on the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Feet {
    /// Normal and two tangents: friction is part of the problem.
    WithTangents,
    /// A foot that slides faster than [`STICKING`] has its normal only, with friction included.
    BySpeed,
    /// The same after an event: a sticking foot continues to stick unless the impact moved it.
    AfterEvent,
}

/// A closed constraint.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry<const N: usize> {
    pub(crate) role: Role,
    pub(crate) row: Row<f64, N>,
    /// Direction of its force: equal to `row`, except for sliding feet.
    pub(crate) force_row: Row<f64, N>,
    pub(crate) gap: f64,
    /// Whether it was active before, and whether it separates.
    pub(super) was_active: bool,
    pub(super) separates: bool,
    /// Rate of the gap, and its acceleration at constant velocities.
    pub(crate) rate: f64,
    pub(crate) bias: f64,
    /// Acceleration of the cable's gap by its pulley \[m/s²\], and mobility of the pulley at the
    /// end of the cable \[1/kg\].
    pub(crate) winding: f64,
    pub(crate) compliance: f64,
    /// Direction of the ground force on a foot, world frame.
    pub(crate) direction: [f64; 3],
}

impl<const N: usize> Entry<N> {
    pub(super) fn is_normal(&self) -> bool {
        !self.role.is_tangent()
    }
}

impl<const N: usize> Instant<N> {
    /// Finds the closed constraints of these legs.
    #[expect(
        clippy::too_many_arguments,
        reason = "the inputs of the search, each by its name"
    )]
    pub(crate) fn find_entries(
        &mut self,
        dynamics: &Dynamics<'_, Lanes, N>,
        state: &State<Lanes, N>,
        articulated: &Articulated<Lanes, N>,
        drive: &DriveAction<Lanes>,
        legs: &[usize],
        feet: Feet,
        closed: &dyn Fn(f64, f64) -> bool,
    ) {
        self.entries.clear();
        let chain = &articulated.chain;
        let stops = [
            chain.closed(dynamics.legs, &state.angles),
            chain.open(dynamics.legs),
            chain.extended(dynamics.legs),
            chain.bottomed(dynamics.legs),
            chain.taut(dynamics.legs, drive),
        ];
        let radius = dynamics.legs.pulley_radius;
        for &leg in legs {
            for (stop, constraint) in Stop::ALL.into_iter().zip(&stops) {
                if stop == Stop::Cable && dynamics.model.drives.is_none() {
                    continue;
                }
                let (gap, rate) = (constraint.gap.lane(leg), constraint.rate.lane(leg));
                let was_active = stop.active_in(dynamics.mode).lane(leg) != 0.0;
                if !was_active && !closed(gap, rate) {
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
                    force_row: row,
                    gap,
                    was_active,
                    separates: false,
                    rate,
                    bias: constraint.curvature.lane(leg),
                    winding,
                    compliance,
                    direction: [0.0; 3],
                });
            }
            self.find_feet(dynamics, state, articulated, leg, feet, closed);
        }
    }

    fn find_feet(
        &mut self,
        dynamics: &Dynamics<'_, Lanes, N>,
        state: &State<Lanes, N>,
        articulated: &Articulated<Lanes, N>,
        leg: usize,
        feet: Feet,
        closed: &dyn Fn(f64, f64) -> bool,
    ) {
        let Some(ground) = &dynamics.model.ground else {
            return;
        };
        let rotation = articulated.rotation();
        let friction = dynamics.model.friction[leg];
        for links in 3..=N {
            let site = Site::new(dynamics.legs, &articulated.chain, state, leg, links);
            let footing = site.footing(ground, state.position, &rotation);
            let mut contacts = dynamics.mode.contacts.iter();
            let contact = contacts.find(|c| (c.leg, c.links) == (leg, links));
            let was_active = contact.is_some();
            if !was_active && !closed(footing.gap, footing.velocity[0]) {
                continue;
            }
            let slides = match feet {
                Feet::WithTangents => None,
                // Without friction no foot can stick.
                _ if friction == 0.0 => Some(direction(&footing, STICKING).unwrap_or([1.0, 0.0])),
                Feet::AfterEvent if self.sticks(contact, &footing, [leg, links]) => None,
                Feet::BySpeed => direction(&footing, STICKING),
                Feet::AfterEvent => direction(&footing, STOPPED),
            };
            let [n, along, across] = footing.directions;
            let [forward, sideways] = footing.surface.tangents();
            let world = [footing.surface.normal, forward, sideways].map(<[f64; 3]>::from);
            let force_direction = slides.map_or(n, |s| {
                std::array::from_fn(|i| n[i] - friction * (s[0] * along[i] + s[1] * across[i]))
            });
            let entry = |k: usize, role, force_row| Entry {
                role,
                row: site.row(footing.directions[k]),
                force_row,
                gap: footing.gap,
                was_active,
                separates: false,
                rate: footing.velocity[k],
                bias: footing.bias[k],
                winding: 0.0,
                compliance: dynamics.model.contact_compliance(),
                direction: world[k],
            };
            self.entries.push(entry(
                0,
                Role::Normal { links, slides },
                site.row(force_direction),
            ));
            if slides.is_none() {
                for k in 1..3 {
                    let tangent = site.row(footing.directions[k]);
                    self.entries
                        .push(entry(k, Role::Tangent { links, which: k }, tangent));
                }
            }
        }
    }
}

impl<const N: usize> Instant<N> {
    /// Returns whether a foot on the ground is at rest, regardless of round-off in its velocity:
    /// the impact stopped it, or it stuck before and the impact did not move it.
    fn sticks(
        &self,
        contact: Option<&Contact>,
        footing: &Footing<f64>,
        [leg, links]: [usize; 2],
    ) -> bool {
        let stuck = contact.is_some_and(|contact| contact.slides.is_none());
        let Some(last_impact) = &self.last_impact else {
            return stuck;
        };
        let [_, a, b] = footing.velocity;
        let [before_a, before_b] = last_impact.tangential(leg, links);
        let moved = libm::hypot(a - before_a, b - before_b) >= SEPARATION;
        last_impact.stopped[leg][links - 3] || stuck && !moved
    }
}

/// Returns the direction in which a foot slides, in the tangents of the ground; none for a sticking
/// foot.
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
