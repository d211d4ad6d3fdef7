use nalgebra::{SMatrix, SVector, Vector3};
use proptest::prelude::*;
use twinrig_kernel::SimDuration;
use twinrig_legged::{Abduction, Base, Contacts, Drives, LEGS, SetPoint, Setup, Start};
use twinrig_robot::leg::Planar;
use twinrig_robot::{JointFriction, RobotFile};

use super::Damping;
use crate::midpoint::Midpoint;
use crate::mobility::Mobility;
use crate::model::{Force, Model, Options};
use crate::motion::Motion;
use crate::rows::Row;
use crate::state::State;

const ALL: usize = 6 + 3 * LEGS;

fn model(base: Base, friction: f64) -> Model {
    let text = include_str!("../../../../robots/cheetah-cub.toml");
    let file = RobotFile::parse("cheetah-cub.toml", text).unwrap();
    let mut robot = file.robot().unwrap();
    for mount in &mut robot.legs {
        mount.leg.joint_friction = JointFriction {
            hip: friction,
            knee: 2.0 * friction,
            ankle: 0.5 * friction,
            toe: 0.0,
        };
    }
    let setup = Setup {
        base,
        legs: robot.legs.iter().map(|mount| mount.name.clone()).collect(),
        ground: None,
        step: SimDuration::from_millis(1),
        drives: Drives::None,
        abduction: Abduction::Locked,
        contacts: Contacts::Feet,
        set_point: SetPoint::Held,
        start: Start::default(),
    };
    let force = Force::Solve;
    Model::new(&robot, &Options::new(setup, force)).unwrap()
}

/// State in motion: foot positions in leg lengths, and velocities of all coordinates.
fn moving(model: &Model, feet: &[[f64; 2]; LEGS], rates: &[f64]) -> State {
    let mut state = State::zero();
    state.set_attitude([1.0, 0.0, 0.0, 0.0]);
    state.set_velocity(Vector3::new(rates[0], rates[1], rates[2]));
    state.set_rate(Vector3::new(rates[3], rates[4], rates[5]));
    for (i, [x, z]) in feet.iter().enumerate() {
        let length = model.legs[i].pantograph.length_max();
        state.set_foot(i, Planar::new(x * length, z * length));
        state.set_hip(i, model.legs[i].pantograph.hip_reference() + 0.2);
        state.set_foot_velocity(i, Planar::new(rates[6 + i], rates[10 + i]));
        state.set_hip_rate(i, 10.0 * rates[14 + i]);
    }
    state
}

/// All accelerations: trunk first, then x and z of the foot and the hip of each leg.
fn flat(motion: &Motion) -> SVector<f64, ALL> {
    let mut all = SVector::<f64, ALL>::zeros();
    all.fixed_rows_mut::<6>(0).copy_from(&motion.trunk());
    for leg in 0..LEGS {
        let [hip, _] = motion.drive[leg];
        let of_leg = Vector3::new(motion.foot[leg].x, motion.foot[leg].y, hip);
        all.fixed_rows_mut::<3>(6 + 3 * leg).copy_from(&of_leg);
    }
    all
}

/// Dense matrices of the inertia and of the friction added to it; coordinates that do not move have
/// an inertia of 1 and no friction.
fn dense_matrices(
    model: &Model,
    damping: &Damping,
    mobility: &Mobility,
) -> [SMatrix<f64, ALL, ALL>; 2] {
    let mut inertia = SMatrix::<f64, ALL, ALL>::identity();
    inertia
        .fixed_view_mut::<6, 6>(0, 0)
        .copy_from(&damping.inertia);
    let mut friction = SMatrix::<f64, ALL, ALL>::zeros();
    for (leg, leg_damping) in damping.legs.iter().enumerate().take(model.legs.len()) {
        let at = 6 + 3 * leg;
        let hip = mobility.drive[leg][0];
        for axis in 0..2 {
            inertia[(at + axis, at + axis)] = 1.0 / mobility.foot[leg];
        }
        inertia[(at + 2, at + 2)] = if hip > 0.0 { 1.0 / hip } else { 1.0 };
        let mut to_relative = SMatrix::<f64, 3, ALL>::zeros();
        to_relative
            .fixed_view_mut::<2, 6>(0, 0)
            .copy_from(&-leg_damping.carried);
        for axis in 0..2 {
            to_relative[(axis, at + axis)] = 1.0;
        }
        to_relative[(2, at + 2)] = 1.0;
        friction += to_relative.transpose() * leg_damping.matrix * to_relative;
    }
    [inertia, friction]
}

/// Removes the friction of imposed coordinates.
fn remove_imposed(
    [inertia, friction]: [SMatrix<f64, ALL, ALL>; 2],
    mobility: &Mobility,
) -> [SMatrix<f64, ALL, ALL>; 2] {
    let mut held = friction;
    for leg in (0..LEGS).filter(|leg| mobility.drive[*leg][0] == 0.0) {
        let at = 6 + 3 * leg + 2;
        held.row_mut(at).fill(0.0);
    }
    [inertia, held]
}

