//! Invariants of any motion.

use proptest::prelude::*;
use twinrig_contact::{Ground, Terrain};
use twinrig_kernel::SimDuration;
use twinrig_legged::{Base, Drives, Setup};
use twinrig_massless::Massless;
use twinrig_robot::leg::{Pantograph, Stop};
use twinrig_runtime::Plant;
use twinrig_testing::plant_harness::at_ms;
use twinrig_testing::robots::{LEGS, SERVO, robot};
use twinrig_testing::trot::Trot;

use super::harness::{Harness, massless, setup, with_outputs};

/// Motions from calm to violent, some with weak drives.
#[derive(Clone, Copy, Debug)]
struct Motion {
    trot: Trot,
    friction: f64,
    torque: f64,
    base: Base,
}

fn motions() -> impl Strategy<Value = Motion> {
    let base = prop_oneof![Just(Base::Free), Just(Base::Planar), Just(Base::Fixed)];
    let trot = (1.0..5.0_f64, 0.0..0.3_f64, 0.0..0.3_f64, 0.8..0.93_f64).prop_map(
        |(frequency, stroke, lift, length)| Trot {
            frequency,
            stroke,
            lift,
            length,
        },
    );
    (trot, 0.0..1.5_f64, 0.2..4.0_f64, base).prop_map(|(trot, friction, torque, base)| Motion {
        trot,
        friction,
        torque,
        base,
    })
}

impl Motion {
    fn setup(&self) -> Setup {
        let mut servo = SERVO;
        servo.torque = self.torque;
        let mut setup = Setup {
            base: self.base,
            ground: Some(Ground::new(Terrain::Flat, self.friction, 0.0).unwrap()),
            drives: Drives::Servos {
                hip: servo,
                knee: servo,
            },
            ..setup()
        };
        setup.start = self.trot.legs(&robot(), &setup, 0.0).into();
        setup
    }

    fn harness(&self) -> Harness {
        massless(&robot(), &self.setup())
    }
}

/// Residual of the contact solver \[N\]: 1e-6 of the greatest approach speed; 5 m/s of 30 g in 1 ms
/// are 150 N.
const FORCE_RESIDUAL: f64 = 1.5e-4;

/// Checks the limits of all signals of every leg after a step of a millisecond.
fn check_limits(
    harness: &mut Harness,
    motion: &Motion,
    leg: &Pantograph,
) -> Result<(), TestCaseError> {
    for name in LEGS {
        let read = |harness: &mut Harness, what: &str| harness.read(&format!("leg/{name}/{what}"));
        let [tension] = read(harness, "cable/tension")[..] else {
            unreachable!()
        };
        prop_assert!(tension >= 0.0);
        let torques = [
            read(harness, "hip/torque")[0],
            read(harness, "knee/torque")[0],
        ];
        for torque in torques {
            // The drive's limit is part of the step's problem: only rounding remains.
            prop_assert!(
                torque.abs() <= motion.torque + 1e-9,
                "{torque} of {}",
                motion.torque
            );
        }
        let force = read(harness, "foot/force");
        let sideways = libm::hypot(force[0], force[1]);
        prop_assert!(force[2] >= -FORCE_RESIDUAL, "{force:?}");
        let friction_max = motion.friction * force[2];
        prop_assert!(
            sideways <= friction_max * (1.0 + 1e-9) + FORCE_RESIDUAL,
            "{force:?}: {}",
            sideways - friction_max
        );
        // Penetration of a foot, or of a stop by a rod, within a step: it arrives at full speed and
        // is stopped by the end of the step, so half a step at the speed of arrival; these feet
        // reach 5 m/s.
        let gap = read(harness, "foot/clearance")[0];
        prop_assert!(gap >= -0.5 * 5.0 * 1e-3, "{gap}");
        let angles = read(harness, "angles");
        let pose = leg
            .pose_of_angles([angles[0], angles[1], angles[2]])
            .unwrap();
        let cable = leg.cable_length(read(harness, "knee/position")[0]);
        for stop in Stop::ALL {
            let beyond = leg.gap(&pose, stop, cable);
            prop_assert!(beyond >= -0.5 * 5.0 * 1e-3, "{stop:?} {beyond}");
            if stop == Stop::Cable && beyond > 1e-2 {
                prop_assert_eq!(tension, 0.0, "slack");
            }
        }
    }
    Ok(())
}

/// Serialised state and counters of a plant.
fn bytes(plant: &Massless) -> Vec<u8> {
    plant.save().0
}

