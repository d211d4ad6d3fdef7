//! Surfaces: friction by place and time.

use std::ops::Range;

use nalgebra::Vector3;
use twinrig_contact::Patch;
use twinrig_kernel::{SimDuration, SimTime, signal};
use twinrig_testing::robots::{LEGS, flat_ground, robot};

use super::{Rig, rigs, setup};

const EVERYWHERE: Range<f64> = f64::NEG_INFINITY..f64::INFINITY;

fn patch(friction: f64, extent: Range<f64>, begin_us: u64) -> Patch {
    Patch {
        friction,
        extent,
        begin: SimTime::ZERO + SimDuration::from_micros(begin_us),
        end: None,
    }
}

/// Returns friction over load of all feet together, from the present time to another.
fn ratio(rig: &mut Rig, to_us: u64) -> f64 {
    rig.plant.begin_window();
    rig.run_to(to_us);
    let force = LEGS.map(|leg| rig.vector(&signal::of_leg(leg, signal::FOOT_FORCE)));
    let force: Vector3<f64> = force.iter().sum();
    -force.x / force.z
}

/// Returns the bound of an error of friction over load: bristles of compliant constraints need a
/// part of a millimetre to follow a change.
fn bound(rig: &Rig) -> f64 {
    if rig.name.contains("Compliant") {
        2e-3
    } else {
        1e-6
    }
}

#[test]
fn friction_of_sliding_feet_changes_at_an_instant_between_steps() {
    let ground = flat_ground(0.3).with_patches(vec![patch(0.05, EVERYWHERE, 50_300)]);
    for mut rig in rigs(&robot(), &setup(&LEGS, Some(ground.unwrap()))) {
        rig.launch([1.5, 0.0, 0.0], [0.0; 3]);
        rig.run_to(20_000);
        let before = ratio(&mut rig, 50_300);
        let after = ratio(&mut rig, 90_000);
        let error = (before - 0.3).abs().max((after - 0.05).abs());
        assert!(error < bound(&rig), "{}: {before} {after}", rig.name);
    }
}

#[test]
fn robot_that_slides_onto_ice_brakes_by_its_friction() {
    // Feet are at most 0.15 m from the start, and pass 0.4 m in 0.3 s.
    let ground = flat_ground(0.1).with_patches(vec![patch(0.02, 0.3..f64::INFINITY, 0)]);
    for mut rig in rigs(&robot(), &setup(&LEGS, Some(ground.unwrap()))) {
        rig.launch([1.8, 0.0, 0.0], [0.0; 3]);
        rig.run_to(20_000);
        let before = ratio(&mut rig, 60_000);
        let feet = |rig: &mut Rig| {
            LEGS.map(|leg| rig.vector(&signal::of_leg(leg, signal::FOOT_POSITION)).x)
        };
        assert!(feet(&mut rig).iter().all(|x| *x < 0.3), "{}", rig.name);
        rig.run_to(300_000);
        assert!(feet(&mut rig).iter().all(|x| *x > 0.3), "{}", rig.name);
        let after = ratio(&mut rig, 340_000);
        let error = (before - 0.1).abs().max((after - 0.02).abs());
        assert!(error < bound(&rig), "{}: {before} {after}", rig.name);
    }
}

/// A foot that sticks by friction begins to slide when the friction goes.
#[test]
fn standing_robot_slides_away_when_its_friction_goes() {
    let ground = flat_ground(0.9).with_patches(vec![patch(0.0, EVERYWHERE, 100_000)]);
    for mut rig in rigs(&robot(), &setup(&LEGS, Some(ground.unwrap()))) {
        rig.run_to(150_000);
        let ratio = ratio(&mut rig, 200_000);
        assert!(ratio.abs() < 1e-9, "{}: {ratio}", rig.name);
    }
}

/// A patch without a difference changes nothing but the length of steps.
#[test]
fn restored_plant_continues_bit_for_bit_across_a_change() {
    let ground = || flat_ground(0.5).with_patches(vec![patch(0.1, 0.02..0.2, 30_500)]);
    let build = || rigs(&robot(), &setup(&LEGS, Some(ground().unwrap())));
    for (mut rig, mut other) in build().into_iter().zip(build()) {
        rig.launch([0.4, 0.0, 0.0], [0.0; 3]);
        rig.run_to(40_000);
        let snapshot = rig.plant.save();
        other.plant.restore(&snapshot).unwrap();
        for rig in [&mut rig, &mut other] {
            rig.run_to(120_000);
        }
        let [a, b] = [&mut rig, &mut other].map(|rig| rig.read(signal::BODY_POSITION));
        assert_eq!(a, b, "{}", rig.name);
    }
}