fn bases() -> impl Strategy<Value = Base> {
    prop_oneof![Just(Base::Free), Just(Base::Planar), Just(Base::Fixed)]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn elimination_of_legs_equals_solution_with_dense_inertia(
        base in bases(),
        digits in -4.0..2.0_f64,
        feet in prop::array::uniform4([-0.2..0.2_f64, -0.95..-0.7_f64]),
        rates in prop::collection::vec(-1.0..1.0_f64, 18),
        imposed in prop::array::uniform4(any::<bool>()),
        pushed_leg in 0..LEGS,
    ) {
        let model = model(base, libm::pow(10.0, digits));
        let seconds = 1e-3;
        let state = moving(&model, &feet, &rates);
        let mut middle = Midpoint::new();
        let placed = middle.place(&model, &state, &state, seconds);
        prop_assume!(placed.is_ok());
        let mut mobility = Mobility::new(&model, &middle.legs);
        for (drive, imposed) in mobility.drive.iter_mut().zip(imposed) {
            drive[0] = if imposed { 0.0 } else { 2e4 };
        }
        mobility.damp(&model, &middle.legs, seconds);
        mobility.factor(&model).unwrap();
        let damping = mobility.damping.unwrap();
        let [inertia, friction] = remove_imposed(dense_matrices(&model, &damping, &mobility), &mobility);
        let dense_factors = (inertia + friction).lu();

        // (M + K) a = M a₀.
        let mut motion = Motion::zero();
        motion.sagittal = Vector3::new(rates[0], rates[1], 20.0 * rates[2]);
        motion.lateral = Vector3::new(rates[3], 20.0 * rates[4], 20.0 * rates[5]);
        if base != Base::Free {
            motion.lateral = Vector3::zeros();
        }
        if base == Base::Fixed {
            motion.sagittal = Vector3::zeros();
        }
        for leg in 0..LEGS {
            motion.foot[leg] = Planar::new(30.0 * rates[6 + leg], 30.0 * rates[10 + leg]);
            motion.drive[leg][0] = 1e3 * rates[14 + leg];
        }
        let expected = dense_factors.solve(&(inertia * flat(&motion))).unwrap();
        mobility.apply_damping(&mut motion, LEGS);
        let error = (flat(&motion) - expected).norm();
        prop_assert!(error <= 1e-9 * (1.0 + expected.norm()), "{}", error);

        // Response to a force along a row.
        let row = Row {
            leg: pushed_leg,
            sagittal: Vector3::new(rates[0], rates[1], 0.1 * rates[2]),
            lateral: Vector3::new(rates[3], 0.1 * rates[4], 0.1 * rates[5]),
            foot: Planar::new(rates[6], rates[7]),
            hip: 0.05 * rates[8],
            pulley: 0.0,
        };
        let response = mobility.response(&row);
        let mut row_motion = Motion::zero();
        row_motion.add_force(&row, &response, &mobility, 1.0);
        let [s, l] = [row.sagittal, row.lateral];
        let mut force = SVector::<f64, ALL>::zeros();
        force.fixed_rows_mut::<6>(0).copy_from_slice(&[s.x, s.y, s.z, l.x, l.y, l.z]);
        let on_leg = [row.foot.x, row.foot.y, row.hip];
        force.fixed_rows_mut::<3>(6 + 3 * pushed_leg).copy_from_slice(&on_leg);
        for held in super::held(base) {
            force[held] = 0.0;
        }
        if imposed[pushed_leg] {
            force[6 + 3 * pushed_leg + 2] = 0.0;
        }
        let expected = dense_factors.solve(&force).unwrap();
        let error = (flat(&row_motion) - expected).norm();
        prop_assert!(error <= 1e-9 * (1.0 + expected.norm()), "{}", error);
        // Diagonal entry of the Delassus matrix: component of the row's response along itself.
        let diagonal = mobility.delassus_entry(&row, &row, &response);
        prop_assert!((diagonal - row_motion.along(&row)).abs() <= 1e-9 * (1.0 + diagonal.abs()));
    }

    #[test]
    fn friction_in_the_inertia_equals_the_friction_law(
        digits in -4.0..2.0_f64,
        feet in prop::array::uniform4([-0.2..0.2_f64, -0.95..-0.7_f64]),
        rates in prop::collection::vec(-1.0..1.0_f64, 18),
    ) {
        let model = model(Base::Free, libm::pow(10.0, digits));
        let state = moving(&model, &feet, &rates);
        let mut middle = Midpoint::new();
        // At an infinitesimal step, the midpoint is the state itself.
        let seconds = 1e-9;
        prop_assume!(middle.place(&model, &state, &state, seconds).is_ok());
        let damping = Damping::new(&model, &middle.legs, seconds);
        for (i, leg) in middle.legs.iter().enumerate() {
            let (by_law, by_inertia) = (leg.friction, damping.friction_at(&state, i));
            let scale = by_law.foot.norm() + by_law.hip.abs() + 1e-12;
            prop_assert!((by_law.foot - by_inertia.foot).norm() < 1e-6 * scale);
            prop_assert!((by_law.hip - by_inertia.hip).abs() < 1e-6 * scale);
        }
    }
}
