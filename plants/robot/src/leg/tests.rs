//! Formulas against independent references: finite differences, round trips, closed loops, the
//! thesis.

use libm::{cos, sin};
use proptest::prelude::*;

use crate::Leg;

use crate::leg::*;

fn leg() -> Pantograph {
    Pantograph::new(&Leg::example()).unwrap()
}

/// Generates a hip angle and joints inside the stops; with more flexion, an open pantograph folds
/// the ankle flat.
fn pose_in_workspace() -> impl Strategy<Value = (f64, Joints)> {
    (-0.8..0.8_f64, -1.2..-0.01_f64, 0.01..0.99_f64).prop_map(|(q1, q2, share)| {
        let opening = share * leg().opening_stop(q2).unwrap().value;
        (
            q1,
            Joints {
                q2,
                q3: opening - q2,
            },
        )
    })
}

fn pose_at(q1: f64, joints: Joints) -> Pose {
    leg().pose_of_angles(leg().angles(q1, joints)).unwrap()
}

fn at_hip(hip: f64, foot: Planar) -> Pose {
    leg().pose(sin(hip), cos(hip), foot).unwrap()
}

proptest! {
    #[test]
    fn both_closed_forms_return_the_same_pose((q1, joints) in pose_in_workspace()) {
        let forward = pose_at(q1, joints);
        let [first, ..] = leg().angles(q1, joints);
        let back = at_hip(first, forward.foot);
        // 1e-12 m: the lengths are 0.1 m and the circles meet at more than 0.2 rad.
        prop_assert!((forward.ankle - back.ankle).norm() < 1e-12);
        prop_assert!((forward.parallel - back.parallel).abs() < 1e-12);
        let angles = back.angles();
        let round = leg().joints(angles);
        prop_assert!((round.q2 - joints.q2).abs() < 1e-11 && (round.q3 - joints.q3).abs() < 1e-11);
    }

    #[test]
    fn inverse_kinematics_reaches_foot_position(length in 0.0..1.0_f64, axis in -0.9..0.9_f64, opening in 0.0..0.6_f64) {
        let leg = leg();
        let length = leg.length_min() + length * (leg.length_max() - leg.length_min());
        let foot = Planar::new(sin(axis), -cos(axis)) * length;
        for opening in [0.0, opening] {
            let Ok(command) = leg.inverse_open(foot, opening) else { continue };
            let q2 = leg.knee_of_cable(leg.cable_length(command.knee)).unwrap();
            let reached = pose_at(command.hip, Joints { q2, q3: opening - q2 }).foot;
            // acos loses half the digits as its cosine approaches 1; 1e-12 holds because the knee
            // stays 35° from straight.
            prop_assert!((reached - foot).norm() < 1e-12, "{reached} {foot}");
            if opening == 0.0 {
                prop_assert!((leg.foot_of(command).unwrap() - foot).norm() < 1e-12);
            }
        }
    }

    #[test]
    fn lengths_agree_between_joint_space_and_pose((q1, joints) in pose_in_workspace()) {
        let (leg, pose) = (leg(), pose_at(q1, joints));
        prop_assert!((leg.diagonal_of(joints).value - pose.diagonal).abs() < 1e-15);
        prop_assert!((leg.parallel_of(joints).value - pose.parallel).abs() < 1e-15);
        prop_assert!((leg.cable_of_knee(joints.q2) - pose.cable).abs() < 1e-15);
        prop_assert!((leg.spring_energy_of(joints).value - leg.spring_energy(&pose)).abs() < 1e-14);
        prop_assert!((leg.knee_of_cable(pose.cable).unwrap() - joints.q2).abs() < 1e-12);
    }

    #[test]
    fn energy_gradient_and_hessian_match_finite_differences((_, joints) in pose_in_workspace()) {
        let leg = leg();
        let h = 1e-6;
        let at = |a: f64, b: f64| leg.spring_energy_of(Joints { q2: joints.q2 + a, q3: joints.q3 + b });
        let jet = at(0.0, 0.0);
        for (i, (a, b)) in [(h, 0.0), (0.0, h)].into_iter().enumerate() {
            let (plus, minus) = (at(a, b), at(-a, -b));
            // Central differences: h² · third derivative (≈ 100 J/rad³) + rounding 1e-16/h.
            prop_assert!(((plus.value - minus.value) / (2.0 * h) - jet.gradient[i]).abs() < 1e-8);
            for j in 0..2 {
                prop_assert!(((plus.gradient[j] - minus.gradient[j]) / (2.0 * h) - jet.hessian[i][j]).abs() < 1e-6);
            }
        }
        prop_assert_eq!(jet.hessian[0][1], jet.hessian[1][0]);
    }

    #[test]
    fn foot_gradients_match_finite_differences((q1, joints) in pose_in_workspace()) {
        let leg = leg();
        let pose = pose_at(q1, joints);
        let [hip, ..] = leg.angles(q1, joints);
        let h = 1e-7;
        let difference = |f: &dyn Fn(&Pose) -> f64| {
            let by = |dh: f64, dx: f64, dz: f64| f(&at_hip(hip + dh, pose.foot + Planar::new(dx, dz)));
            [
                (by(h, 0.0, 0.0) - by(-h, 0.0, 0.0)) / (2.0 * h),
                (by(0.0, h, 0.0) - by(0.0, -h, 0.0)) / (2.0 * h),
                (by(0.0, 0.0, h) - by(0.0, 0.0, -h)) / (2.0 * h),
            ]
        };
        let near = |gradient: Gradient, d: [f64; 3], scale: f64| {
            let error = (gradient.hip - d[0]).abs().max((gradient.foot.x - d[1]).abs()).max((gradient.foot.y - d[2]).abs());
            error < 1e-7 * scale
        };
        let d = difference(&|p| leg.spring_energy(p));
        prop_assert!(near(leg.spring_gradient(&pose), d, 100.0 / pose.ankle_sine), "{:?} {:?}", leg.spring_gradient(&pose), d);
        for length in [Length::Diagonal, Length::Parallel, Length::Cable, Length::Span] {
            let d = difference(&|p| match length {
                Length::Diagonal => p.diagonal,
                Length::Parallel => p.parallel,
                Length::Cable => p.cable,
                Length::Span => (p.foot - p.knee).norm(),
            });
            prop_assert!(near(leg.length_gradient(&pose, length), d, 10.0 / pose.ankle_sine), "{length:?}");
        }
    }

    #[test]
    fn rates_and_curvatures_match_finite_differences(
        (q1, joints) in pose_in_workspace(), hip_rate in -5.0..5.0_f64, vx in -1.0..1.0_f64, vz in -1.0..1.0_f64,
    ) {
        let leg = leg();
        let pose = pose_at(q1, joints);
        // Closer to the straight pose, the higher derivatives exceed the resolution of differences
        // of this step.
        prop_assume!(pose.ankle_sine > 0.2);
        let [hip, ..] = leg.angles(q1, joints);
        let v = Planar::new(vx, vz);
        let velocity = leg.velocity(&pose, hip_rate, v);
        let h = 1e-5;
        let at = |t: f64| at_hip(hip + hip_rate * t, pose.foot + v * t);
        for length in [Length::Diagonal, Length::Parallel, Length::Cable, Length::Span] {
            let value = |p: Pose| match length {
                Length::Diagonal => p.diagonal,
                Length::Parallel => p.parallel,
                Length::Cable => p.cable,
                Length::Span => (p.foot - p.knee).norm(),
            };
            let rate = (value(at(h)) - value(at(-h))) / (2.0 * h);
            let curvature = (value(at(h)) - 2.0 * value(at(0.0)) + value(at(-h))) / (h * h);
            let scale = 1.0 / pose.ankle_sine;
            prop_assert!((rate - leg.length_rate(&pose, &velocity, length)).abs() < 1e-6 * libm::pow(scale, 3.0));
            // Second differences have errors of 1e-17/h² (rounding) and h² (truncation).
            prop_assert!(
                (curvature - leg.length_curvature(&pose, &velocity, length)).abs() < 1e-4 * libm::pow(scale, 5.0),
                "{length:?} {curvature} {}", leg.length_curvature(&pose, &velocity, length)
            );
            let gradient = leg.length_gradient(&pose, length);
            let by_gradient = gradient.hip * hip_rate + gradient.foot.dot(&v);
            prop_assert!((by_gradient - leg.length_rate(&pose, &velocity, length)).abs() < 1e-12 * scale * scale);
        }
        let angles = |t: f64| at(t).angles();
        for (i, omega) in velocity.omega.into_iter().enumerate() {
            prop_assert!(((angles(h)[i] - angles(-h)[i]) / (2.0 * h) - omega).abs() < 1e-5 * scale_of(&pose));
        }
        // The power of segment torques is invariant under the pull-back.
        let torques = [0.3, -0.2, 0.1];
        let gradient = leg.torque_gradient(&pose, torques);
        let power: f64 = torques.iter().zip(velocity.omega).map(|(t, w)| t * w).sum();
        prop_assert!((gradient.hip * hip_rate + gradient.foot.dot(&v) - power).abs() < 1e-10 * scale_of(&pose));
    }

    #[test]
    fn opening_stop_is_at_greatest_rod_length(q2 in -1.2..-0.01_f64) {
        let leg = leg();
        let stop = leg.opening_stop(q2).unwrap();
        let rod = leg.parallel_of(Joints { q2, q3: stop.value - q2 }).value;
        prop_assert!((rod - 0.0814).abs() < 1e-12);
        let h = 1e-5;
        let b = |d: f64| leg.opening_stop(q2 + d).unwrap();
        prop_assert!(((b(h).value - b(-h).value) / (2.0 * h) - stop.slope).abs() < 1e-6);
        prop_assert!(((b(h).slope - b(-h).slope) / (2.0 * h) - stop.curvature).abs() < 1e-4);
    }

    #[test]
    fn arbitrary_foot_gives_pose_or_typed_error(hip in -4.0..4.0_f64, x in -0.3..0.3_f64, z in -0.3..0.3_f64) {
        let foot = Planar::new(x, z);
        if let Ok(pose) = leg().pose(sin(hip), cos(hip), foot) {
            prop_assert!(leg().spring_energy(&pose).is_finite());
            prop_assert!(leg().spring_gradient(&pose).foot.norm().is_finite());
        }
        let _ = leg().inverse_closed(foot).map(|c| assert!(c.hip.is_finite() && c.knee.is_finite()));
        let near = leg().nearest_reachable(foot);
        prop_assert!(leg().inverse_closed(near).is_ok(), "{near}");
    }

    #[test]
    fn nearest_command_is_that_of_the_foot_or_of_the_nearest_point(x in -0.3..0.3_f64, z in -0.3..0.3_f64) {
        let foot = Planar::new(x, z);
        let closed = leg().inverse_closed(foot);
        let (command, beyond) = leg().inverse_nearest(foot);
        prop_assert_eq!(beyond > 0.0, closed.is_err());
        let range = [leg().length_min(), leg().length_max()];
        let length = foot.norm();
        let expected = (length - length.clamp(range[0], range[1])).abs();
        prop_assert!((beyond - expected).abs() < 1e-9, "{}, {}", beyond, expected);
        let nearest = || leg().inverse_closed(leg().nearest_reachable(foot)).unwrap();
        prop_assert_eq!(command, closed.unwrap_or_else(|_| nearest()));
    }

    #[test]
    fn cable_lever_is_minus_derivative_of_cable_length(q2 in -1.5..-0.05_f64) {
        let h = 1e-6;
        let slope = (leg().cable_of_knee(q2 + h) - leg().cable_of_knee(q2 - h)) / (2.0 * h);
        prop_assert!((leg().cable_lever(q2) + slope).abs() < 1e-9);
    }
}

