//! What must hold of any motion.

use proptest::prelude::*;
use twinrig_lcp::Method;
use twinrig_legged::{Base, Drives, Setup};
use twinrig_runtime::{Plant, PlantEventKind};

use crate::scene::{
    DEFAULT, LEGS, Scene, WAYS, Way, below, between, flat, hanging, hard, robot, standing, swinging,
};

/// Motions from calm to violent: feet that step and slide, falls, motors that tire.
#[derive(Clone, Copy, Debug)]
struct Motion {
    way: Way,
    base: Base,
    friction: f64,
    fall: f64,
    /// Cycles a second, swing of hips and pulleys \[rad\].
    frequency: f64,
    swing: [f64; 2],
    torque: f64,
}

fn motions() -> impl Strategy<Value = Motion> {
    let base = prop_oneof![Just(Base::Free), Just(Base::Planar), Just(Base::Fixed)];
    let way = prop::sample::select(WAYS.to_vec());
    let swings = (1.0..4.0_f64, 0.0..0.4_f64, 0.0..0.4_f64);
    (way, base, 0.0..1.2_f64, 0.0..0.1_f64, swings, 1.0..4.0_f64).prop_map(
        |(way, base, friction, fall, (frequency, hip, knee), torque)| Motion {
            way,
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
            ground: Some(below(self.fall, self.friction)),
            ..standing()
        };
        if let Drives::Servos { hip, knee } = &mut setup.drives {
            (hip.torque, knee.torque) = (self.torque, self.torque);
        }
        setup
    }

    fn scene(&self) -> Scene {
        Scene::new(&robot(), &self.setup(), self.way)
    }

    /// On to the `k`-th pair of milliseconds, as far as it goes.
    fn go(&self, scene: &mut Scene, rest: &[f64], k: u64) -> bool {
        let angle = std::f64::consts::TAU * self.frequency * 2e-3 * k as f64;
        let legs = scene.commands.chunks_mut(2).zip(rest.chunks(2));
        for (leg, (pair, rest)) in legs.enumerate() {
            let phase = if leg % 3 == 0 {
                0.0
            } else {
                std::f64::consts::PI
            };
            pair[0] = rest[0] + self.swing[0] * libm::sin(angle + phase);
            pair[1] = rest[1] + self.swing[1] * libm::cos(angle + phase).max(0.0);
        }
        scene.try_to_us(2000 * k).is_ok()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(18))]

    #[test]
    fn a_restored_plant_goes_on_bit_for_bit(motion in motions(), from in 1..60_u64) {
        let (mut scene, mut other) = (motion.scene(), motion.scene());
        let rest = scene.commands.clone();
        let mut sound = true;
        for k in 1..=from {
            sound &= motion.go(&mut scene, &rest, k);
        }
        prop_assume!(sound);
        let saved = scene.plant.save();
        // Into a plant that has been elsewhere meanwhile.
        other.to_ms(14);
        other.plant.begin_window();
        other.plant.restore(&saved).unwrap();
        other.now_us = scene.now_us;
        prop_assert_eq!(&other.plant.save().0, &saved.0);
        for k in from + 1..from + 25 {
            let went = [&mut scene, &mut other].map(|scene| motion.go(scene, &rest, k));
            prop_assert_eq!(went[0], went[1]);
            prop_assert_eq!(scene.observe(), other.observe());
        }
        prop_assert_eq!(scene.plant.save().0, other.plant.save().0);
    }

    #[test]
    fn the_same_motion_twice_is_the_same_looked_at_logged_or_not(motion in motions()) {
        let (mut plain, mut watched) = (motion.scene(), motion.scene());
        let rest = plain.commands.clone();
        watched.plant.log_events(true);
        for k in 1..80 {
            let went = [&mut plain, &mut watched].map(|scene| motion.go(scene, &rest, k));
            prop_assert_eq!(went[0], went[1]);
            watched.observe();
            if k == 40 {
                watched.plant.log_events(true);
            }
        }
        prop_assert_eq!(plain.plant.save().0, watched.plant.save().0);
    }

    #[test]
    fn events_come_in_order_and_turn_about(motion in motions()) {
        let mut scene = motion.scene();
        let rest = scene.commands.clone();
        scene.plant.log_events(true);
        for k in 1..80 {
            if !motion.go(&mut scene, &rest, k) {
                break;
            }
        }
        let events = scene.plant.events();
        prop_assert!(events.windows(2).all(|pair| pair[0].at_s <= pair[1].at_s + 2e-3));
        for event in events {
            prop_assert!((0.0..=0.16).contains(&event.at_s), "{:?}", event);
        }
        for (i, event) in events.iter().enumerate() {
            let next = events[i + 1..].iter().find(|later| later.part == event.part);
            prop_assert!(next.is_none_or(|next| next.kind != event.kind && next.at_s >= event.at_s), "{:?}", event);
            let first = events[..i].iter().all(|other| other.part != event.part);
            prop_assert!(!first || event.kind == PlantEventKind::Reached, "{:?}", event);
        }
    }

    #[test]
    fn forces_stay_within_what_ground_cables_and_motors_can_do(motion in motions()) {
        let mut scene = motion.scene();
        let rest = scene.commands.clone();
        for k in 1..100 {
            scene.plant.begin_window();
            if !motion.go(&mut scene, &rest, k) {
                break;
            }
            for leg in LEGS {
                let force = scene.read(&format!("leg/{leg}/foot/force"));
                let sideways = libm::hypot(force[0], force[1]);
                // Swept, not solved, is the thesis' way.
                let left = if motion.way.method == Method::Thesis { 1.0 } else { 1e-2 };
                prop_assert!(force[2] >= -left, "{:?}", force);
                prop_assert!(sideways <= motion.friction * force[2] + left, "{:?}", force);
                let tension = scene.value(&format!("leg/{leg}/cable/tension"));
                prop_assert!(tension >= 0.0, "{}", tension);
                for motor in ["hip", "knee"] {
                    let torque = scene.value(&format!("leg/{leg}/{motor}/torque"));
                    // Euler's methods tire a motor a step late.
                    let heeded = [Method::Rk4, Method::Rodas4, Method::Moreau];
                    if !heeded.contains(&motion.way.method) {
                        continue;
                    }
                    prop_assert!(torque.abs() < 1.3 * motion.torque + 0.1, "{} of {}", torque, motion.torque);
                }
                // Off the ground by more than it can have come in the time, it feels none.
                let gap = scene.value(&format!("leg/{leg}/foot/clearance"));
                prop_assert!(gap > -2e-2, "{}", gap);
                if gap > 2e-2 {
                    prop_assert_eq!(&force, &vec![0.0; 3], "{} m above the ground", gap);
                }
            }
        }
    }

    #[test]
    fn a_leg_left_out_of_a_trunk_that_is_held_changes_no_bit_of_the_others(
        motion in motions(), gone in 0..4_usize,
    ) {
        let motion = Motion { base: Base::Fixed, ..motion };
        // All in one step of one problem, or each for itself.
        prop_assume!(matches!(motion.way.method, Method::Rk4 | Method::Rodas4));
        let setup = Setup { ground: None, ..motion.setup() };
        let mut fewer = setup.clone();
        fewer.legs.remove(gone);
        let (mut all, mut some) = (
            Scene::new(&robot(), &setup, motion.way),
            Scene::new(&robot(), &fewer, motion.way),
        );
        // Same phases for the same legs.
        let still = Motion { swing: [0.0, 0.0], ..motion };
        let rests = [all.commands.clone(), some.commands.clone()];
        for k in 1..60 {
            let sway = motion.swing[1] * libm::sin(0.1 * k as f64);
            let moved = rests.clone().map(|rest| rest.iter().map(|x| x + sway).collect::<Vec<_>>());
            prop_assert!(still.go(&mut all, &moved[0], k) && still.go(&mut some, &moved[1], k));
            if all.plant.work().fallbacks + some.plant.work().fallbacks > 0 {
                break;
            }
            for leg in &fewer.legs {
                for what in ["angles", "foot/position", "hip/torque", "cable/tension"] {
                    let name = format!("leg/{leg}/{what}");
                    prop_assert_eq!(all.read(&name), some.read(&name), "{} at {}", name, k);
                }
            }
        }
    }
}

