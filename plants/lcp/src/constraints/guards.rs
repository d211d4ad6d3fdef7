//! Guards of the events: a gap that closes, a force that changes sign, a foot that starts or stops
//! sliding.

use nalgebra::Vector3;

use crate::constraints::motion::{Dynamics, Motion};
use crate::constraints::workspace::Workspace;
use crate::model::leg_constraints::{CABLE, DIAGONAL, PANTOGRAPH};
use crate::model::real::{Lanes, Real};
use crate::model::site::Site;
use crate::model::state::State;

/// Number of guards of a leg: five open stops, three constraint forces, and four for each of its
/// two contact points.
pub(crate) const GUARDS: usize = STOPS + FORCES + 2 * FOOT;
pub(crate) const STOPS: usize = 5;
const FORCES: usize = 3;
const FOOT: usize = 4;

/// Margin below zero at which a sliding foot jams, as a share of its normal's mobility.
const JAMMED: f64 = 1e-6;

/// Value of an inactive guard.
const INACTIVE: f64 = f64::MAX;

/// Guards by leg. An event occurs where a value becomes negative.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Guards {
    pub(crate) values: [Lanes; GUARDS],
    /// Rates of the gaps, for guards that are gaps \[m/s\].
    pub(crate) rates: [Lanes; GUARDS],
}

/// Quantity of a guard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Guard {
    /// Gap \[m\].
    Gap,
    /// Force \[N\].
    Force,
    /// Friction reserve of a sticking foot \[N\]; of a sliding foot, the share of its normal's
    /// mobility left by friction, times the weight of the robot \[N\].
    Friction,
    /// Speed of a slide along its last direction \[m/s\].
    TangentialImpulse,
}

/// Returns the quantity of the guard with this index.
pub(crate) const fn kind(index: usize) -> Guard {
    if index < STOPS {
        return Guard::Gap;
    }
    if index < STOPS + FORCES {
        return Guard::Force;
    }
    match (index - STOPS - FORCES) % FOOT {
        0 => Guard::Gap,
        1 => Guard::Force,
        2 => Guard::Friction,
        _ => Guard::TangentialImpulse,
    }
}

/// Returns the index of the `which`-th of the four guards of a contact point.
pub(crate) const fn at_foot(links: usize, which: usize) -> usize {
    STOPS + FORCES + FOOT * (links - 3) + which
}

/// Returns the number of links above the contact point of a guard.
pub(crate) const fn links_of(index: usize) -> usize {
    3 + (index - STOPS - FORCES) / FOOT
}

impl Guards {
    /// Returns guards that are all inactive.
    pub(crate) fn inactive() -> Self {
        Self {
            values: [Lanes::splat(INACTIVE); GUARDS],
            rates: [Lanes::zero(); GUARDS],
        }
    }

    /// Computes the guards in a state.
    pub(crate) fn new<const N: usize>(
        dynamics: &Dynamics<'_, Lanes, N>,
        state: &State<Lanes, N>,
        motion: &Motion<Lanes, N>,
        workspace: &Workspace<f64, N>,
    ) -> Self {
        let mut guards = Self::inactive();
        guards.update(dynamics, state, motion, workspace);
        guards
    }

