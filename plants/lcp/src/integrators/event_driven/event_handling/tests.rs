//! Consistency of velocities, forces and accelerations after an event with any combination of
//! closing constraints.

use proptest::prelude::*;
use twinrig_contact::{Ground, Terrain};
use twinrig_legged::{Base, Drives};

use crate::fixtures::{self, flow};
use crate::integrators::right_hand_side::RightHandSide;
use crate::model::chain::Chain;
use crate::model::real::Lanes;
use crate::model::site::{Footing, Site};
use crate::model::state::State;
use crate::plant::flow::Flow;

/// Tolerance of velocities that must be zero after an event \[m/s\].
const SLOW: f64 = 1e-6;

/// A robot with some feet on the ground, at random velocities.
#[derive(Debug, Clone)]
struct ImpactCase {
    base: Base,
    pose: [f64; 3],
    friction: f64,
    /// Rotation of each leg about its hip \[rad\].
    spread: [f64; 4],
    /// Roll and pitch of the trunk \[rad\].
    tilt: [f64; 2],
    velocity: [f64; 3],
    turning: [f64; 3],
    rates: [f64; 4],
}

fn impact_case() -> impl Strategy<Value = ImpactCase> {
    let base = prop_oneof![Just(Base::Free), Just(Base::Planar)];
    // Closed against its stop, or open.
    let pose = (
        -45.0..45.0_f64,
        -90.0..-5.0_f64,
        prop_oneof![Just(0.0), 0.0..8.0_f64],
    );
    let friction = prop_oneof![Just(0.0), 0.0..2.0_f64];
    let small = |most: f64| prop_oneof![Just(0.0), -most..most];
    let spread = [small(0.3), small(0.3), small(0.3), small(0.3)];
    let velocity = (small(1.0), small(1.0), -2.0..0.1_f64).prop_map(|(x, y, z)| [x, y, z]);
    let turning = [small(5.0), small(5.0), small(5.0)];
    let rates = [small(20.0), small(20.0), small(20.0), small(20.0)];
    let moving = (velocity, turning, rates);
    (
        base,
        pose,
        friction,
        spread,
        [small(0.3), small(0.3)],
        moving,
    )
        .prop_map(
            |(base, (q1, q2, open), friction, spread, tilt, (velocity, turning, rates))| {
                ImpactCase {
                    base,
                    pose: [q1, q2, open - q2],
                    friction,
                    spread,
                    tilt,
                    velocity,
                    turning,
                    rates,
                }
            },
        )
}

impl ImpactCase {
    /// Builds the robot with its lowest point on the ground.
    fn flow<const N: usize>(&self) -> Flow<N> {
        let ground = Ground::new(Terrain::Flat, self.friction, 0.0).unwrap();
        let start = (self.pose, [0.0; 3]);
        let mut flow = flow::<N>(
            &fixtures::robot(),
            self.base,
            start,
            Drives::None,
            Some(ground),
        );
        let planar = self.base == Base::Planar;
        let state = &mut flow.run.state;
        let [roll, pitch] = self.tilt.map(|angle| 0.5 * angle);
        let roll = if planar { 0.0 } else { roll };
        state.attitude = [
            libm::cos(roll) * libm::cos(pitch),
            libm::sin(roll) * libm::cos(pitch),
            libm::cos(roll) * libm::sin(pitch),
            -libm::sin(roll) * libm::sin(pitch),
        ];
        (state.velocity, state.turning) = (self.velocity, self.turning);
        if planar {
            state.velocity[1] = 0.0;
            (state.turning[0], state.turning[2]) = (0.0, 0.0);
        }
        for (k, (angle, rate)) in state.angles.iter_mut().zip(&mut state.rates).enumerate() {
            *angle += Lanes::new(self.spread);
            *rate = Lanes::new(
                self.rates
                    .map(|rate| if k == 2 { rate } else { 0.5 * rate }),
            );
        }
        let points = footings(&flow, &flow.run.state);
        let lowest = points.iter().map(|(_, footing)| footing.gap);
        flow.run.state.position[2] -= lowest.fold(f64::INFINITY, f64::min);
        flow
    }
}

