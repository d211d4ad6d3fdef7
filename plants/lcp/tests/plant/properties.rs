//! Invariants of arbitrary motions.

use proptest::prelude::*;
use twinrig_lcp::Method;
use twinrig_legged::{Base, Drives, Setup};
use twinrig_runtime::{Plant, PlantEvent, PlantEventKind};
use twinrig_testing::robots::{LEGS, flat_ground, robot};

use crate::harness::{
    DEFAULT, Harness, INTEGRATIONS, Integration, free_swinging_robot, hard_impact, lcp,
    lcp_with_signals, lowered_ground, standing_setup, suspended, swinging_start,
};

/// Motions from calm to violent: stepping and sliding feet, falls, saturated motors.
#[derive(Clone, Copy, Debug)]
struct Motion {
    integration: Integration,
    base: Base,
    friction: f64,
    fall: f64,
    /// Frequency \[Hz\], and amplitudes of hips and pulleys \[rad\].
    frequency: f64,
    swing: [f64; 2],
    torque: f64,
}

fn motions() -> impl Strategy<Value = Motion> {
    let base = prop_oneof![Just(Base::Free), Just(Base::Planar), Just(Base::Fixed)];
    let integration = prop::sample::select(INTEGRATIONS.to_vec());
    let swings = (1.0..4.0_f64, 0.0..0.4_f64, 0.0..0.4_f64);
    (
        integration,
        base,
        0.0..1.2_f64,
        0.0..0.1_f64,
        swings,
        1.0..4.0_f64,
    )
        .prop_map(
            |(integration, base, friction, fall, (frequency, hip, knee), torque)| Motion {
                integration,
                base,
                friction,
                fall,
                frequency,
                swing: [hip, knee],
                torque,
            },
        )
}

impl Motion {
    fn setup(&self) -> Setup {
        let mut setup = Setup {
            base: self.base,
            ground: Some(lowered_ground(self.fall, self.friction)),
            ..standing_setup()
        };
        if let Drives::Servos { hip, knee } = &mut setup.drives {
            (hip.torque, knee.torque) = (self.torque, self.torque);
        }
        setup
    }

    fn harness(&self) -> Harness {
        lcp(&robot(), &self.setup(), self.integration)
    }

    /// Advances to time 2 ms · `k` under the commands of the motion. Returns whether no fault
    /// occurred.
    fn advance_to_tick(&self, harness: &mut Harness, rest: &[f64], k: u64) -> bool {
        let angle = std::f64::consts::TAU * self.frequency * 2e-3 * k as f64;
        let legs = harness.commands.chunks_mut(2).zip(rest.chunks(2));
        for (leg, (pair, rest)) in legs.enumerate() {
            let phase = if leg % 3 == 0 {
                0.0
            } else {
                std::f64::consts::PI
            };
            pair[0] = rest[0] + self.swing[0] * libm::sin(angle + phase);
            pair[1] = rest[1] + self.swing[1] * libm::cos(angle + phase).max(0.0);
        }
        harness.try_advance_to_us(2000 * k).is_ok()
    }

    /// Asserts that a plant restored at a tick continues as the original; returns false if a fault
    /// occurred before.
    fn restored_continues(&self, from: u64) -> bool {
        let (mut harness, mut other) = (self.harness(), self.harness());
        let rest = harness.commands.clone();
        for k in 1..=from {
            if !self.advance_to_tick(&mut harness, &rest, k) {
                return false;
            }
        }
        let saved = harness.plant.save();
        // The target plant has advanced differently.
        other.advance_to_ms(14);
        other.plant.begin_window();
        other.plant.restore(&saved).unwrap();
        other.now_us = harness.now_us;
        assert_eq!(other.plant.save().0, saved.0);
        for k in from + 1..from + 25 {
            let [original, restored] =
                [&mut harness, &mut other].map(|harness| self.advance_to_tick(harness, &rest, k));
            assert_eq!(original, restored, "tick {k}");
            assert_eq!(harness.observe(), other.observe(), "tick {k}");
        }
        assert_eq!(harness.plant.save().0, other.plant.save().0);
        true
    }

