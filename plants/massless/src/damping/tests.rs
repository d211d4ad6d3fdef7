use nalgebra::{SMatrix, SVector, Vector3};
use proptest::prelude::*;
use twinrig_kernel::SimDuration;
use twinrig_leg::Planar;
use twinrig_legged::{Base, Drives, LEGS, Setup, Start};
use twinrig_robot::{JointFriction, RobotFile};

use super::Damping;
use crate::midpoint::Midpoint;
use crate::mobility::{Mobility, Motion};
use crate::model::{Force, Model, Options};
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
        start: Start::default(),
    };
    let force = Force::Solve;
    Model::new(&robot, &Options { setup, force }).unwrap()
}

/// A state in motion: where the feet are, and how everything moves.
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

/// All accelerations, trunk first, then x and z of the foot and the hip of each leg.
fn flat(motion: &Motion) -> SVector<f64, ALL> {
    let mut all = SVector::<f64, ALL>::zeros();
    all.fixed_rows_mut::<6>(0).copy_from(&motion.trunk());
    for leg in 0..LEGS {
        let [hip, _] = motion.drive[leg];
        let own = Vector3::new(motion.foot[leg].x, motion.foot[leg].y, hip);
        all.fixed_rows_mut::<3>(6 + 3 * leg).copy_from(&own);
    }
    all
}

/// The inertia, and what friction adds to it, written out; coordinates that do not move have an inertia of 1 and no friction.
fn written_out(
    model: &Model,
    damping: &Damping,
    mobility: &Mobility,
) -> [SMatrix<f64, ALL, ALL>; 2] {
    let mut inertia = SMatrix::<f64, ALL, ALL>::identity();
    inertia
        .fixed_view_mut::<6, 6>(0, 0)
        .copy_from(&damping.inertia);
    let mut friction = SMatrix::<f64, ALL, ALL>::zeros();
    for (leg, own) in damping.legs.iter().enumerate().take(model.legs.len()) {
        let at = 6 + 3 * leg;
        let hip = mobility.drive[leg][0];
        for axis in 0..2 {
            inertia[(at + axis, at + axis)] = 1.0 / mobility.foot[leg];
        }
        inertia[(at + 2, at + 2)] = if hip > 0.0 { 1.0 / hip } else { 1.0 };
        let mut to_relative = SMatrix::<f64, 3, ALL>::zeros();
        to_relative
            .fixed_view_mut::<2, 6>(0, 0)
            .copy_from(&-own.carried);
        for axis in 0..2 {
            to_relative[(axis, at + axis)] = 1.0;
        }
        to_relative[(2, at + 2)] = 1.0;
        friction += to_relative.transpose() * own.matrix * to_relative;
    }
    [inertia, friction]
}

/// What is imposed does not give way to friction.
fn without_imposed(
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
    fn legs_taken_out_one_by_one_give_what_the_whole_inertia_gives(
        base in bases(),
        digits in -4.0..2.0_f64,
        feet in prop::array::uniform4([-0.2..0.2_f64, -0.95..-0.7_f64]),
        rates in prop::collection::vec(-1.0..1.0_f64, 18),
        imposed in prop::array::uniform4(any::<bool>()),
        pushed in 0..LEGS,
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
        let [inertia, friction] = without_imposed(written_out(&model, &damping, &mobility), &mobility);
        let whole = (inertia + friction).lu();

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
        let expected = whole.solve(&(inertia * flat(&motion))).unwrap();
        mobility.hold_back(&mut motion, LEGS);
        let apart = (flat(&motion) - expected).norm();
        prop_assert!(apart <= 1e-9 * (1.0 + expected.norm()), "{}", apart);

        // And a force along a row.
        let row = Row {
            leg: pushed,
            sagittal: Vector3::new(rates[0], rates[1], 0.1 * rates[2]),
            lateral: Vector3::new(rates[3], 0.1 * rates[4], 0.1 * rates[5]),
            foot: Planar::new(rates[6], rates[7]),
            hip: 0.05 * rates[8],
            pulley: 0.0,
        };
        let response = mobility.response(&row);
        let mut pushed_by = Motion::zero();
        pushed_by.push(&row, &response, &mobility, 1.0);
        let [s, l] = [row.sagittal, row.lateral];
        let mut force = SVector::<f64, ALL>::zeros();
        force.fixed_rows_mut::<6>(0).copy_from_slice(&[s.x, s.y, s.z, l.x, l.y, l.z]);
        let own = [row.foot.x, row.foot.y, row.hip];
        force.fixed_rows_mut::<3>(6 + 3 * pushed).copy_from_slice(&own);
        for held in super::held(base) {
            force[held] = 0.0;
        }
        if imposed[pushed] {
            force[6 + 3 * pushed + 2] = 0.0;
        }
        let expected = whole.solve(&force).unwrap();
        let apart = (flat(&pushed_by) - expected).norm();
        prop_assert!(apart <= 1e-9 * (1.0 + expected.norm()), "{}", apart);
        // What the row does to itself is its component of that.
        let own = mobility.between(&row, &row, &response);
        prop_assert!((own - pushed_by.along(&row)).abs() <= 1e-9 * (1.0 + own.abs()));
    }

    #[test]
    fn friction_in_the_inertia_is_that_of_the_law(
        digits in -4.0..2.0_f64,
        feet in prop::array::uniform4([-0.2..0.2_f64, -0.95..-0.7_f64]),
        rates in prop::collection::vec(-1.0..1.0_f64, 18),
    ) {
        let model = model(Base::Free, libm::pow(10.0, digits));
        let state = moving(&model, &feet, &rates);
        let mut middle = Midpoint::new();
        // In the next to no time, the middle is the state itself.
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