/// Returns the possible contact points of all legs, by leg and links.
fn footings<const N: usize>(
    flow: &Flow<N>,
    state: &State<Lanes, N>,
) -> Vec<([usize; 2], Footing<f64>)> {
    let ground = flow.model.ground.as_ref().unwrap();
    let legs = &flow.model.side_by_side;
    let chain = Chain::new(legs, &state.angles, &state.rates);
    let rotation = crate::model::rotation::rotation(state.attitude);
    let points = (0..flow.model.legs.len()).flat_map(|leg| (3..=N).map(move |links| [leg, links]));
    let footing = |[leg, links]: [usize; 2]| {
        let site = Site::<f64, N>::new(legs, &chain, state, leg, links);
        (
            [leg, links],
            site.footing(ground, state.position, &rotation),
        )
    };
    points.map(footing).collect()
}

/// Checks state and mode directly after an event.
fn check_contacts<const N: usize>(flow: &mut Flow<N>) -> Result<(), TestCaseError> {
    /// Time over which velocities change linearly \[s\].
    const MOMENT: f64 = 1e-7;
    let state = flow.run.state;
    let mut rhs = RightHandSide::default();
    let motion = rhs.motion(&flow.model, &mut flow.run, &state, 0.0);
    let free = flow.model.is_free();
    let later = state.along(Lanes::splat(MOMENT), &motion.slope, free);
    let [now, then] = [&state, &later].map(|state| footings(flow, state));
    let friction = flow.model.ground.as_ref().unwrap().friction;
    for ((point, footing), (_, later)) in now.iter().zip(&then) {
        if footing.gap > 1e-9 {
            continue;
        }
        let [rate, a, b] = footing.velocity;
        prop_assert!(rate > -SLOW, "{:?} closes at {}", point, rate);
        let mut contacts = flow.run.mode.contacts.iter();
        let Some(contact) = contacts.find(|c| [c.leg, c.links] == *point) else {
            let opens = (later.velocity[0] - rate) / MOMENT;
            prop_assert!(
                rate > SLOW || opens > -1e-2,
                "{:?} sinks by {}",
                point,
                opens
            );
            continue;
        };
        let speed = libm::hypot(a, b);
        match contact.slides {
            None => prop_assert!(speed < 10.0 * SLOW, "{:?} sticks at {}", point, speed),
            Some([x, y]) if speed > SLOW && friction > 0.0 => {
                prop_assert!((a * x + b * y) / speed > 1.0 - 1e-6, "{:?}", contact);
            }
            Some(_) => {}
        }
    }
    let mut forces = rhs.workspace.forces.iter();
    for contact in &flow.run.mode.contacts {
        let normal = *forces.next().unwrap();
        prop_assert!(normal > 0.0, "{:?} pulls by {}", contact, normal);
        if contact.slides.is_none() {
            let along = libm::hypot(*forces.next().unwrap(), *forces.next().unwrap());
            let limit = friction * normal;
            prop_assert!(
                along <= limit * (1.0 + 1e-6) + 1e-6,
                "{:?}: {} of {}",
                contact,
                along,
                limit
            );
        }
    }
    Ok(())
}

fn check_event<const N: usize>(impact_case: &ImpactCase) -> Result<(), TestCaseError> {
    let mut flow = impact_case.flow::<N>();
    let before: f64 = flow.stored().iter().sum();
    let handled = flow
        .event_driven
        .handle_event(&flow.model, &mut flow.run, 0..4, 0.0, 0.0);
    prop_assert!(handled.is_ok(), "{:?}", handled);
    let after: f64 = flow.stored().iter().sum();
    prop_assert!(after <= before + 1e-9, "{} J of {}", after, before);
    let lost = flow.run.ledger.impact + flow.run.ledger.dissipated;
    prop_assert!(
        (before - after - lost).abs() < 1e-7 * (1.0 + lost),
        "{} {}",
        before - after,
        lost
    );
    check_contacts(&mut flow)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn contacts_are_consistent_after_an_event(impact_case in impact_case()) {
        check_event::<3>(&impact_case)?;
    }

    #[test]
    fn contacts_are_consistent_after_an_event_with_toes(impact_case in impact_case()) {
        check_event::<4>(&impact_case)?;
    }
}
