//! Stops and cables that are reached, loaded beyond measure and let go.

use twinrig_lcp::Method;
use twinrig_leg::Pantograph;
use twinrig_legged::{Base, Drives, Setup};
use twinrig_runtime::{Plant, PlantEventKind};

use crate::scene::{DEFAULT, LEGS, SERVO, Scene, WAYS, hanging, hard, passive, robot, standing};

/// Legs on a trunk that is held, driven.
fn held() -> Setup {
    Setup {
        base: Base::Fixed,
        ground: None,
        ..standing()
    }
}

#[test]
fn a_cable_that_is_wound_beyond_all_reach_stalls_its_motor_and_loads_the_stop_no_further() {
    let robot = robot();
    let taut = SERVO.torque / robot.legs[0].leg.pulley_radius;
    for way in WAYS {
        let mut scene = Scene::new(&robot, &held(), way);
        for pair in scene.commands.chunks_mut(2) {
            pair[1] = 10.0;
        }
        scene.soundly(0.4).unwrap();
        // The pulley may rattle in the stop; on the mean the cable carries what the motor has.
        let mut mean = [0.0; 4];
        for _ in 0..50 {
            scene.soundly(2e-3).unwrap();
            for (mean, leg) in mean.iter_mut().zip(LEGS) {
                *mean += scene.value(&format!("leg/{leg}/cable/tension")) / 50.0;
            }
        }
        for (tension, leg) in mean.into_iter().zip(LEGS) {
            let torque = scene.value(&format!("leg/{leg}/knee/torque"));
            assert!((torque - SERVO.torque).abs() < 1e-6, "{way:?}: {torque}");
            assert!(
                (tension - taut).abs() < 0.2 * taut,
                "{way:?}: {tension} of {taut}"
            );
        }
        let drift = scene.plant.constraint_violation().unwrap();
        assert!(drift < 2e-3, "{way:?}: {drift}");
    }
}

#[test]
fn a_motor_without_limit_that_winds_beyond_all_reach_ends_in_a_fault() {
    let setup = Setup {
        drives: Drives::Ideal { period: 5e-3 },
        ..held()
    };
    for way in &WAYS[..5] {
        let mut scene = Scene::new(&robot(), &setup, *way);
        for pair in scene.commands.chunks_mut(2) {
            pair[1] = 10.0;
        }
        let fault = scene.soundly(0.5).unwrap_err();
        assert!(scene.now_us < 200_000, "{way:?}: {fault}");
    }
}

#[test]
fn a_cable_pulls_while_it_is_taut_and_never_pushes() {
    let robot = robot();
    let leg = &robot.legs[0].leg;
    let pantograph = Pantograph::new(leg).unwrap();
    for way in WAYS {
        let mut scene = Scene::new(&robot, &held(), way);
        let rest = scene.commands[1];
        let (mut slack, mut taut, mut before) = (0, 0, 0.0);
        for k in 0..300_u64 {
            // Beyond where the leg is stretched out, and back.
            let swing = libm::sin(0.1 * k as f64);
            for pair in scene.commands.chunks_mut(2) {
                pair[1] = rest - swing;
            }
            scene.try_to_us(2000 * (k + 1)).unwrap();
            let tension = scene.value("leg/LF/cable/tension");
            let angles = scene.read("leg/LF/angles");
            let bend = libm::cos(angles[1] - angles[0]);
            let span = libm::sqrt(leg.l1 * leg.l1 + leg.l2 * leg.l2 + 2.0 * leg.l1 * leg.l2 * bend);
            let gap = pantograph.cable_length(scene.value("leg/LF/knee/position")) - span;
            assert!(tension >= 0.0, "{way:?}: {tension}");
            assert!(gap > -5e-3, "{way:?}: {gap}");
            if gap.min(before) > 1e-3 {
                slack += 1;
                assert_eq!(tension, 0.0, "{way:?}: slack by {gap}");
            }
            taut += u32::from(tension > 0.0);
            before = gap;
        }
        assert!(slack > 10 && taut > 10, "{way:?}: {slack} {taut}");
    }
}

#[test]
fn what_is_let_go_is_not_caught_again_at_once() {
    for start in [passive(), hard()] {
        let mut scene = Scene::new(&robot(), &hanging(start), DEFAULT);
        scene.plant.log_events(true);
        scene.to_ms(1000);
        let events = scene.plant.events();
        assert!(!events.is_empty() && events.len() < 60, "{}", events.len());
        for leg in LEGS {
            for stop in ["closed", "open", "extended", "bottomed"] {
                let part = format!("leg/{leg}/{stop}");
                let own: Vec<_> = events.iter().filter(|e| e.part == part).collect();
                for pair in own.windows(2) {
                    assert_ne!(pair[0].kind, pair[1].kind, "{part}");
                    let caught = pair[1].kind == PlantEventKind::Reached;
                    assert!(!caught || pair[1].at_s - pair[0].at_s > 1e-3, "{pair:?}");
                }
            }
        }
    }
}

#[test]
fn a_robot_that_stands_still_has_nothing_to_report() {
    let mut scene = Scene::new(&robot(), &standing(), DEFAULT);
    scene.to_ms(10);
    scene.plant.log_events(true);
    scene.soundly(1.0).unwrap();
    assert_eq!(scene.plant.events().len(), 0, "{:?}", scene.plant.events());
    assert_eq!(scene.plant.work().fallbacks, 0);
    assert!(scene.energy().kinetic < 1e-12);
    let _ = Method::ALL;
}
