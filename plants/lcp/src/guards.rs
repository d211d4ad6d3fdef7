//! What ends a smooth stretch: a gap that closes, a force that would have to pull, a foot that starts or stops to slide.

use nalgebra::Vector3;

use crate::constraints::{CABLE, DIAGONAL, PANTOGRAPH};
use crate::motion::{Bench, Motion, Scene};
use crate::real::{Lanes, Real};
use crate::site::Site;
use crate::state::State;

/// Guards of a leg: five stops that are open, three holds that push, and four for each of its two points that may touch the
/// ground.
pub(crate) const GUARDS: usize = STOPS + HELD + 2 * FOOT;
pub(crate) const STOPS: usize = 5;
const HELD: usize = 3;
const FOOT: usize = 4;

/// How far friction presses a foot down that has jammed beyond doubt: a share of its normal's mobility.
const JAMMED: f64 = 1e-6;

/// A guard that stands for nothing.
const AT_EASE: f64 = f64::MAX;

/// Guards by leg: what they stand for lasts while they are positive.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Guards {
    pub(crate) values: [Lanes; GUARDS],
    /// Rates of the gaps, where the guard is a gap.
    pub(crate) rates: [Lanes; GUARDS],
}

/// What a guard stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Guard {
    /// A gap, in metres.
    Gap,
    /// A force, in newtons.
    Force,
    /// What friction has to spare, in newtons; of a foot that slides, the share of its normal's mobility that friction leaves,
    /// in weights of the robot.
    Friction,
    /// The speed of a slide along the direction it had, in metres per second.
    Slide,
}

/// What the guard at a place stands for.
pub(crate) const fn kind(place: usize) -> Guard {
    if place < STOPS {
        return Guard::Gap;
    }
    if place < STOPS + HELD {
        return Guard::Force;
    }
    match (place - STOPS - HELD) % FOOT {
        0 => Guard::Gap,
        1 => Guard::Force,
        2 => Guard::Friction,
        _ => Guard::Slide,
    }
}

/// The guard's place for the `which`-th of a point's four guards.
pub(crate) const fn at_foot(links: usize, which: usize) -> usize {
    STOPS + HELD + FOOT * (links - 3) + which
}

/// The links above the point on the ground whose guard this is.
pub(crate) const fn links_of(place: usize) -> usize {
    3 + (place - STOPS - HELD) / FOOT
}

impl Guards {
    /// Guards that stand for nothing.
    pub(crate) fn none() -> Self {
        Self {
            values: [Lanes::splat(AT_EASE); GUARDS],
            rates: [Lanes::zero(); GUARDS],
        }
    }

    /// The guards in a state.
    pub(crate) fn new<const N: usize>(
        scene: &Scene<'_, Lanes, N>,
        state: &State<Lanes, N>,
        motion: &Motion<Lanes, N>,
        bench: &Bench<f64, N>,
    ) -> Self {
        let mut guards = Self::none();
        guards.renew(scene, state, motion, bench);
        guards
    }

    /// The guards in a state, in the place of others.
    #[inline(never)]
    pub(crate) fn renew<const N: usize>(
        &mut self,
        scene: &Scene<'_, Lanes, N>,
        state: &State<Lanes, N>,
        motion: &Motion<Lanes, N>,
        bench: &Bench<f64, N>,
    ) {
        let guards = self;
        let ease = Lanes::splat(AT_EASE);
        guards.values = [ease; GUARDS];
        guards.rates = [Lanes::zero(); GUARDS];
        let (chain, active) = (&motion.articulated.chain, &scene.active);
        let gaps = [
            (chain.closed(scene.legs, &state.angles), active.closed),
            (chain.open(scene.legs), active.open),
            (chain.extended(scene.legs), active.extended),
            (chain.bottomed(scene.legs), active.bottomed),
            (chain.taut(scene.legs, &motion.drive), active.cable),
        ];
        let stops = if scene.model.drives.is_some() {
            STOPS
        } else {
            STOPS - 1
        };
        for (place, (constraint, active)) in gaps.into_iter().enumerate().take(stops) {
            guards.values[place] = constraint.gap + active * ease;
            guards.rates[place] = constraint.rate;
        }
        let forces = &motion.forces.forces;
        for (place, (constraint, active)) in [
            (PANTOGRAPH, active.closed + active.open),
            (DIAGONAL, active.extended + active.bottomed),
            (CABLE, active.cable),
        ]
        .into_iter()
        .enumerate()
        {
            if scene.mode.any[constraint] {
                guards.values[STOPS + place] =
                    forces[constraint] + (Lanes::splat(1.0) - active) * ease;
            }
        }
        guards.of_feet(scene, state, motion, bench);
    }

    fn of_feet<const N: usize>(
        &mut self,
        scene: &Scene<'_, Lanes, N>,
        state: &State<Lanes, N>,
        motion: &Motion<Lanes, N>,
        bench: &Bench<f64, N>,
    ) {
        let Some(ground) = &scene.model.ground else {
            return;
        };
        let rotation = motion.articulated.rotation();
        for leg in 0..scene.model.legs.len() {
            for links in 3..=N {
                let standing = scene.mode.contacts.iter();
                let mut standing = standing.filter(|c| (c.leg, c.links) == (leg, links));
                if standing.next().is_some() {
                    continue;
                }
                let site = Site::new(scene.legs, &motion.articulated.chain, state, leg, links);
                let surface =
                    ground.below(&Vector3::from(site.in_world(state.position, &rotation)));
                let moved = crate::articulated::into_world(&rotation, site.velocity);
                let place = at_foot(links, 0);
                self.put(place, leg, surface.gap);
                let rate =
                    self.rates[place].with_lane(leg, surface.normal.dot(&Vector3::from(moved)));
                self.rates[place] = rate;
            }
        }
        let (mut forces, mut lifts) = (bench.forces.as_slice(), bench.lifts.as_slice());
        let weight = scene.model.energy_scale / scene.model.reach;
        for contact in &scene.mode.contacts {
            let (leg, links) = (contact.leg, contact.links);
            let site = Site::new(scene.legs, &motion.articulated.chain, state, leg, links);
            match contact.slides {
                None => {
                    let held = libm::hypot(forces[1], forces[2]);
                    self.put(at_foot(links, 1), leg, forces[0]);
                    self.put(at_foot(links, 2), leg, ground.friction * forces[0] - held);
                    (forces, lifts) = (&forces[3..], &lifts[3..]);
                }
                Some(last) => {
                    let footing = site.footing(ground, state.position, &rotation);
                    let [_, a, b] = footing.velocity;
                    self.put(at_foot(links, 1), leg, forces[0]);
                    self.put(at_foot(links, 2), leg, (lifts[0] + JAMMED) * weight);
                    if ground.friction > 0.0 {
                        self.put(at_foot(links, 3), leg, a * last[0] + b * last[1]);
                    }
                    (forces, lifts) = (&forces[1..], &lifts[1..]);
                }
            }
        }
    }

    fn put(&mut self, place: usize, leg: usize, value: f64) {
        self.values[place] = self.values[place].with_lane(leg, value);
    }

    /// The least guard of each kind, over all legs: where nothing is amiss, nothing more has to be looked at.
    pub(crate) fn alarmed(&self, tolerances: &[f64; GUARDS]) -> bool {
        let mut alarm = Lanes::zero();
        for (guard, tolerance) in self.values.iter().zip(tolerances) {
            alarm |= guard.simd_lt(Lanes::splat(-tolerance));
        }
        alarm.any()
    }
}
