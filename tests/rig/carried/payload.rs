//! Payloads: one rigid body with the trunk.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use twinrig_kernel::signal;
use twinrig_robot::{GRAVITY, PointMass, Robot};
use twinrig_testing::robots::{LEGS, LoadedTrunk, flat_ground, robot};

use super::{rigs, setup};

fn loaded(payloads: &[(f64, [f64; 3])]) -> Robot {
    let mut robot = robot();
    let point = |&(mass, at): &(f64, [f64; 3])| PointMass { mass, at };
    robot.trunk.payloads = payloads.iter().map(point).collect();
    robot
}

/// Without moment and products of inertia, payloads are a heavier trunk.
#[test]
fn symmetric_payloads_equal_a_heavier_trunk() {
    let (mass, [x, y, z]) = (0.05, [0.06, 0.04, 0.03]);
    let arms = [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]];
    let pairs = arms.iter().flat_map(|arm| [*arm, arm.map(|a| -a)]);
    let payloads: Vec<_> = pairs.map(|at| (mass, at)).collect();
    let mut heavier = robot();
    heavier.trunk.mass += 6.0 * mass;
    let squares = [y * y + z * z, x * x + z * z, x * x + y * y];
    for (moment, square) in heavier.trunk.inertia.iter_mut().zip(squares) {
        *moment += 2.0 * mass * square;
    }
    let setup = setup(&LEGS, Some(flat_ground(0.6)));
    let plain = rigs(&heavier, &setup).into_iter();
    for (mut a, mut b) in rigs(&loaded(&payloads), &setup).into_iter().zip(plain) {
        for rig in [&mut a, &mut b] {
            rig.launch([0.3, 0.1, 0.5], [1.0, -0.5, 0.8]);
            rig.run_to(80_000);
        }
        let [p, q] = [&mut a, &mut b].map(|rig| rig.vector(signal::BODY_POSITION));
        assert!((p - q).norm() < 1e-9, "{}: {p} {q}", a.name);
    }
}

/// Attitude and centre of mass of a free rigid body, by the conserved angular momentum: θ̇ is
/// computed in world axes, by R J⁻¹ Rᵀ L, where the plants have Euler's equations in body axes.
fn attitude_after(
    seconds: f64,
    inertia: &Matrix3<f64>,
    turning: Vector3<f64>,
) -> UnitQuaternion<f64> {
    let momentum = inertia * turning;
    let inverse = inertia.try_inverse().unwrap();
    let rate = |q: &Quaternion<f64>| {
        let turn = UnitQuaternion::new_normalize(*q);
        let omega = turn * (inverse * (turn.inverse() * momentum));
        Quaternion::from_imag(omega) * q * 0.5
    };
    let (mut q, steps) = (Quaternion::identity(), 4000);
    let h = seconds / f64::from(steps);
    for _ in 0..steps {
        let a = rate(&q);
        let b = rate(&(q + a * (0.5 * h)));
        let c = rate(&(q + b * (0.5 * h)));
        let d = rate(&(q + c * h));
        q += (a + (b + c) * 2.0 + d) * (h / 6.0);
    }
    UnitQuaternion::new_normalize(q)
}

#[test]
fn trunk_and_payload_tumble_by_eulers_equations() {
    let loaded = LoadedTrunk::new(0.4, Vector3::new(0.08, -0.05, 0.03));
    let (centre, inertia) = (loaded.centre, loaded.inertia);
    let (velocity, turning) = (Vector3::new(0.3, -0.2, 1.0), Vector3::new(4.0, 7.0, -5.0));
    let seconds = 0.2;
    let turn = attitude_after(seconds, &inertia, turning);
    for mut rig in rigs(&loaded.robot, &setup(&[], None)) {
        let start = rig.vector(signal::BODY_POSITION);
        rig.launch(velocity.into(), turning.into());
        rig.run_to(200_000);
        let of_centre = start + centre + (velocity + turning.cross(&centre)) * seconds
            - Vector3::z() * (0.5 * GRAVITY * seconds * seconds);
        let expected = of_centre - turn * centre;
        let (place, [w, x, y, z]) = (
            rig.vector(signal::BODY_POSITION),
            rig.read(signal::BODY_ORIENTATION).try_into().unwrap(),
        );
        let found = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
        let angle = found.angle_to(&turn);
        let distance = (place - expected).norm();
        // Fixed-step methods have second order.
        let bound = if rig.name.ends_with("Moreau") || rig.name == "massless Rigid" {
            1e-4
        } else {
            1e-6
        };
        assert!(angle < bound, "{}: {angle} rad", rig.name);
        assert!(distance < 0.1 * bound, "{}: {distance} m", rig.name);
        let balance = rig.plant.energy();
        let share = balance.residual.abs() / balance.kinetic;
        assert!(share < bound, "{}: {balance:?}", rig.name);
    }
}

/// The difference that a payload makes to the loads of a standing robot has the payload's weight
/// and its moment about each axis. The legs yield, by less than a millimetre.
#[test]
fn standing_legs_bear_a_payload_by_the_lever_rule() {
    let (load, at) = (0.1, [0.04, -0.02, 0.03]);
    let setup = setup(&LEGS, Some(flat_ground(0.6)));
    let plain = rigs(&robot(), &setup).into_iter();
    for (with, without) in rigs(&loaded(&[(load, at)]), &setup).into_iter().zip(plain) {
        let name = with.name.clone();
        let [loaded, plain] = [with, without].map(|mut rig| {
            rig.run_to(2_000_000);
            rig.plant.begin_window();
            rig.run_to(3_000_000);
            let body = rig.vector(signal::BODY_POSITION);
            let mut sums = [0.0; 3];
            for leg in LEGS {
                let force = rig.vector(&signal::of_leg(leg, signal::FOOT_FORCE)).z;
                let foot = rig.vector(&signal::of_leg(leg, signal::FOOT_POSITION));
                let arm = foot - body;
                let parts = [force, arm.x * force, arm.y * force];
                sums.iter_mut()
                    .zip(parts)
                    .for_each(|(sum, part)| *sum += part);
            }
            sums
        });
        let weight = load * GRAVITY;
        let expected = [weight, weight * at[0], weight * at[1]];
        for (k, bound) in [1e-3, 2e-3, 2e-3].into_iter().enumerate() {
            let found = loaded[k] - plain[k];
            assert!(
                (found - expected[k]).abs() < bound * weight,
                "{name}: {k} {found} {expected:?}"
            );
        }
    }
}

/// Stored energy and equations of motion come from different formulas.
#[test]
fn energy_balance_of_a_dropped_robot_closes_with_payload() {
    let robot = loaded(&[(0.2, [-0.08, 0.03, 0.04]), (0.1, [0.1, 0.02, -0.01])]);
    for mut rig in rigs(&robot, &setup(&LEGS, Some(flat_ground(0.6)))) {
        rig.launch([0.2, 0.1, 0.8], [2.0, -1.0, 3.0]);
        rig.run_to(300_000);
        let balance = rig.plant.energy();
        let share = balance.residual.abs() / balance.exchanged;
        assert!(share < 1e-3, "{}: {balance:?}", rig.name);
    }
}