    /// Asserts that the events of every part are in the order of time, and alternate.
    fn assert_events_alternate(&self) {
        let mut harness = self.harness();
        let rest = harness.commands.clone();
        harness.plant.log_events(true);
        for k in 1..80 {
            if !self.advance_to_tick(&mut harness, &rest, k) {
                break;
            }
        }
        let events = harness.plant.events();
        assert!(
            events
                .windows(2)
                .all(|pair| pair[0].at_s <= pair[1].at_s + 2e-3)
        );
        for (i, event) in events.iter().enumerate() {
            assert!((0.0..=0.16).contains(&event.at_s), "{event:?}");
            let of_part = |other: &&PlantEvent| other.part == event.part;
            if let Some(next) = events[i + 1..].iter().find(of_part) {
                assert!(
                    next.kind != event.kind && next.at_s >= event.at_s,
                    "{event:?}, {next:?}"
                );
            }
            if !events[..i].iter().any(|other| other.part == event.part) {
                assert_eq!(event.kind, PlantEventKind::Reached, "{event:?}");
            }
        }
    }
}

#[test]
fn stop_reached_as_a_motor_saturates_has_the_time_of_its_event() {
    // A motor changes between its limit and its command at an event within a step, after which the
    // constraints are selected anew.
    let motion = Motion {
        integration: DEFAULT,
        base: Base::Free,
        friction: 0.0,
        fall: 0.0,
        frequency: 3.838,
        swing: [0.241_315_802_833_312_14, 0.205_234_107_288_689_46],
        torque: 1.053_352_241_183_519,
    };
    motion.assert_events_alternate();
}