fn scale_of(pose: &Pose) -> f64 {
    1.0 / libm::pow(pose.ankle_sine, 3.0)
}

#[test]
fn closed_loop_in_joint_space_does_no_work() {
    // Trapezoidal sum around a circle of 0.2 rad, well inside the stops; it converges spectrally on
    // a periodic integrand.
    let leg = leg();
    let n = 400;
    let mut work = 0.0;
    for i in 0..n {
        let a = core::f64::consts::TAU * f64::from(i) / f64::from(n);
        let joints = Joints {
            q2: -0.6 + 0.2 * cos(a),
            q3: 0.9 + 0.2 * sin(a),
        };
        let g = leg.spring_energy_of(joints).gradient;
        work +=
            (-0.2 * sin(a) * g[0] + 0.2 * cos(a) * g[1]) * core::f64::consts::TAU / f64::from(n);
    }
    assert!(work.abs() < 1e-12, "{work}");
}

#[test]
fn omitting_parallel_spring_torque_on_knee_breaks_energy_conservation() {
    // The omission of the thesis (A.25) makes the force field above non-conservative. This verifies
    // the sensitivity of the test.
    let leg = leg();
    let mut without_parallel = Leg::example();
    without_parallel.parallel.stiffness = 1e-9;
    let without_parallel = Pantograph::new(&without_parallel).unwrap();
    let n = 400;
    let mut work = 0.0;
    for i in 0..n {
        let a = core::f64::consts::TAU * f64::from(i) / f64::from(n);
        let joints = Joints {
            q2: -0.6 + 0.2 * cos(a),
            q3: 0.9 + 0.2 * sin(a),
        };
        let (full, truncated) = (
            leg.spring_energy_of(joints).gradient,
            without_parallel.spring_energy_of(joints).gradient,
        );
        work += (-0.2 * sin(a) * truncated[0] + 0.2 * cos(a) * full[1]) * core::f64::consts::TAU
            / f64::from(n);
    }
    assert!(work.abs() > 1e-3, "{work}");
}