/// Compares a motion on a stand with all legs to the one without the leg `removed`.
fn compare_without(motion: Motion, removed: usize) {
    let robot = robot();
    let motion = Motion {
        base: Base::Fixed,
        ..motion
    };
    let setup = motion.setup();
    let present = LEGS.iter().filter(|leg| **leg != LEGS[removed]);
    let fewer = Setup {
        legs: present.map(|leg| (*leg).to_owned()).collect(),
        ..setup.clone()
    };
    let mut all = massless(&robot, &setup);
    let mut some = massless(&robot, &fewer);
    for ms in 1..=100 {
        all.trot(&robot, &setup, motion.trot, ms);
        some.trot(&robot, &fewer, motion.trot, ms);
        for leg in &fewer.legs {
            for what in ["foot/position", "foot/force", "hip/torque", "cable/tension"] {
                let name = format!("leg/{leg}/{what}");
                assert_eq!(all.read(&name), some.read(&name), "{name} at {ms} ms");
            }
        }
    }
}

#[test]
fn stalled_and_slipping_legs_on_a_stand_are_independent() {
    // A motion that fails with a contact problem common to all legs.
    let trot = Trot {
        frequency: 4.206_242_914_611_993,
        stroke: 0.127_072_806_142_889_8,
        lift: 0.298_994_145_800_159_76,
        length: 0.892_032_590_185_108_2,
    };
    let motion = Motion {
        trot,
        friction: 0.0,
        torque: 1.361_117_280_276_927_6,
        base: Base::Fixed,
    };
    compare_without(motion, 0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn forces_respect_cables_friction_cones_and_torque_limits(motion in motions()) {
        let robot = robot();
        let setup = motion.setup();
        let leg = Pantograph::new(&robot.legs[0].leg).unwrap();
        let mut harness = motion.harness();
        for ms in 1..=200 {
            harness.trot(&robot, &setup, motion.trot, ms);
            check_limits(&mut harness, &motion, &leg)?;
            harness.plant.begin_window();
        }
        let balance = harness.energy();
        prop_assert!(balance.dissipated >= 0.0);
        prop_assert!(balance.residual.abs() < 1e-4 * balance.exchanged + 1e-9, "{:?}", balance);
    }

    #[test]
    fn restored_plant_continues_bit_for_bit(motion in motions(), at_ms in 1..150_u64) {
        let robot = robot();
        let setup = motion.setup();
        let mut harness = motion.harness();
        for ms in 1..=at_ms {
            harness.trot(&robot, &setup, motion.trot, ms);
        }
        let saved = harness.plant.save();
        // Restores into a plant with another history.
        let mut other = motion.harness();
        other.advance_to_ms(70);
        other.plant.begin_window();
        other.plant.restore(&saved).unwrap();
        prop_assert_eq!(&bytes(&other.plant), &saved.0);
        for ms in at_ms + 1..at_ms + 60 {
            harness.trot(&robot, &setup, motion.trot, ms);
            other.trot(&robot, &setup, motion.trot, ms);
            prop_assert_eq!(harness.observe(), other.observe());
        }
        prop_assert_eq!(bytes(&harness.plant), bytes(&other.plant));
    }

    #[test]
    fn observations_change_no_bit_of_the_state(motion in motions()) {
        let robot = robot();
        let setup = motion.setup();
        let mut observed = motion.harness();
        let mut unobserved = with_outputs(&robot, &setup, &|name| name == "body/rpy");
        for ms in 1..=150 {
            observed.trot(&robot, &setup, motion.trot, ms);
            unobserved.trot(&robot, &setup, motion.trot, ms);
            observed.observe();
            observed.observe();
        }
        prop_assert_eq!(bytes(&observed.plant), bytes(&unobserved.plant));
    }

    #[test]
    fn removing_a_leg_on_a_stand_changes_no_bit_of_the_others(motion in motions(), removed in 0..4_usize) {
        compare_without(motion, removed);
    }

    #[test]
    fn advancing_to_an_instant_within_a_step_is_accurate(motion in motions(), odd_us in 1..999_u64) {
        // The rig may advance to any instant; a shorter step is as accurate as a whole one.
        let mut harness = motion.harness();
        let odd = at_ms(20) + SimDuration::from_micros(odd_us);
        harness.advance_to_ms(20);
        let commands = harness.commands.clone();
        harness.plant.advance(odd, &commands).unwrap();
        harness.advance_to_ms(50);
        let mut direct = motion.harness();
        direct.advance_to_ms(50);
        let difference = harness.read("body/position")[2] - direct.read("body/position")[2];
        prop_assert!(difference.abs() < 1e-3, "{}", difference);
    }
}