#[test]
fn plant_restored_after_a_failed_event_continues_bit_for_bit() {
    // The event of a step that is repeated by Moreau's rule fails after its impact. The velocities
    // before that impact are no part of the state: the next event must not take them for its own.
    let motion = Motion {
        integration: Integration::new(Method::Rodas4, 2000),
        base: Base::Free,
        friction: 0.330_337_659_985_046,
        fall: 0.030_991_199_686_581_504,
        frequency: 1.736_891_529_197_545_5,
        swing: [0.221_483_718_119_597_58, 0.086_790_916_613_446_12],
        torque: 1.0,
    };
    assert!(motion.restored_continues(44));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(18))]

    #[test]
    fn restored_plant_continues_bit_for_bit(motion in motions(), from in 1..60_u64) {
        prop_assume!(motion.restored_continues(from));
    }

    #[test]
    fn observation_and_event_logging_do_not_change_the_motion(motion in motions()) {
        let (mut unobserved, mut observed) = (motion.harness(), motion.harness());
        let rest = unobserved.commands.clone();
        observed.plant.log_events(true);
        for k in 1..80 {
            let advanced = [&mut unobserved, &mut observed].map(|harness| motion.advance_to_tick(harness, &rest, k));
            prop_assert_eq!(advanced[0], advanced[1]);
            observed.observe();
            if k == 40 {
                observed.plant.log_events(true);
            }
        }
        prop_assert_eq!(unobserved.plant.save().0, observed.plant.save().0);
    }

    #[test]
    fn events_are_ordered_and_alternate(motion in motions()) {
        motion.assert_events_alternate();
    }

    #[test]
    fn forces_respect_limits_of_ground_cables_and_motors(motion in motions()) {
        let mut harness = motion.harness();
        let rest = harness.commands.clone();
        for k in 1..100 {
            harness.plant.begin_window();
            if !motion.advance_to_tick(&mut harness, &rest, k) {
                break;
            }
            for leg in LEGS {
                let force = harness.read(&format!("leg/{leg}/foot/force"));
                let tangential = libm::hypot(force[0], force[1]);
                // The Gauss–Seidel sweeps of the thesis method leave larger residuals.
                let tolerance = if motion.integration.method == Method::Thesis { 1.0 } else { 1e-2 };
                prop_assert!(force[2] >= -tolerance, "{:?}", force);
                prop_assert!(tangential <= motion.friction * force[2] + tolerance, "{:?}", force);
                let tension = harness.value(&format!("leg/{leg}/cable/tension"));
                prop_assert!(tension >= 0.0, "{}", tension);
                for motor in ["hip", "knee"] {
                    let torque = harness.value(&format!("leg/{leg}/{motor}/torque"));
                    // Euler's methods saturate a motor one step late.
                    let saturating = [Method::Rk4, Method::Rodas4, Method::Moreau];
                    if !saturating.contains(&motion.integration.method) {
                        continue;
                    }
                    prop_assert!(torque.abs() < 1.3 * motion.torque + 0.1, "{} of {}", torque, motion.torque);
                }
                // Beyond the distance that a foot can cover in one window, its force must be zero.
                let gap = harness.value(&format!("leg/{leg}/foot/clearance"));
                prop_assert!(gap > -2e-2, "{}", gap);
                if gap > 2e-2 {
                    prop_assert_eq!(&force, &vec![0.0; 3], "{} m above the ground", gap);
                }
            }
        }
    }

    #[test]
    fn omitted_leg_of_fixed_trunk_leaves_others_bitwise_unchanged(
        motion in motions(), omitted in 0..4_usize,
    ) {
        let motion = Motion { base: Base::Fixed, ..motion };
        // Only for methods that integrate each leg independently.
        prop_assume!(matches!(motion.integration.method, Method::Rk4 | Method::Rodas4));
        let setup = Setup { ground: None, ..motion.setup() };
        let mut reduced = setup.clone();
        reduced.legs.remove(omitted);
        let (mut all, mut some) = (
            lcp(&robot(), &setup, motion.integration),
            lcp(&robot(), &reduced, motion.integration),
        );
        // Same phases for the same legs.
        let still = Motion { swing: [0.0, 0.0], ..motion };
        let rests = [all.commands.clone(), some.commands.clone()];
        for k in 1..60 {
            let sway = motion.swing[1] * libm::sin(0.1 * k as f64);
            let shifted = rests.clone().map(|rest| rest.iter().map(|x| x + sway).collect::<Vec<_>>());
            prop_assert!(still.advance_to_tick(&mut all, &shifted[0], k) && still.advance_to_tick(&mut some, &shifted[1], k));
            if all.plant.work().fallbacks + some.plant.work().fallbacks > 0 {
                break;
            }
            for leg in &reduced.legs {
                for signal in ["angles", "foot/position", "hip/torque", "cable/tension"] {
                    let name = format!("leg/{leg}/{signal}");
                    prop_assert_eq!(all.read(&name), some.read(&name), "{} at {}", name, k);
                }
            }
        }
    }
}

#[test]
fn plant_saved_during_landing_continues_bit_for_bit() {
    for integration in INTEGRATIONS {
        let setup = Setup {
            ground: Some(lowered_ground(0.1, 0.6)),
            ..standing_setup()
        };
        let mut harness = lcp(&robot(), &setup, integration);
        harness.advance_to_ms(140);
        let mut other = lcp(&robot(), &setup, integration);
        // Every step of the landing.
        for _ in 0..20 {
            let saved = harness.plant.save();
            other.plant.restore(&saved).unwrap();
            other.now_us = harness.now_us;
            harness.step().unwrap();
            other.step().unwrap();
            assert_eq!(
                harness.plant.save().0,
                other.plant.save().0,
                "{integration:?}"
            );
        }
        harness.advance_to_ms(200);
        other.advance_to_ms(200);
        assert_eq!(harness.observe(), other.observe(), "{integration:?}");
    }
}

