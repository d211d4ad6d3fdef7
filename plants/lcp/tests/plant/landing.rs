//! Falls: all feet, all stops and the ground at once.

use twinrig_lcp::Method;
use twinrig_legged::{Base, Drives, Setup};
use twinrig_robot::Servo;
use twinrig_runtime::{Plant, PlantEventKind};

use crate::scene::{DEFAULT, LEGS, SERVO, Scene, WAYS, Way, below, flat, pose, robot, standing};

fn drop(height: f64, friction: f64) -> Setup {
    Setup {
        ground: Some(below(height, friction)),
        ..standing()
    }
}

/// Length of a leg's diagonal \[m\].
fn diagonal(scene: &mut Scene, leg: &str) -> f64 {
    let sizes = &robot().legs[0].leg;
    let angles = scene.read(&format!("leg/{leg}/angles"));
    let (l2, ld) = (sizes.l2, sizes.l_delta);
    libm::sqrt(l2 * l2 + ld * ld + 2.0 * l2 * ld * libm::cos(angles[1] - angles[0]))
}

#[test]
fn a_robot_that_falls_from_a_metre_bottoms_out_and_survives() {
    let least = robot().legs[0].leg.diagonal_min;
    // Hips that do not give way, and legs that give way to everything.
    let stiff = Drives::Servos {
        hip: Servo {
            torque: 40.0,
            ..SERVO
        },
        knee: SERVO,
    };
    for drives in [stiff, Drives::None] {
        for way in &WAYS[..4] {
            let setup = Setup {
                drives,
                ..drop(1.0, 0.6)
            };
            let mut scene = Scene::new(&robot(), &setup, *way);
            let mut shortest = f64::INFINITY;
            for _ in 0..300 {
                scene.soundly(2e-3).unwrap();
                for leg in LEGS {
                    shortest = shortest.min(diagonal(&mut scene, leg));
                }
            }
            assert!(shortest > least - 2e-3, "{way:?}: {shortest} of {least}");
            assert!(
                drives == Drives::None || shortest < least + 2e-3,
                "{way:?}: {shortest} of {least}"
            );
            let balance = scene.energy();
            assert!(
                balance.residual.abs() < 2e-2 * balance.exchanged,
                "{way:?}: {balance:?}"
            );
            assert!(balance.impact > 0.5, "{way:?}: {balance:?}");
        }
    }
}

#[test]
fn the_methods_for_comparison_fall_soundly_too() {
    for way in &WAYS[4..] {
        let mut scene = Scene::new(&robot(), &drop(1.0, 0.6), *way);
        scene.soundly(0.6).unwrap();
        assert!(scene.energy().impact > 0.5);
    }
}

#[test]
fn feet_that_land_in_the_same_instant_are_met_at_once() {
    let mut scene = Scene::new(&robot(), &drop(0.1, 0.6), DEFAULT);
    scene.plant.log_events(true);
    scene.to_ms(200);
    let events = scene.plant.events().iter();
    let landings =
        events.filter(|e| e.part.ends_with("ground") && e.kind == PlantEventKind::Reached);
    let landings: Vec<_> = landings.take(4).map(|e| e.at_s).collect();
    assert_eq!(landings.len(), 4);
    // The motors hold the legs in their pose: it falls as a body does.
    let expected = libm::sqrt(2.0 * 0.1 / 9.81);
    for at in landings {
        assert!((at - expected).abs() < 2e-3, "{at} of {expected}");
    }
}

