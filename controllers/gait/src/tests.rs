//! Tests of the complete controllers.

use std::f64::consts::PI;

use proptest::prelude::*;
use twinrig_kernel::{SimDuration, Snapshot};
use twinrig_robot::Robot;
use twinrig_robot::leg::{LegCommand, Pantograph, Planar};
use twinrig_runtime::{Limit, Process, ProcessVariable, VariableError};

use crate::{Cpg, FootLocus, Gait, GaitError, LocusShape};

mod outputs;
mod printed;
mod steering;
mod tegotae;
mod tegotae_rule;

const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];
const PERIOD: SimDuration = SimDuration::from_millis(2);

fn cpg(gait: Gait) -> Cpg {
    Cpg::new(&Robot::example(), &LEGS, gait).unwrap()
}

fn index(process: &impl Process, name: &str) -> usize {
    process
        .variables()
        .iter()
        .position(|variable| variable.name() == name)
        .unwrap()
}

fn set(process: &mut impl Process, name: &str, value: f64) {
    process.set_variable(index(process, name), value).unwrap();
}

fn run(process: &mut impl Process, steps: usize, width: usize) -> Vec<Vec<f64>> {
    let mut outputs = vec![0.0; width];
    let step = |_| {
        process.step(PERIOD, &[], &mut outputs);
        outputs.clone()
    };
    (0..steps).map(step).collect()
}

fn bits(rows: &[Vec<f64>]) -> Vec<u64> {
    rows.iter().flatten().map(|value| value.to_bits()).collect()
}

#[test]
fn variables_are_those_of_table_3_3_for_fore_and_hind() {
    let cpg = cpg(Gait::Trot);
    let names: Vec<_> = cpg.variables().iter().map(ProcessVariable::name).collect();
    let mut expected = ["frequency", "step_length", "coupling", "ramp", "crouch"]
        .map(str::to_owned)
        .to_vec();
    for name in [
        "hip_height",
        "step_height",
        "mid_stance_offset",
        "duty_factor",
        "touch_down_angle",
        "take_off_angle",
        "compression",
    ] {
        expected.extend([format!("{name}/fore"), format!("{name}/hind")]);
    }
    expected.extend(LEGS.map(|leg| format!("phase_difference/{leg}")));
    expected.push("splay".to_owned());
    expected.extend(LEGS.map(|leg| format!("step_length_offset/{leg}")));
    expected.extend(["turn", "sidestep"].map(str::to_owned));
    expected.extend(LEGS.map(|leg| format!("lateral_offset/{leg}")));
    expected.extend(["dead_band", "lead", "capture"].map(str::to_owned));
    assert_eq!(names, expected);
}

#[test]
fn commands_are_the_inverse_kinematics_of_the_locus() {
    let mut cpg = cpg(Gait::Trot);
    set(&mut cpg, "ramp", 0.0);
    set(&mut cpg, "step_length", 0.07);
    set(&mut cpg, "hip_height/hind", 0.13);
    let rows = run(&mut cpg, 500, 8);
    let robot = Robot::example();
    let leg = Pantograph::new(&robot.legs[0].leg).unwrap();
    let shape = LocusShape {
        hip_height: 0.13,
        step_height: 0.17 * leg.length_max(),
        step_length: 0.07,
        touch_down_angle: 1.67,
        ..LocusShape::default()
    };
    let target = FootLocus::new(&shape).unwrap().point(cpg.phase(2));
    let expected = leg
        .inverse_closed(Planar::new(target[0], target[1]))
        .unwrap();
    assert!((rows[499][4] - expected.hip).abs() < 1e-12);
    assert!((rows[499][5] - expected.knee).abs() < 1e-12);
    assert_eq!(cpg.out_of_reach(), 0);
}

