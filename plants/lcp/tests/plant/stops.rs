//! Stops and cables that are reached, overloaded and released.

use twinrig_legged::{Base, Drives, Setup};
use twinrig_robot::leg::Pantograph;
use twinrig_runtime::{Plant, PlantEventKind};
use twinrig_testing::robots::{LEGS, SERVO, robot};

use crate::harness::{
    DEFAULT, INTEGRATIONS, hard_impact, lcp, passive_start, standing_setup, suspended,
};

/// Returns a setup of servo-driven legs on a fixed trunk.
fn fixed_trunk() -> Setup {
    Setup {
        base: Base::Fixed,
        ground: None,
        ..standing_setup()
    }
}

#[test]
fn overwound_cable_stalls_motor_at_torque_limit() {
    let robot = robot();
    let taut = SERVO.torque / robot.legs[0].leg.pulley_radius;
    for integration in INTEGRATIONS {
        let mut harness = lcp(&robot, &fixed_trunk(), integration);
        for pair in harness.commands.chunks_mut(2) {
            pair[1] = 10.0;
        }
        harness.run_checked(0.4).unwrap();
        // The pulley may chatter at the stop; the mean cable force corresponds to the torque limit.
        let mut mean = [0.0; 4];
        for _ in 0..50 {
            harness.run_checked(2e-3).unwrap();
            for (mean, leg) in mean.iter_mut().zip(LEGS) {
                *mean += harness.value(&format!("leg/{leg}/cable/tension")) / 50.0;
            }
        }
        for (tension, leg) in mean.into_iter().zip(LEGS) {
            let torque = harness.value(&format!("leg/{leg}/knee/torque"));
            assert!(
                (torque - SERVO.torque).abs() < 1e-6,
                "{integration:?}: {torque}"
            );
            assert!(
                (tension - taut).abs() < 0.2 * taut,
                "{integration:?}: {tension} of {taut}"
            );
        }
        let violation = harness.plant.constraint_violation().unwrap();
        assert!(violation < 2e-3, "{integration:?}: {violation}");
    }
}

#[test]
fn overwinding_by_unlimited_motor_is_a_fault() {
    let setup = Setup {
        drives: Drives::Ideal { period: 5e-3 },
        ..fixed_trunk()
    };
    for integration in &INTEGRATIONS[..5] {
        let mut harness = lcp(&robot(), &setup, *integration);
        for pair in harness.commands.chunks_mut(2) {
            pair[1] = 10.0;
        }
        let fault = harness.run_checked(0.5).unwrap_err();
        assert!(harness.now_us < 200_000, "{integration:?}: {fault}");
    }
}

#[test]
fn cable_tension_is_non_negative_and_zero_when_slack() {
    let robot = robot();
    let leg = &robot.legs[0].leg;
    let pantograph = Pantograph::new(leg).unwrap();
    for integration in INTEGRATIONS {
        let mut harness = lcp(&robot, &fixed_trunk(), integration);
        let rest = harness.commands[1];
        let (mut slack, mut taut, mut before) = (0, 0, 0.0);
        for k in 0..300_u64 {
            // Winds beyond the stretched leg and back.
            let swing = libm::sin(0.1 * k as f64);
            for pair in harness.commands.chunks_mut(2) {
                pair[1] = rest - swing;
            }
            harness.try_advance_to_us(2000 * (k + 1)).unwrap();
            let tension = harness.value("leg/LF/cable/tension");
            let angles = harness.read("leg/LF/angles");
            let bend = libm::cos(angles[1] - angles[0]);
            let span = libm::sqrt(leg.l1 * leg.l1 + leg.l2 * leg.l2 + 2.0 * leg.l1 * leg.l2 * bend);
            let gap = pantograph.cable_length(harness.value("leg/LF/knee/position")) - span;
            assert!(tension >= 0.0, "{integration:?}: {tension}");
            assert!(gap > -5e-3, "{integration:?}: {gap}");
            if gap.min(before) > 1e-3 {
                slack += 1;
                assert_eq!(tension, 0.0, "{integration:?}: slack by {gap}");
            }
            taut += u32::from(tension > 0.0);
            before = gap;
        }
        assert!(slack > 10 && taut > 10, "{integration:?}: {slack} {taut}");
    }
}

#[test]
fn released_stop_is_not_reached_again_at_once() {
    for start in [passive_start(), hard_impact()] {
        let mut harness = lcp(&robot(), &suspended(start), DEFAULT);
        harness.plant.log_events(true);
        harness.advance_to_ms(1000);
        let events = harness.plant.events();
        assert!(!events.is_empty() && events.len() < 60, "{}", events.len());
        for leg in LEGS {
            for stop in ["closed", "open", "extended", "bottomed"] {
                let part = format!("leg/{leg}/{stop}");
                let part_events: Vec<_> = events.iter().filter(|e| e.part == part).collect();
                for pair in part_events.windows(2) {
                    assert_ne!(pair[0].kind, pair[1].kind, "{part}");
                    let reached = pair[1].kind == PlantEventKind::Reached;
                    assert!(!reached || pair[1].at_s - pair[0].at_s > 1e-3, "{pair:?}");
                }
            }
        }
    }
}

#[test]
fn standing_robot_has_no_events() {
    let mut harness = lcp(&robot(), &standing_setup(), DEFAULT);
    harness.advance_to_ms(10);
    harness.plant.log_events(true);
    harness.run_checked(1.0).unwrap();
    assert_eq!(
        harness.plant.events().len(),
        0,
        "{:?}",
        harness.plant.events()
    );
    assert_eq!(harness.plant.work().fallbacks, 0);
    assert!(harness.energy().kinetic < 1e-12);
}
