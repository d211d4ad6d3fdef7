//! What must hold of any motion.

use proptest::prelude::*;
use twinrig_contact::{Ground, Terrain};
use twinrig_kernel::SimDuration;
use twinrig_leg::{Pantograph, Stop};
use twinrig_legged::{Base, Drives, Setup};
use twinrig_massless::Massless;
use twinrig_runtime::Plant;

use crate::scene::{SERVO, Scene, Trot, at, robot, setup};

const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];

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
        setup.start = self.trot.commands(&robot(), &setup, 0.0).into();
        setup
    }

    fn scene(&self) -> Scene {
        Scene::new(&robot(), &self.setup())
    }
}

/// What the contact solver leaves \[N\]: 1e-6 of the greatest approach, and 5 m/s of 30 g in 1 ms are 150 N.
const LEFT: f64 = 1.5e-4;

/// What may be read of every leg after a step of a millisecond.
fn check_limits(scene: &mut Scene, motion: &Motion, leg: &Pantograph) -> Result<(), TestCaseError> {
    for name in LEGS {
        let read =
            |scene: &mut Scene, what: &str| scene.read(&format!("leg/{name}/{what}")).to_vec();
        let [tension] = read(scene, "cable/tension")[..] else {
            unreachable!()
        };
        prop_assert!(tension >= 0.0);
        let torques = [read(scene, "hip/torque")[0], read(scene, "knee/torque")[0]];
        for torque in torques {
            // The drive's limit is part of the step's problem: rounding only.
            prop_assert!(
                torque.abs() <= motion.torque + 1e-9,
                "{torque} of {}",
                motion.torque
            );
        }
        let force = read(scene, "foot/force");
        let sideways = libm::hypot(force[0], force[1]);
        prop_assert!(force[2] >= -LEFT, "{force:?}");
        let most = motion.friction * force[2];
        prop_assert!(
            sideways <= most * (1.0 + 1e-9) + LEFT,
            "{force:?}: {}",
            sideways - most
        );
        // How far a foot goes below the ground, or a rod beyond its stop, in a step: it arrives with its speed and is
        // stopped by the end of the step, so half a step at the speed it arrives with; the feet here reach 5 m/s.
        let gap = read(scene, "foot/clearance")[0];
        prop_assert!(gap >= -0.5 * 5.0 * 1e-3, "{gap}");
        let angles = read(scene, "angles");
        let pose = leg
            .pose_of_angles([angles[0], angles[1], angles[2]])
            .unwrap();
        let cable = leg.cable_length(read(scene, "knee/position")[0]);
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

/// Bits of a plant's state and counters.
fn bytes(plant: &Massless) -> Vec<u8> {
    plant.save().0
}

/// Runs a motion on a stand with all legs and with one taken out.
fn compare_without(motion: Motion, gone: usize) {
    let robot = robot();
    let motion = Motion {
        base: Base::Fixed,
        ..motion
    };
    let setup = motion.setup();
    let there = LEGS.iter().filter(|leg| **leg != LEGS[gone]);
    let fewer = Setup {
        legs: there.map(|leg| (*leg).to_owned()).collect(),
        ..setup.clone()
    };
    let mut all = Scene::new(&robot, &setup);
    let mut some = Scene::new(&robot, &fewer);
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
fn legs_on_a_stand_that_stall_and_slip_on_ice_do_not_feel_each_other() {
    // One that a contact problem common to all legs does not pass.
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
    fn forces_stay_within_what_cables_ground_and_drives_can_do(motion in motions()) {
        let robot = robot();
        let setup = motion.setup();
        let leg = Pantograph::new(&robot.legs[0].leg).unwrap();
        let mut scene = motion.scene();
        for ms in 1..=200 {
            scene.trot(&robot, &setup, motion.trot, ms);
            check_limits(&mut scene, &motion, &leg)?;
            scene.plant.begin_window();
        }
        let balance = scene.energy();
        prop_assert!(balance.dissipated >= 0.0);
        prop_assert!(balance.residual.abs() < 1e-4 * balance.exchanged + 1e-9, "{:?}", balance);
    }

    #[test]
    fn a_restored_plant_goes_on_bit_for_bit(motion in motions(), at_ms in 1..150_u64) {
        let robot = robot();
        let setup = motion.setup();
        let mut scene = motion.scene();
        for ms in 1..=at_ms {
            scene.trot(&robot, &setup, motion.trot, ms);
        }
        let saved = scene.plant.save();
        // Into a plant that has been elsewhere meanwhile.
        let mut other = motion.scene();
        other.to(70);
        other.plant.begin_window();
        other.plant.restore(&saved).unwrap();
        prop_assert_eq!(&bytes(&other.plant), &saved.0);
        for ms in at_ms + 1..at_ms + 60 {
            scene.trot(&robot, &setup, motion.trot, ms);
            other.trot(&robot, &setup, motion.trot, ms);
            prop_assert_eq!(scene.observe(), other.observe());
        }
        prop_assert_eq!(bytes(&scene.plant), bytes(&other.plant));
    }

    #[test]
    fn what_is_looked_at_and_how_often_changes_no_bit(motion in motions()) {
        let robot = robot();
        let setup = motion.setup();
        let mut seen = motion.scene();
        let mut unseen = Scene::wanting(&robot, &setup, &|name| name == "body/rpy");
        for ms in 1..=150 {
            seen.trot(&robot, &setup, motion.trot, ms);
            unseen.trot(&robot, &setup, motion.trot, ms);
            seen.observe();
            seen.observe();
        }
        prop_assert_eq!(bytes(&seen.plant), bytes(&unseen.plant));
    }

    #[test]
    fn a_leg_that_is_left_out_of_a_stand_changes_no_bit_of_the_others(motion in motions(), gone in 0..4_usize) {
        compare_without(motion, gone);
    }

    #[test]
    fn an_instant_within_a_step_can_be_visited(motion in motions(), odd_us in 1..999_u64) {
        // The rig may ask for any instant; a shorter step is as good as a whole one.
        let mut scene = motion.scene();
        let odd = at(20) + SimDuration::from_micros(odd_us);
        scene.to(20);
        let commands = scene.commands.clone();
        scene.plant.advance(odd, &commands).unwrap();
        scene.to(50);
        let mut straight = motion.scene();
        straight.to(50);
        let apart = scene.read("body/position")[2] - straight.read("body/position")[2];
        prop_assert!(apart.abs() < 1e-3, "{}", apart);
    }
}