#[test]
fn trot_moves_diagonal_legs_in_phase_and_the_others_in_antiphase() {
    let mut cpg = cpg(Gait::Trot);
    set(&mut cpg, "frequency", 2.5); // 200 steps a cycle
    set(&mut cpg, "ramp", 0.0);
    let rows = run(&mut cpg, 400, 8);
    for step in 0..300 {
        assert_eq!(rows[step][0].to_bits(), rows[step][6].to_bits());
        assert!((rows[step][0] - rows[step + 100][2]).abs() < 1e-10);
    }
}

#[test]
fn removing_a_leg_changes_no_bit_of_the_others() {
    let robot = Robot::example();
    for seed in [None, Some(3)] {
        let start = |legs: &[&str]| {
            let cpg = Cpg::new(&robot, legs, Gait::Trot).unwrap();
            seed.map_or(cpg.clone(), |seed| cpg.with_random_phases(seed))
        };
        let all = run(&mut start(&LEGS), 300, 8);
        let three = run(&mut start(&["LF", "LH", "RH"]), 300, 6);
        let all: Vec<Vec<f64>> = all
            .iter()
            .map(|row| [&row[0..2], &row[4..8]].concat())
            .collect();
        assert_eq!(bits(&all), bits(&three));
    }
}

#[test]
fn step_length_and_hip_height_rise_over_the_ramp() {
    let mut cpg = cpg(Gait::Trot);
    set(&mut cpg, "crouch", 0.008);
    set(&mut cpg, "frequency", 0.0);
    let leg = Pantograph::new(&Robot::example().legs[0].leg).unwrap();
    let mut outputs = [0.0; 8];
    let expected = |x: f64, height: f64| leg.inverse_closed(Planar::new(x, -height)).unwrap().hip;
    let (height, length) = (0.93 * leg.length_max(), 0.54 * leg.length_max());
    cpg.step(SimDuration::ZERO, &[], &mut outputs);
    assert!((outputs[0] - expected(0.0, height - 0.008)).abs() < 1e-12);
    cpg.step(SimDuration::from_millis(500), &[], &mut outputs);
    assert!((outputs[0] - expected(-0.25 * length, height - 0.004)).abs() < 1e-12);
    cpg.step(SimDuration::from_secs(1), &[], &mut outputs);
    assert!((outputs[0] - expected(-0.5 * length, height)).abs() < 1e-12);
}

#[test]
fn change_of_step_length_takes_effect_at_the_next_step() {
    let mut cpg = cpg(Gait::Trot);
    let mut other = cpg.clone();
    assert_eq!(bits(&run(&mut cpg, 700, 8)), bits(&run(&mut other, 700, 8)));
    set(&mut cpg, "step_length", 0.05);
    assert_ne!(bits(&run(&mut cpg, 1, 8)), bits(&run(&mut other, 1, 8)));
}

#[test]
fn offset_of_the_step_length_acts_on_its_leg_alone() {
    let (mut plain, mut longer, mut negative) = (cpg(Gait::Trot), cpg(Gait::Trot), cpg(Gait::Trot));
    for cpg in [&mut plain, &mut longer, &mut negative] {
        set(cpg, "ramp", 0.0);
        set(cpg, "step_length", 0.06);
        set(cpg, "hip_height/fore", 0.12);
    }
    set(&mut longer, "step_length_offset/RF", 0.02);
    set(&mut negative, "step_length_offset/RF", -0.08); // no step at all
    let leg = Pantograph::new(&Robot::example().legs[1].leg).unwrap();
    let hip = |x: f64| leg.inverse_closed(Planar::new(x, -0.12)).unwrap().hip;
    // RF is at touch-down, half a step in front of the hip.
    for (cpg, x) in [
        (&mut plain, 0.03),
        (&mut longer, 0.04),
        (&mut negative, 0.0),
    ] {
        let mut outputs = [0.0; 8];
        set(cpg, "duty_factor/fore", 0.5);
        cpg.step(SimDuration::ZERO, &[], &mut outputs);
        assert!((outputs[2] - hip(x)).abs() < 1e-9, "{x}");
    }
    let others = |rows: Vec<Vec<f64>>| -> Vec<Vec<f64>> {
        rows.into_iter()
            .map(|row| [&row[..2], &row[4..]].concat())
            .collect()
    };
    assert_eq!(
        others(run(&mut plain, 300, 8)),
        others(run(&mut longer, 300, 8))
    );
}