#[test]
fn a_plant_that_is_saved_amid_impacts_goes_on_as_it_would_have() {
    for way in WAYS {
        let setup = Setup {
            ground: Some(below(0.1, 0.6)),
            ..standing()
        };
        let mut scene = Scene::new(&robot(), &setup, way);
        scene.to_ms(140);
        let mut other = Scene::new(&robot(), &setup, way);
        // Every step of the landing.
        for _ in 0..20 {
            let saved = scene.plant.save();
            other.plant.restore(&saved).unwrap();
            other.now_us = scene.now_us;
            scene.step().unwrap();
            other.step().unwrap();
            assert_eq!(scene.plant.save().0, other.plant.save().0, "{way:?}");
        }
        scene.to_ms(200);
        other.to_ms(200);
        assert_eq!(scene.observe(), other.observe(), "{way:?}");
    }
}

#[test]
fn a_snapshot_of_something_else_is_refused() {
    let mut scene = Scene::new(&robot(), &standing(), DEFAULT);
    let before = scene.observe().to_vec();
    let other = twinrig_kernel::Snapshot(vec![1, 2, 3]);
    assert!(scene.plant.restore(&other).is_err());
    assert_eq!(scene.observe(), before);
}

#[test]
fn what_the_books_miss_shrinks_with_the_method_s_order() {
    for (method, steps, ratio) in [
        (Method::Rk4, [500, 250], 12.0..20.0),
        (Method::Rodas4, [2000, 1000], 12.0..80.0),
        (Method::Moreau, [1000, 500], 3.7..4.3),
        (Method::SemiImplicit, [1000, 500], 1.8..2.3),
        (Method::ExplicitEuler, [100, 50], 1.8..2.3),
        (Method::Thesis, [100, 50], 1.8..2.3),
    ] {
        let [coarse, fine] = steps.map(|step_us| {
            let way = Way::by(method, step_us).within(f64::INFINITY);
            let mut scene = Scene::new(&between(), &hanging(swinging()), way);
            scene.to_ms(100);
            scene.energy().residual.abs()
        });
        assert!(
            ratio.contains(&(coarse / fine)),
            "{method:?}: {coarse:e}, then {fine:e}"
        );
    }
}

