//! Repeated runs, and runs continued from a snapshot, agree bit for bit.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_rapier::Joints;
use twinrig_runtime::Plant;
use twinrig_testing::robots::robot;

use crate::fixture::{Fixture, standing, with_joints};

/// Marches on the spot: feet land, cables become slack and taut, stops are reached.
fn march(fixture: &mut Fixture, first: &[f64], from_ms: u64, to_ms: u64) -> Vec<Vec<f64>> {
    let mut outputs = Vec::new();
    for ms in (from_ms + 2..=to_ms).step_by(2) {
        let phase = 22.0 * 1e-3 * ms as f64;
        for (k, command) in fixture.commands.iter_mut().enumerate() {
            let leg = k / 2;
            let sign = if leg == 0 || leg == 3 { 1.0 } else { -1.0 };
            let swing = sign * libm::sin(phase);
            *command = first[k]
                + if k % 2 == 0 {
                    0.15 * swing
                } else {
                    0.3 * swing.max(0.0)
                };
        }
        fixture.advance_to_us(1000 * ms);
        outputs.push(fixture.observe().to_vec());
    }
    outputs
}

#[test]
fn repeated_runs_are_identical() {
    for joints in Joints::ALL {
        let run = || {
            let mut fixture = with_joints(&robot(), standing(2000), joints);
            let first = fixture.commands.clone();
            march(&mut fixture, &first, 0, 600)
        };
        assert_eq!(run(), run(), "{joints:?}");
    }
}

#[test]
fn restored_plant_continues_bit_for_bit() {
    for joints in Joints::ALL {
        let mut fixture = with_joints(&robot(), standing(2000), joints);
        let first = fixture.commands.clone();
        let mut now = 0;
        // Feet in the air, on the ground, and in transition.
        for at in [100, 154, 208, 262, 316] {
            march(&mut fixture, &first, now, at);
            let saved = fixture.plant.save();
            let mut other = with_joints(&robot(), standing(2000), joints);
            other.plant.restore(&saved).unwrap();
            assert_eq!(other.plant.save(), saved, "{joints:?} at {at} ms");
            let expected = march(&mut fixture, &first, at, at + 100);
            other.now_us = 1000 * at;
            let found = march(&mut other, &first, at, at + 100);
            let difference = expected.iter().zip(&found).position(|(a, b)| a != b);
            assert_eq!(
                difference, None,
                "{joints:?}: index of the first difference after {at} ms"
            );
            fixture.plant.restore(&saved).unwrap();
            (fixture.now_us, now) = (1000 * at, at);
        }
    }
}

#[test]
fn snapshot_of_another_robot_is_refused() {
    let mut four = with_joints(&robot(), standing(2000), Joints::Impulse);
    let mut setup = standing(2000);
    setup.legs.truncate(2);
    let two = with_joints(&robot(), setup, Joints::Impulse);
    assert!(four.plant.restore(&two.plant.save()).is_err());
}

#[test]
fn resumed_state_is_preserved() {
    for joints in Joints::ALL {
        let mut fixture = with_joints(&robot(), standing(2000), joints);
        let first = fixture.commands.clone();
        march(&mut fixture, &first, 0, 240);
        let state = fixture.plant.state().unwrap();
        let mut other = with_joints(&robot(), standing(2000), joints);
        let missing = other.plant.resume_from(&state).unwrap();
        assert!(missing.is_empty(), "{missing:?}");
        let again = other.plant.state().unwrap();
        assert_eq!(again.time, SimTime::ZERO + SimDuration::from_millis(240));
        for ((name, was), (_, is)) in state.iter().zip(again.iter()) {
            for (was, is) in was.iter().zip(is) {
                // Joint gaps are closed: the bodies follow from the angles alone.
                assert!((was - is).abs() < 1e-9, "{joints:?}, {name}: {was} {is}");
            }
        }
        assert_eq!(other.plant.energy().residual, 0.0);
    }
}