#[test]
fn axial_force_is_negative_slope_of_minimum_energy() {
    let leg = leg();
    let h = 1e-5;
    for (length, torque) in [
        (0.105, 0.0),
        (0.12, 0.0),
        (0.135, 0.0),
        (0.1475, 0.0),
        (0.10, 0.0),
    ] {
        let energy = |l: f64| leg.equilibrium(l, torque, f64::INFINITY).unwrap().energy;
        let slope = (energy(length + h) - energy(length - h)) / (2.0 * h);
        let at = leg.equilibrium(length, torque, f64::INFINITY).unwrap();
        assert!(
            (at.axial + slope).abs() < 1e-4,
            "{length}: {} {slope}",
            at.axial
        );
        assert!(at.transverse.abs() < 1e-6);
    }
}

#[test]
fn hip_torque_gives_transverse_force_torque_over_length() {
    let leg = leg();
    let free = leg.equilibrium(0.14, 0.0, f64::INFINITY).unwrap();
    let loaded = leg.equilibrium(0.14, 0.1, f64::INFINITY).unwrap();
    assert!(
        (loaded.transverse * 0.14 + 0.1).abs() < 1e-9
            || (loaded.transverse * 0.14 - 0.1).abs() < 1e-9,
        "{loaded:?}"
    );
    assert!((loaded.axial - free.axial).abs() > 0.1);
}