    /// Computes the guards in a state in place.
    #[inline(never)]
    pub(crate) fn update<const N: usize>(
        &mut self,
        dynamics: &Dynamics<'_, Lanes, N>,
        state: &State<Lanes, N>,
        motion: &Motion<Lanes, N>,
        workspace: &Workspace<f64, N>,
    ) {
        let guards = self;
        let inactive = Lanes::splat(INACTIVE);
        guards.values = [inactive; GUARDS];
        guards.rates = [Lanes::zero(); GUARDS];
        let (chain, active) = (&motion.articulated.chain, &dynamics.active);
        let gaps = [
            (chain.closed(dynamics.legs, &state.angles), active.closed),
            (chain.open(dynamics.legs), active.open),
            (chain.extended(dynamics.legs), active.extended),
            (chain.bottomed(dynamics.legs), active.bottomed),
            (chain.taut(dynamics.legs, &motion.drive), active.cable),
        ];
        let stops = if dynamics.model.drives.is_some() {
            STOPS
        } else {
            STOPS - 1
        };
        for (index, (constraint, active)) in gaps.into_iter().enumerate().take(stops) {
            guards.values[index] = constraint.gap + active * inactive;
            guards.rates[index] = constraint.rate;
        }
        let forces = &motion.forces.forces;
        for (index, (constraint, active)) in [
            (PANTOGRAPH, active.closed + active.open),
            (DIAGONAL, active.extended + active.bottomed),
            (CABLE, active.cable),
        ]
        .into_iter()
        .enumerate()
        {
            if dynamics.mode.any[constraint] {
                guards.values[STOPS + index] =
                    forces[constraint] + (Lanes::splat(1.0) - active) * inactive;
            }
        }
        guards.of_feet(dynamics, state, motion, workspace);
    }

    fn of_feet<const N: usize>(
        &mut self,
        dynamics: &Dynamics<'_, Lanes, N>,
        state: &State<Lanes, N>,
        motion: &Motion<Lanes, N>,
        workspace: &Workspace<f64, N>,
    ) {
        let Some(ground) = &dynamics.model.ground else {
            return;
        };
        let rotation = motion.articulated.rotation();
        for leg in 0..dynamics.model.legs.len() {
            for links in 3..=N {
                let standing = dynamics.mode.contacts.iter();
                let mut standing = standing.filter(|c| (c.leg, c.links) == (leg, links));
                if standing.next().is_some() {
                    continue;
                }
                let site = Site::new(dynamics.legs, &motion.articulated.chain, state, leg, links);
                let surface =
                    ground.below(&Vector3::from(site.in_world(state.position, &rotation)));
                let moved = crate::model::rotation::into_world(&rotation, site.velocity);
                let index = at_foot(links, 0);
                self.set(index, leg, surface.gap);
                let rate =
                    self.rates[index].with_lane(leg, surface.normal.dot(&Vector3::from(moved)));
                self.rates[index] = rate;
            }
        }
        let (mut forces, mut shares) = (
            workspace.forces.as_slice(),
            workspace.normal_shares.as_slice(),
        );
        let weight = dynamics.model.energy_scale / dynamics.model.reach;
        for contact in &dynamics.mode.contacts {
            let (leg, links) = (contact.leg, contact.links);
            let site = Site::new(dynamics.legs, &motion.articulated.chain, state, leg, links);
            match contact.slides {
                None => {
                    let tangential = libm::hypot(forces[1], forces[2]);
                    self.set(at_foot(links, 1), leg, forces[0]);
                    self.set(
                        at_foot(links, 2),
                        leg,
                        dynamics.model.friction[leg] * forces[0] - tangential,
                    );
                    (forces, shares) = (&forces[3..], &shares[3..]);
                }
                Some(last) => {
                    let footing = site.footing(ground, state.position, &rotation);
                    let [_, a, b] = footing.velocity;
                    self.set(at_foot(links, 1), leg, forces[0]);
                    self.set(at_foot(links, 2), leg, (shares[0] + JAMMED) * weight);
                    if dynamics.model.friction[leg] > 0.0 {
                        self.set(at_foot(links, 3), leg, a * last[0] + b * last[1]);
                    }
                    (forces, shares) = (&forces[1..], &shares[1..]);
                }
            }
        }
    }

    fn set(&mut self, index: usize, leg: usize, value: f64) {
        self.values[index] = self.values[index].with_lane(leg, value);
    }

    /// Returns whether any guard of any leg is below minus its tolerance.
    pub(crate) fn any_below(&self, tolerances: &[f64; GUARDS]) -> bool {
        let mut below = Lanes::zero();
        for (guard, tolerance) in self.values.iter().zip(tolerances) {
            below |= guard.simd_lt(Lanes::splat(-tolerance));
        }
        below.any()
    }
}