#[test]
fn a_robot_that_lands_on_all_fours_neither_rolls_nor_turns() {
    for base in [Base::Free, Base::Planar] {
        for way in &WAYS[..4] {
            let mut scene = Scene::new(
                &robot(),
                &Setup {
                    base,
                    ..drop(0.1, 0.6)
                },
                *way,
            );
            scene.soundly(0.16).unwrap();
            let rpy = scene.read("body/rpy");
            let y = scene.read("body/position")[1];
            assert!(
                rpy[0].abs() + rpy[2].abs() + y.abs() < 1e-6,
                "{way:?}: {rpy:?} {y}"
            );
            for [left, right] in [["LF", "RF"], ["LH", "RH"]] {
                let feet = [left, right].map(|leg| scene.read(&format!("leg/{leg}/foot/position")));
                for axis in [0, 2] {
                    assert!(
                        (feet[0][axis] - feet[1][axis]).abs() < 1e-6,
                        "{way:?}: {feet:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn ice_holds_nothing_back_and_glue_everything() {
    for friction in [0.0, 10.0] {
        for (way, setup) in WAYS[..4].iter().flat_map(|way| {
            let stand = Setup {
                ground: Some(flat(friction)),
                ..standing()
            };
            [
                (way, stand),
                (way, drop(0.1, friction)),
                (way, drop(1.0, friction)),
            ]
        }) {
            let mut scene = Scene::new(&robot(), &setup, *way);
            for _ in 0..300 {
                scene.plant.begin_window();
                scene.soundly(2e-3).unwrap();
                for leg in LEGS {
                    let force = scene.read(&format!("leg/{leg}/foot/force"));
                    let sideways = libm::hypot(force[0], force[1]);
                    assert!(force[2] > -1e-3, "{way:?}: {force:?}");
                    assert!(
                        sideways <= friction * force[2] + 1e-2,
                        "{friction} {way:?}: {force:?}"
                    );
                }
            }
        }
        // Those for comparison may say that there are no such forces.
        for way in &WAYS[4..] {
            let setup = drop(0.1, friction);
            let mut scene = Scene::new(&robot(), &setup, *way);
            let _ = scene.soundly(0.3);
        }
    }
}

/// A landing elsewhere moves a foot that sticks along the ground: its friction is still one force, whose halves are not let go
/// one by one as if they were stops that open.
#[test]
fn friction_of_a_foot_that_is_knocked_along_the_ground_stays_a_pair() {
    let robot = robot();
    let (hip, knee) = (robot.actuators.hip, robot.actuators.knee);
    let setup = Setup {
        drives: Drives::Servos { hip, knee },
        start: pose([40.1049, -7.82852, 7.82852], [0.0; 3]),
        ..drop(0.15, 0.6)
    };
    let mut scene = Scene::new(&robot, &setup, DEFAULT.with_toes());
    for _ in 0..150 {
        scene.plant.begin_window();
        scene.soundly(2e-3).unwrap();
        for leg in LEGS {
            let force = scene.read(&format!("leg/{leg}/foot/force"));
            let sideways = libm::hypot(force[0], force[1]);
            assert!(
                sideways <= 0.6 * force[2] * (1.0 + 1e-6) + 1e-6,
                "{force:?}"
            );
        }
    }
}

#[test]
fn on_ice_a_standing_robot_stands() {
    let setup = Setup {
        ground: Some(flat(0.0)),
        ..standing()
    };
    let mut scene = Scene::new(&robot(), &setup, DEFAULT);
    scene.soundly(1.0).unwrap();
    assert_eq!(scene.plant.work().fallbacks, 0);
    assert!(scene.energy().kinetic < 1e-12);
}

#[test]
fn the_ground_s_force_is_its_impulse_over_the_time_that_it_is_told_for() {
    // Weight and motion account for all of it, however short the steps and whatever struck within.
    const SECONDS: f64 = 0.3;
    let robot = robot();
    let mut mass = robot.trunk.mass;
    for mount in &robot.legs {
        let parts = &mount.leg.mass;
        mass += parts.l1 + parts.l2 + parts.l3 + parts.foot;
    }
    for way in [
        DEFAULT,
        Way::by(Method::Rk4, 500),
        Way::by(Method::Rodas4, 2000),
        Way::by(Method::Moreau, 2000),
        Way::by(Method::Moreau, 500),
        Way::by(Method::SemiImplicit, 1000),
        Way::by(Method::SemiImplicit, 250),
        Way::by(Method::ExplicitEuler, 50),
    ] {
        let mut scene = Scene::new(&robot, &drop(0.1, 0.6), way);
        scene.plant.begin_window();
        scene.soundly(SECONDS - 2e-3).unwrap();
        let before = scene.energy().gravity;
        scene.soundly(2e-3).unwrap();
        let forces = LEGS.map(|leg| scene.read(&format!("leg/{leg}/foot/force"))[2]);
        let impulse = forces.iter().sum::<f64>() * SECONDS;
        let at = scene.energy().gravity;
        scene.soundly(2e-3).unwrap();
        let weight = mass * 9.81;
        let momentum = mass * (scene.energy().gravity - before) / (4e-3 * weight);
        let expected = weight * SECONDS + momentum;
        assert!(at.is_finite());
        assert!(
            (impulse - expected).abs() < 1e-2 * expected,
            "{way:?}: {impulse} of {expected}"
        );
    }
}

#[test]
fn a_trunk_without_legs_falls_and_one_with_one_leg_stumbles() {
    for base in [Base::Free, Base::Planar, Base::Fixed] {
        for way in &WAYS[..4] {
            let none = Setup {
                base,
                legs: Vec::new(),
                ..standing()
            };
            let mut scene = Scene::new(&robot(), &none, *way);
            let start = scene.read("body/position")[2];
            scene.soundly(0.1).unwrap();
            let fallen = start - scene.read("body/position")[2];
            let expected = if base == Base::Fixed { 0.0 } else { 0.049_05 };
            assert!((fallen - expected).abs() < 1e-3, "{way:?}: {fallen}");
            let one = Setup {
                base,
                legs: vec!["RH".to_owned()],
                ..standing()
            };
            let mut scene = Scene::new(&robot(), &one, *way);
            scene.soundly(0.3).unwrap();
        }
    }
}

/// A foot that slides until its own friction presses it down by more than its normal force lifts it, which no force solves
/// (Painlevé's paradox). The ground's normal mobility passes through zero at 0.223 s; an impulse stops the slide there.
#[test]
fn a_foot_that_its_friction_presses_down_does_not_sink() {
    let setup = Setup {
        base: Base::Planar,
        legs: vec!["LF".to_owned()],
        drives: Drives::None,
        start: pose([-42.0758, -82.8063, 87.371], [0.0; 3]),
        ..drop(0.05, 0.6)
    };
    for method in [Method::Rk4, Method::Rodas4] {
        let way = Way::by(method, 100).with_toes();
        let mut scene = Scene::new(&robot(), &setup, way);
        for _ in 0..260 {
            scene.soundly(1e-3).unwrap();
            let clearance = scene.value("leg/LF/foot/clearance");
            assert!(
                clearance > -1e-6,
                "{method:?}: {clearance} at {} us",
                scene.now_us
            );
        }
        assert_eq!(scene.plant.work().fallbacks, 0, "{method:?}");
    }
}