#[test]
fn taut_cable_reduces_axial_force() {
    let leg = leg();
    let slack = leg.equilibrium(0.12, 0.0, f64::INFINITY).unwrap();
    assert_eq!(slack.active_stop, None);
    let short = leg.cable_of_knee(slack.joints.q2) - 0.0005;
    let taut = leg.equilibrium(0.12, 0.0, short).unwrap();
    let Some((Stop::Cable, tension)) = taut.active_stop else {
        panic!("{taut:?}")
    };
    assert!(tension > 0.0 && taut.axial < slack.axial);
}

#[test]
fn invalid_legs_and_poses_are_typed_errors() {
    let leg = leg();
    assert!(matches!(
        leg.inverse_closed(Planar::new(0.0, -0.2)),
        Err(LegError::OutOfReach { .. })
    ));
    assert!(matches!(
        leg.inverse_closed(Planar::new(f64::NAN, -0.1)),
        Err(LegError::NotFinite { .. })
    ));
    for cable in [0.5, 0.0, -0.1, f64::NAN] {
        assert!(matches!(
            leg.knee_of_cable(cable),
            Err(LegError::NoAngle { .. })
        ));
    }
    assert!(matches!(
        leg.pose(0.0, 1.0, Planar::new(0.0, -0.2)),
        Err(LegError::NoTriangle { .. })
    ));
    assert!(matches!(
        leg.pose_of_angles([0.1, -0.2, -0.2]),
        Err(LegError::Straight { .. })
    ));
    for invalidate in [
        |l: &mut crate::Leg| l.l1 = -1.0,
        |l: &mut crate::Leg| l.l_delta = 0.06,
        |l: &mut crate::Leg| l.diagonal_min = 0.2,
        |l: &mut crate::Leg| l.parallel_travel = 0.1,
        |l: &mut crate::Leg| l.q2_ref = f64::NAN,
    ] {
        let mut invalid = Leg::example();
        invalidate(&mut invalid);
        assert!(matches!(
            Pantograph::new(&invalid),
            Err(LegError::Geometry { .. })
        ));
    }
}

#[test]
fn table_error_bound_holds_and_converges_with_cells() {
    let leg = leg();
    let (coarse, fine) = (
        EnergyTable::new(&leg, 48).unwrap(),
        EnergyTable::new(&leg, 96).unwrap(),
    );
    // Fourth order in the energy, third in the force.
    assert!(
        fine.error().energy < coarse.error().energy / 10.0,
        "{:?} {:?}",
        coarse.error(),
        fine.error()
    );
    assert!(fine.error().force < coarse.error().force / 5.0);
    let joints = Joints { q2: -0.5, q3: 0.8 };
    let pose = pose_at(0.3, joints);
    let hip = leg.angles(0.3, joints)[0];
    let (energy, gradient) = fine.look_up(sin(hip), cos(hip), pose.foot).unwrap();
    let exact = leg.spring_gradient(&pose);
    assert!((energy - leg.spring_energy(&pose)).abs() <= fine.error().energy);
    assert!((gradient.foot - exact.foot).norm() <= fine.error().force);
    assert!((gradient.hip - exact.hip).abs() <= fine.error().torque);
    assert!(
        fine.error().force < 1e-2 && fine.error().energy < 1e-6,
        "{:?}",
        fine.error()
    );
}

#[test]
fn linear_forces_are_of_second_order() {
    let cubic = EnergyTable::new(&leg(), 96).unwrap();
    let tables = [48, 96].map(|cells| EnergyTable::new(&leg(), cells).unwrap());
    let [coarse, fine] = tables.map(|table| table.with_linear_forces().unwrap().error());
    let ratio = coarse.force / fine.force;
    assert!((3.0..5.0).contains(&ratio), "{ratio}");
    assert!(fine.force > 2.0 * cubic.error().force && fine.energy == cubic.error().energy);
}