#[test]
fn in_flight_the_centre_of_mass_falls_as_a_stone() {
    // Legs that hit their stops hard are nobody's business but the trunk's.
    let robot = robot();
    let mut mass = robot.trunk.mass;
    for mount in &robot.legs {
        let parts = &mount.leg.mass;
        mass += parts.l1 + parts.l2 + parts.l3 + parts.foot;
    }
    let mut right = None;
    // All but the thesis', whose resets push at nothing.
    for way in &WAYS[..5] {
        let setup = Setup {
            base: Base::Free,
            ..hanging(hard())
        };
        let mut scene = Scene::new(&robot, &setup, *way);
        let mut heights = vec![scene.energy().gravity / (mass * 9.81)];
        for _ in 0..100 {
            scene.soundly(2e-3).unwrap();
            heights.push(scene.energy().gravity / (mass * 9.81));
        }
        let exact = matches!(way.method, Method::Rk4 | Method::Rodas4);
        for bend in heights.windows(3).filter(|_| exact) {
            let fall = bend[0] - 2.0 * bend[1] + bend[2] + 9.81 * 4e-6;
            assert!(fall.abs() < 1e-8, "{way:?}: {fall:e}");
        }
        // The others are where they should be in the end, as nearly as links that turn by a finite angle a step can.
        let last = heights[heights.len() - 1];
        let right = *right.get_or_insert(last);
        assert!((last - right).abs() < 5e-3, "{way:?}: {last} of {right}");
    }
}

#[test]
fn a_robot_that_is_not_looked_at_goes_the_same_way() {
    let setup = Setup {
        ground: Some(flat(0.6)),
        ..standing()
    };
    for way in WAYS {
        let mut all = Scene::new(&robot(), &setup, way);
        let mut few = Scene::wanting(&robot(), &setup, way, &|name| name == "body/position");
        for ms in (2..=60).step_by(2) {
            let swing = 0.2 * libm::sin(0.2 * ms as f64);
            for scene in [&mut all, &mut few] {
                scene.commands[0] = swing;
                scene.commands[6] = -swing;
                scene.to_ms(ms);
            }
            all.observe();
        }
        assert_eq!(
            all.read("body/position"),
            few.read("body/position"),
            "{way:?}"
        );
        assert_eq!(all.energy(), few.energy());
    }
}
