//! Places and angles that the plant reports, against forward kinematics.

use nalgebra::{Rotation3, Vector3};
use twinrig_kernel::SimDuration;
use twinrig_legged::{Base, Drives, Setup};
use twinrig_testing::robots::{LEGS, pose, robot, suspended};

use super::harness::{Harness, massless, setup};

fn vector(harness: &mut Harness, signal: &str) -> Vector3<f64> {
    Vector3::from_column_slice(&harness.read(signal))
}

/// Every foot is where trunk, hips and angles put it, whichever legs there are: the trunk is that
/// of the robot file, not the body that it makes with the hips' masses.
#[test]
fn trunk_and_feet_of_any_subset_of_legs_agree() {
    let robot = robot();
    for subset in 1..1_u32 << LEGS.len() {
        let legs = (0..LEGS.len()).filter(|leg| subset >> leg & 1 == 1);
        let legs: Vec<String> = legs.map(|leg| LEGS[leg].to_owned()).collect();
        let setup = Setup {
            ground: None,
            step: SimDuration::from_micros(250),
            start: pose([20.0, -30.0, 30.0], [3.0, -5.0, 8.0]),
            legs: legs.clone(),
            ..setup()
        };
        let mut harness = massless(&robot, &setup);
        let start = vector(&mut harness, "body/position");
        assert!(start.xy().norm() < 1e-15, "{legs:?}: {start:?}");
        let mut errors = Vec::new();
        for us in (1000..=60_000).step_by(1000) {
            harness.advance_to_us(us - 250);
            let before = vector(&mut harness, "body/position");
            harness.advance_to_us(us);
            let trunk = vector(&mut harness, "body/position");
            let velocity = vector(&mut harness, "body/velocity");
            let rpy = vector(&mut harness, "body/rpy");
            let rotation = Rotation3::from_euler_angles(rpy.x, rpy.y, rpy.z);
            for name in &legs {
                let mount = robot.legs.iter().find(|mount| mount.name == *name).unwrap();
                let leg = &mount.leg;
                let angles = harness.read(&format!("leg/{name}/angles"));
                let mut foot = Vector3::from(mount.hip);
                let lengths = [leg.l1, leg.l2, leg.l3 - leg.l_delta];
                for (length, angle) in lengths.into_iter().zip(angles) {
                    foot += length * Vector3::new(libm::sin(angle), 0.0, -libm::cos(angle));
                }
                let found = vector(&mut harness, &format!("leg/{name}/foot/position"));
                // Rounding of lengths by two formulas.
                let error = (trunk + rotation * foot - found).norm();
                assert!(error < 1e-12, "{legs:?} at {us} µs: {error:e} m");
            }
            harness.advance_to_us(us + 250);
            let after = vector(&mut harness, "body/position");
            errors.push(((after - before) / 500e-6 - velocity).norm());
        }
        // But for impacts, the third derivative is below 1e4 m/s³: h²/6 of it is 1e-4 m/s. The
        // common centre of trunk and hips has other velocities, by millimetres a second.
        errors.sort_by(f64::total_cmp);
        let error = errors[errors.len() * 3 / 4];
        assert!(error < 2e-4, "{legs:?}: {error:e} m/s");
    }
}

#[test]
fn angles_of_a_leg_that_turns_over_are_continuous() {
    // A free hip with the speed for several turns.
    let start = pose([0.0, -40.0, 40.0], [60.0, 60.0, 60.0]);
    let setup = suspended(&["LF"], start, 250);
    assert_eq!((&setup.drives, setup.base), (&Drives::None, Base::Fixed));
    let mut harness = massless(&robot(), &setup);
    let mut before = harness.read("leg/LF/angles");
    let start = before.clone();
    for ms in 1..=400 {
        harness.advance_to_ms(ms);
        let angles = harness.read("leg/LF/angles");
        for (angle, before) in angles.iter().zip(&before) {
            // At 100 rad/s it turns by a tenth of a radian.
            assert!((angle - before).abs() < 0.5, "{ms} ms: {before} to {angle}");
        }
        before = angles;
    }
    let turned = before
        .iter()
        .zip(&start)
        .map(|(now, then)| (now - then).abs());
    let turned: Vec<f64> = turned.collect();
    assert!(turned.iter().all(|turned| *turned > 7.0), "{turned:?}");
}