#[test]
fn target_out_of_reach_becomes_the_nearest_point_and_is_counted() {
    let mut cpg = cpg(Gait::Trot);
    set(&mut cpg, "ramp", 0.0);
    let leg = Pantograph::new(&Robot::example().legs[0].leg).unwrap();
    set(&mut cpg, "step_length", 2.0 * leg.length_max());
    let rows = run(&mut cpg, 500, 8);
    assert!(rows.iter().flatten().all(|value| value.is_finite()));
    assert!(cpg.out_of_reach() > 500);
    // Half of a stride of twice the longest leg is beyond its reach by less than its length.
    let violations = cpg.limit_violations();
    assert_eq!(violations.len(), 4);
    for violation in &violations {
        assert_eq!(violation.limit, Limit::Reach);
        assert!(violation.part.starts_with("leg/"));
        assert!(
            (0.0..leg.length_max()).contains(&violation.worst_m),
            "{violation}"
        );
    }

    set(&mut cpg, "frequency", 0.0);
    let (lowest, longest) = (leg.length_min(), leg.length_max());
    set(&mut cpg, "hip_height/fore", lowest);
    set(&mut cpg, "step_length", 0.0);
    set(&mut cpg, "mid_stance_offset/fore", longest);
    // The extended leg points to the target.
    let share = longest / libm::hypot(longest, lowest);
    let nearest = Planar::new(share * longest, -share * lowest);
    let LegCommand { hip, knee } = leg.inverse_closed(nearest).unwrap();
    let row = run(&mut cpg, 1, 8).remove(0);
    assert!(
        (row[0] - hip).abs() < 0.01 && (row[1] - knee).abs() < 1e-6,
        "{row:?}"
    );
}

#[test]
fn values_out_of_range_are_rejected_without_effect() {
    let mut cpg = cpg(Gait::Trot);
    let before = cpg.save();
    for (name, value) in [
        ("duty_factor/fore", 0.0),
        ("duty_factor/hind", 1.0),
        ("duty_factor/fore", 1e-320),
        ("touch_down_angle/fore", 0.0),
        ("take_off_angle/hind", PI),
        ("step_length", -0.01),
        ("frequency", f64::NAN),
        ("mid_stance_offset/fore", f64::INFINITY),
        ("hip_height/fore", 0.2),
        ("phase_difference/RH", 1.5 * PI),
    ] {
        let index = index(&cpg, name);
        let error = cpg.set_variable(index, value).unwrap_err();
        assert!(error.to_string().contains(name), "{error}");
    }
    assert_eq!(
        cpg.set_variable(99, 0.0),
        Err(VariableError::NoSuchIndex {
            index: 99,
            count: 37
        })
    );
    assert_eq!(cpg.save(), before);
}

#[test]
fn unknown_leg_is_a_typed_error() {
    let error = Cpg::new(&Robot::example(), &["LF", "XY"], Gait::Trot).unwrap_err();
    assert_eq!(
        error,
        GaitError::UnknownLeg {
            name: "XY".to_owned(),
            known: "LF, RF, LH, RH".to_owned()
        }
    );
}

#[test]
fn snapshot_of_another_robot_is_a_typed_error() {
    let robot = Robot::example();
    let mut three = robot.clone();
    three.legs.pop();
    let other = Cpg::new(&three, &["LF"], Gait::Trot).unwrap().save();
    assert!(cpg(Gait::Trot).restore(&other).is_err());
    assert!(cpg(Gait::Trot).restore(&Snapshot(vec![1, 2, 3])).is_err());
}

