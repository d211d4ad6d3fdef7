//! Closed constraints at an instant, and the directions of their forces.

use super::Instant;
use super::entry::{Entry, Feet, Role, Stop};
use crate::constraints::contacts::Contact;
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

/// Returns whether a gap is closed.
pub(super) fn touching(gap: f64, _: f64) -> bool {
    gap < CLOSED
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
