//! Energy balance: stored, supplied, dissipated and lost energies add up.

use twinrig_contact::{Ground, HeightField, Terrain};
use twinrig_legged::{Base, Drives, Setup};
use twinrig_massless::Force;
use twinrig_robot::Robot;
use twinrig_testing::robots::robot;
use twinrig_testing::trot::Trot;

use super::harness::{Harness, massless, on_slope, setup, with_force};

/// Bound of the residual at 1 ms, relative to the energy exchanged.
const SHARE: f64 = 1e-6;

fn assert_closed(harness: &Harness, what: &str) {
    let balance = harness.energy();
    assert!(
        balance.residual.abs() < SHARE * balance.exchanged,
        "{what}: {balance:?}"
    );
    // The balance is not trivial.
    let sum = balance.stored() + balance.dissipated + balance.impact - balance.actuator;
    assert!(
        balance.exchanged > 0.01 && sum.is_finite(),
        "{what}: {balance:?}"
    );
    // Friction and impacts only dissipate.
    assert!(
        balance.dissipated >= 0.0 && balance.impact >= -1e-9,
        "{what}: {balance:?}"
    );
}

fn trot(robot: &Robot, setup: &Setup, trot: Trot, ms: u64) -> Harness {
    trot_with_force(robot, setup, Force::Solve, trot, ms)
}

fn trot_with_force(robot: &Robot, setup: &Setup, force: Force, trot: Trot, ms: u64) -> Harness {
    let mut setup = setup.clone();
    setup.start = trot.legs(robot, &setup, 0.0).into();
    let mut harness = with_force(robot, &setup, force);
    for now in 1..=ms {
        harness.trot(robot, &setup, trot, now);
    }
    harness
}

#[test]
fn energy_balance_of_a_trot_closes_on_every_base() {
    let robot = robot();
    for base in [Base::Free, Base::Planar, Base::Fixed] {
        let setup = Setup { base, ..setup() };
        let harness = trot(&robot, &setup, Trot::START, 1000);
        assert_closed(&harness, &format!("{base:?}"));
    }
}

#[test]
fn energy_balance_of_a_trot_closes_with_tables_and_over_hills() {
    let robot = robot();
    let force = Force::Lookup { cells: 48 };
    assert_closed(
        &trot_with_force(&robot, &setup(), force, Trot::START, 500),
        "lookup",
    );
    let heights = (0..400)
        .map(|i| 0.004 * libm::sin(0.9 * f64::from(i)))
        .collect();
    let field = HeightField::new([-0.5, -0.5], 0.05, 20, heights).unwrap();
    let ground = Some(Ground::new(Terrain::Heights(field), 0.6, 0.2).unwrap());
    assert_closed(
        &trot(&robot, &Setup { ground, ..setup() }, Trot::START, 500),
        "hills",
    );
}

#[test]
fn energy_balance_closes_under_hard_impacts_on_stops() {
    // A stroke at 6 Hz moves the legs from stop to stop, and the drives saturate. In the plane,
    // because of the feet's sideways inertia (see below).
    let mut hard = Setup {
        base: Base::Planar,
        ..setup()
    };
    let Drives::Servos { hip, knee } = &mut hard.drives else {
        unreachable!()
    };
    (hip.torque, knee.torque) = (0.6, 0.6);
    let fast = Trot {
        frequency: 6.0,
        stroke: 0.3,
        lift: 0.3,
        length: 0.85,
    };
    assert_closed(&trot(&robot(), &hard, fast, 500), "hard");
}

#[test]
fn energy_balance_of_a_rolling_robot_closes_to_third_order() {
    // In space the feet's sideways inertia is the one term that the midpoint rule conserves to
    // third order only; a hard landing that rolls the trunk leaves up to 4e-5 of its energy. All
    // other terms are exact.
    let wild = Trot {
        frequency: 3.0,
        stroke: 0.25,
        lift: 0.15,
        length: 0.9,
    };
    let balance = trot(&robot(), &setup(), wild, 1000).energy();
    assert!(
        balance.residual.abs() < 2e-5 * balance.exchanged,
        "{balance:?}"
    );
}

#[test]
fn energy_balance_of_a_drop_closes() {
    // The start is in flight, because the ground under the feet is 0.2 m lower.
    for restitution in [0.0, 0.5] {
        let robot = robot();
        let harness = drop(&robot, 0.2, restitution);
        assert_closed(&harness, &format!("drop, restitution {restitution}"));
        let balance = harness.energy();
        assert!(balance.impact > 0.02, "{balance:?}");
    }
}

/// Half a second with a fall from `height` \[m\].
fn drop(robot: &Robot, height: f64, restitution: f64) -> Harness {
    let terrain = Terrain::step_down(-10.0, height);
    let ground = Some(Ground::new(terrain, 0.6, restitution).unwrap());
    let mut harness = massless(robot, &Setup { ground, ..setup() });
    harness.advance_to_ms(500);
    harness
}

#[test]
fn energy_balance_of_a_slide_closes_with_friction_work() {
    let robot = robot();
    let mut harness = massless(&robot, &on_slope(&robot, 0.3, 0.1));
    harness.advance_to_ms(500);
    assert_closed(&harness, "slide");
    assert!(harness.read("body/velocity")[0] > 0.5);
    let balance = harness.energy();
    assert!(balance.dissipated > 0.1, "{balance:?}");
}
