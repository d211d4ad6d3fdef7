//! The same run twice, and a run that goes on from where it was saved, are the same bit for bit.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_rapier::Joints;
use twinrig_runtime::Plant;

use crate::scene::{Scene, robot, standing};

/// Marches on the spot: feet land, cables slacken and tighten, stops are met.
fn march(scene: &mut Scene, first: &[f64], from_ms: u64, to_ms: u64) -> Vec<Vec<f64>> {
    let mut seen = Vec::new();
    for ms in (from_ms + 2..=to_ms).step_by(2) {
        let phase = 22.0 * 1e-3 * ms as f64;
        for (k, command) in scene.commands.iter_mut().enumerate() {
            let leg = k / 2;
            let way = if leg == 0 || leg == 3 { 1.0 } else { -1.0 };
            let swing = way * libm::sin(phase);
            *command = first[k]
                + if k % 2 == 0 {
                    0.15 * swing
                } else {
                    0.3 * swing.max(0.0)
                };
        }
        scene.run_to_us(1000 * ms);
        seen.push(scene.all());
    }
    seen
}

#[test]
fn two_runs_are_the_same() {
    for joints in Joints::ALL {
        let run = || {
            let mut scene = Scene::of(&robot(), standing(2000), joints);
            let first = scene.commands.clone();
            march(&mut scene, &first, 0, 600)
        };
        assert_eq!(run(), run(), "{joints:?}");
    }
}

#[test]
fn a_run_goes_on_from_where_it_was_saved_bit_for_bit() {
    for joints in Joints::ALL {
        let mut scene = Scene::of(&robot(), standing(2000), joints);
        let first = scene.commands.clone();
        let mut now = 0;
        // Feet in the air, on the ground, and in between.
        for at in [100, 154, 208, 262, 316] {
            march(&mut scene, &first, now, at);
            let saved = scene.plant.save();
            let mut other = Scene::of(&robot(), standing(2000), joints);
            other.plant.restore(&saved).unwrap();
            assert_eq!(other.plant.save(), saved, "{joints:?} at {at} ms");
            let expected = march(&mut scene, &first, at, at + 100);
            other.now_us = 1000 * at;
            let found = march(&mut other, &first, at, at + 100);
            let apart = expected.iter().zip(&found).position(|(a, b)| a != b);
            assert_eq!(
                apart, None,
                "{joints:?}: after {at} ms, that many steps are the same"
            );
            scene.plant.restore(&saved).unwrap();
            (scene.now_us, now) = (1000 * at, at);
        }
    }
}

#[test]
fn a_snapshot_of_another_robot_is_refused() {
    let mut four = Scene::of(&robot(), standing(2000), Joints::Impulse);
    let mut setup = standing(2000);
    setup.legs.truncate(2);
    let two = Scene::of(&robot(), setup, Joints::Impulse);
    assert!(four.plant.restore(&two.plant.save()).is_err());
}

#[test]
fn a_state_that_is_taken_over_is_where_it_was() {
    for joints in Joints::ALL {
        let mut scene = Scene::of(&robot(), standing(2000), joints);
        let first = scene.commands.clone();
        march(&mut scene, &first, 0, 240);
        let state = scene.plant.state().unwrap();
        let mut other = Scene::of(&robot(), standing(2000), joints);
        let missing = other.plant.resume_from(&state).unwrap();
        assert!(missing.is_empty(), "{missing:?}");
        let again = other.plant.state().unwrap();
        assert_eq!(again.time, SimTime::ZERO + SimDuration::from_millis(240));
        for ((name, was), (_, is)) in state.iter().zip(again.iter()) {
            for (was, is) in was.iter().zip(is) {
                // Joints that were apart are put together: angles alone say where the bodies are.
                assert!((was - is).abs() < 1e-9, "{joints:?}, {name}: {was} {is}");
            }
        }
        assert_eq!(other.plant.energy().residual, 0.0);
    }
}