#[test]
fn foreign_snapshot_is_rejected() {
    let mut harness = lcp(&robot(), &standing_setup(), DEFAULT);
    let before = harness.observe().to_vec();
    let other = twinrig_kernel::Snapshot(vec![1, 2, 3]);
    assert!(harness.plant.restore(&other).is_err());
    assert_eq!(harness.observe(), before);
}

#[test]
fn energy_residual_converges_with_order_of_method() {
    for (method, steps, ratio) in [
        (Method::Rk4, [500, 250], 12.0..20.0),
        (Method::Rodas4, [2000, 1000], 12.0..80.0),
        (Method::Moreau, [1000, 500], 3.7..4.3),
        (Method::SemiImplicit, [1000, 500], 1.8..2.3),
        (Method::ExplicitEuler, [100, 50], 1.8..2.3),
        (Method::Thesis, [100, 50], 1.8..2.3),
    ] {
        let [coarse, fine] = steps.map(|step_us| {
            let integration = Integration::new(method, step_us).with_tolerance(f64::INFINITY);
            let mut harness = lcp(
                &free_swinging_robot(),
                &suspended(swinging_start()),
                integration,
            );
            harness.advance_to_ms(100);
            harness.energy().residual.abs()
        });
        assert!(
            ratio.contains(&(coarse / fine)),
            "{method:?}: {coarse:e}, then {fine:e}"
        );
    }
}

#[test]
fn centre_of_mass_is_in_free_fall_in_flight() {
    // Internal impacts of the legs on their stops do not accelerate the centre of mass.
    let robot = robot();
    let mut mass = robot.trunk.mass;
    for mount in &robot.legs {
        let masses = &mount.leg.mass;
        mass += masses.l1 + masses.l2 + masses.l3 + masses.foot;
    }
    let mut reference = None;
    // All methods except that of the thesis, whose resets do not conserve momentum.
    for integration in &INTEGRATIONS[..5] {
        let setup = Setup {
            base: Base::Free,
            ..suspended(hard_impact())
        };
        let mut harness = lcp(&robot, &setup, *integration);
        let mut heights = vec![harness.energy().gravity / (mass * 9.81)];
        for _ in 0..100 {
            harness.run_checked(2e-3).unwrap();
            heights.push(harness.energy().gravity / (mass * 9.81));
        }
        let exact = matches!(integration.method, Method::Rk4 | Method::Rodas4);
        for bend in heights.windows(3).filter(|_| exact) {
            let fall = bend[0] - 2.0 * bend[1] + bend[2] + 9.81 * 4e-6;
            assert!(fall.abs() < 1e-8, "{integration:?}: {fall:e}");
        }
        // The final heights of the other methods agree within the error of finite rotations per
        // step.
        let last = heights[heights.len() - 1];
        let reference = *reference.get_or_insert(last);
        assert!(
            (last - reference).abs() < 5e-3,
            "{integration:?}: {last} of {reference}"
        );
    }
}

#[test]
fn selection_of_signals_does_not_change_the_motion() {
    let setup = Setup {
        ground: Some(flat_ground(0.6)),
        ..standing_setup()
    };
    for integration in INTEGRATIONS {
        let mut all = lcp(&robot(), &setup, integration);
        let mut selected = lcp_with_signals(&robot(), &setup, integration, &|name| {
            name == "body/position"
        });
        for ms in (2..=60).step_by(2) {
            let swing = 0.2 * libm::sin(0.2 * ms as f64);
            for harness in [&mut all, &mut selected] {
                harness.commands[0] = swing;
                harness.commands[6] = -swing;
                harness.advance_to_ms(ms);
            }
            all.observe();
        }
        assert_eq!(
            all.read("body/position"),
            selected.read("body/position"),
            "{integration:?}"
        );
        assert_eq!(all.energy(), selected.energy());
    }
}