#[test]
fn step_allocates_nothing() {
    let mut cpg = cpg(Gait::Walk).with_random_phases(1);
    let mut outputs = [0.0; 8];
    let counted = allocation_counter::measure(|| {
        for _ in 0..1000 {
            cpg.step(PERIOD, &[], &mut outputs);
        }
    });
    assert_eq!(counted.count_total, 0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn realised_stance_share_of_every_leg_equals_its_duty_factor(fore in 0.05..0.95_f64, hind in 0.05..0.95_f64) {
        let mut cpg = cpg(Gait::Walk);
        set(&mut cpg, "duty_factor/fore", fore);
        set(&mut cpg, "duty_factor/hind", hind);
        set(&mut cpg, "frequency", 0.5); // 1000 steps a cycle
        let mut stance = [0_u32; 4];
        let mut outputs = [0.0; 8];
        for _ in 0..5000 {
            cpg.step(PERIOD, &[], &mut outputs);
            for (leg, count) in stance.iter_mut().enumerate() {
                *count += u32::from(cpg.phase(leg) >= PI);
            }
        }
        for (count, d) in stance.into_iter().zip([fore, fore, hind, hind]) {
            prop_assert!((f64::from(count) / 5000.0 - d).abs() < 2e-3);
        }
    }

    #[test]
    fn two_short_steps_equal_one_long_step(millis in 2..200_u32, split in any::<prop::sample::Index>(), warm in 0..500_usize) {
        let mut one = cpg(Gait::Trot);
        run(&mut one, warm, 8);
        let mut two = one.clone();
        let elapsed = SimDuration::from_millis(millis.into());
        let first = SimDuration::from_micros(split.index(1000 * millis as usize) as u64);
        let (mut a, mut b) = ([0.0; 8], [0.0; 8]);
        one.step(elapsed, &[], &mut a);
        two.step(first, &[], &mut b);
        two.step(elapsed.checked_sub(first).unwrap(), &[], &mut b);
        for (a, b) in a.into_iter().zip(b) {
            prop_assert!((a - b).abs() < 1e-9, "{} {}", a, b);
        }
    }

    #[test]
    fn restored_controller_continues_bit_for_bit(
        warm in 0..400_usize, seed in any::<u64>(), length in 0.0..0.15_f64, d in 0.2..0.8_f64,
    ) {
        let mut original = cpg(Gait::Walk).with_random_phases(seed);
        set(&mut original, "step_length", length);
        set(&mut original, "duty_factor/hind", d);
        run(&mut original, warm, 8);
        let snapshot = original.save();
        let mut copy = cpg(Gait::Trot);
        copy.restore(&snapshot).unwrap();
        prop_assert_eq!(bits(&run(&mut original, 300, 8)), bits(&run(&mut copy, 300, 8)));
        prop_assert_eq!(original.save(), copy.save());
    }

    #[test]
    fn outputs_are_finite_for_any_variables(
        values in prop::collection::vec((0..37_usize, prop_oneof![-10.0..10.0_f64, any::<f64>()]), 0..40),
        trunk in prop::array::uniform6(any::<f64>()), millis in 0..10_000_u64,
    ) {
        for mut cpg in [cpg(Gait::Trot), steering::steering(), steering::capturing()] {
            for (index, value) in &values {
                // Most values are out of range: an error, and the variable is unchanged.
                let _ = cpg.set_variable(*index, *value);
                let mut outputs = vec![0.0; cpg.ports().len()];
                cpg.step(SimDuration::from_millis(millis), &trunk, &mut outputs);
                prop_assert!(outputs.iter().all(|output| output.is_finite()), "{:?}", outputs);
                let worst = cpg.limit_violations().into_iter().map(|limit| limit.worst_m);
                prop_assert!(worst.into_iter().all(f64::is_finite));
            }
        }
    }
}
