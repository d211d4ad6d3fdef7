//! The power books close: what is stored, put in, dissipated and lost adds up.

use twinrig_contact::{Ground, HeightField, Terrain};
use twinrig_legged::{Base, Drives, Setup};
use twinrig_massless::Force;
use twinrig_robot::Robot;

use crate::scene::{Scene, Trot, on_slope, robot, setup};

/// Share of the energy exchanged that may be missing at 1 ms.
const SHARE: f64 = 1e-6;

fn assert_closed(scene: &Scene, what: &str) {
    let balance = scene.energy();
    assert!(
        balance.residual.abs() < SHARE * balance.exchanged,
        "{what}: {balance:?}"
    );
    // The residual is what the books say it is, and they hold something.
    let sum = balance.stored() + balance.dissipated + balance.impact - balance.actuator;
    assert!(
        balance.exchanged > 0.01 && sum.is_finite(),
        "{what}: {balance:?}"
    );
    // Friction and impacts only take.
    assert!(
        balance.dissipated >= 0.0 && balance.impact >= -1e-9,
        "{what}: {balance:?}"
    );
}

fn trot(robot: &Robot, setup: &Setup, trot: Trot, ms: u64) -> Scene {
    trotted(robot, setup, Force::Solve, trot, ms)
}

fn trotted(robot: &Robot, setup: &Setup, force: Force, trot: Trot, ms: u64) -> Scene {
    let mut setup = setup.clone();
    setup.start = trot.commands(robot, &setup, 0.0).into();
    let mut scene = Scene::forced(robot, &setup, force);
    for now in 1..=ms {
        scene.trot(robot, &setup, trot, now);
    }
    scene
}

#[test]
fn the_books_of_a_trot_close_on_every_base() {
    let robot = robot();
    for base in [Base::Free, Base::Planar, Base::Fixed] {
        let setup = Setup { base, ..setup() };
        let scene = trot(&robot, &setup, Trot::START, 1000);
        assert_closed(&scene, &format!("{base:?}"));
    }
}

#[test]
fn the_books_of_a_trot_close_with_looked_up_forces_and_over_hills() {
    let robot = robot();
    let force = Force::Lookup { cells: 48 };
    assert_closed(
        &trotted(&robot, &setup(), force, Trot::START, 500),
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
fn the_books_close_where_the_stops_are_hit_hard() {
    // A stroke at 6 Hz throws the legs from stop to stop; the drives run into their torque. In the plane, because of the
    // feet's sideways inertia, below.
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
fn the_books_of_a_robot_that_stumbles_and_rolls_over_nearly_close() {
    // In space the feet's sideways inertia is the one thing that the midpoint rule conserves to third order only; a hard
    // landing that jerks the trunk into a roll leaves up to 4e-5 of its energy. Everything else is exact.
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
fn the_books_of_a_drop_close() {
    // From flight: start without ground under the feet by lowering it 0.2 m.
    for restitution in [0.0, 0.5] {
        let robot = robot();
        let scene = drop(&robot, 0.2, restitution);
        assert_closed(&scene, &format!("drop, restitution {restitution}"));
        let balance = scene.energy();
        assert!(balance.impact > 0.02, "{balance:?}");
    }
}

/// Half a second from a fall of `height` \[m\].
fn drop(robot: &Robot, height: f64, restitution: f64) -> Scene {
    let terrain = Terrain::StepDown {
        at: -10.0,
        drop: height,
    };
    let ground = Some(Ground::new(terrain, 0.6, restitution).unwrap());
    let mut scene = Scene::new(robot, &Setup { ground, ..setup() });
    scene.to(500);
    scene
}

#[test]
fn the_books_of_a_slide_close_and_friction_takes_what_gravity_gives() {
    let robot = robot();
    let mut scene = Scene::new(&robot, &on_slope(&robot, 0.3, 0.1));
    scene.to(500);
    assert_closed(&scene, "slide");
    assert!(scene.read("body/velocity")[0] > 0.5);
    let balance = scene.energy();
    assert!(balance.dissipated > 0.1, "{balance:?}");
}
