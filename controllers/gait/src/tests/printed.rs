//! Tests of the controllers with the formulas of the thesis as printed.

use std::f64::consts::PI;

use proptest::prelude::*;
use twinrig_robot::Robot;
use twinrig_robot::leg::{Pantograph, Planar};
use twinrig_runtime::Process;

use super::{LEGS, PERIOD, bits, cpg, run, set};
use crate::{Cpg, DutyRule, FootLocus, Gait, LocusShape, StanceCurve, Tegotae};

fn printed() -> Cpg {
    let cpg = cpg(Gait::Trot).with_stance(StanceCurve::Thesis);
    cpg.with_duty_rule(DutyRule::Thesis).unwrap()
}

/// Asserts that the last commands of the left hind leg are those of the printed locus at `phase`.
fn assert_on_printed_locus(row: &[f64], phase: f64) {
    let robot = Robot::example();
    let leg = Pantograph::new(&robot.legs[2].leg).unwrap();
    let shape = LocusShape {
        hip_height: 0.13,
        step_height: 0.17 * leg.length_max(),
        step_length: 0.07,
        touch_down_angle: 1.67,
        compression: 0.7,
        ..LocusShape::default()
    };
    let locus = FootLocus::new(&shape)
        .unwrap()
        .with_stance(StanceCurve::Thesis);
    let [x, z] = locus.point(phase);
    let expected = leg.inverse_closed(Planar::new(x, z)).unwrap();
    assert!((row[4] - expected.hip).abs() < 1e-12, "{phase}");
    assert!((row[5] - expected.knee).abs() < 1e-12, "{phase}");
}

fn set_locus(process: &mut impl Process) {
    set(process, "ramp", 0.0);
    set(process, "step_length", 0.07);
    set(process, "hip_height/hind", 0.13);
    set(process, "compression/hind", 0.7);
}

#[test]
fn variables_change_the_printed_curve_and_its_commands_stay_within_reach() {
    let (mut open, mut outputs) = (printed(), [0.0; 8]);
    set_locus(&mut open);
    let mut closed = Tegotae::new(&Robot::example(), &LEGS, Gait::Trot, 1).unwrap();
    closed = closed.with_stance(StanceCurve::Thesis);
    set_locus(&mut closed);
    for _ in 0..300 {
        open.step(PERIOD, &[], &mut outputs);
        assert_on_printed_locus(&outputs, open.phase(2));
        closed.step(PERIOD, &[0.0, 2.0, 2.0, 0.0], &mut outputs);
        assert_on_printed_locus(&outputs, closed.phase(2));
    }
    assert_eq!([open.out_of_reach(), closed.out_of_reach()], [0, 0]);
}

#[test]
fn printed_control_points_can_be_out_of_reach() {
    // Their offset is (1 − c)·h·tan(θ − π/2), 24 times the depth of mid-stance at 0.05 rad.
    let count = |stance: StanceCurve| {
        let mut cpg = cpg(Gait::Trot).with_stance(stance);
        set(&mut cpg, "ramp", 0.0);
        set(&mut cpg, "step_length", 0.0);
        set(&mut cpg, "compression/fore", 0.0);
        set(&mut cpg, "step_height/fore", 0.01);
        set(&mut cpg, "hip_height/fore", 0.12);
        set(&mut cpg, "take_off_angle/fore", 2.2);
        set(&mut cpg, "touch_down_angle/fore", 3.09);
        let rows = run(&mut cpg, 500, 8);
        assert!(rows.iter().flatten().all(|value| value.is_finite()));
        cpg.out_of_reach()
    };
    assert!(count(StanceCurve::Thesis) > count(StanceCurve::Linear));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn realised_stance_share_of_every_leg_is_that_of_eq_3_1(fore in 0.01..0.95_f64, hind in 0.01..0.95_f64) {
        let mut cpg = printed();
        set(&mut cpg, "duty_factor/fore", fore);
        set(&mut cpg, "duty_factor/hind", hind);
        set(&mut cpg, "frequency", 0.5); // 1000 steps a cycle
        let (mut stance, mut outputs) = ([0_u32; 4], [0.0; 8]);
        for _ in 0..3000 {
            cpg.step(PERIOD, &[], &mut outputs);
            for (leg, count) in stance.iter_mut().enumerate() {
                *count += u32::from(cpg.phase(leg) >= PI);
            }
        }
        for (count, d) in stance.into_iter().zip([fore, fore, hind, hind]) {
            prop_assert!((f64::from(count) / 3000.0 - 0.5 * (1.0 + d)).abs() < 2e-3);
        }
    }

    #[test]
    fn restored_controller_keeps_the_printed_formulas(warm in 0..400_usize, c in 0.3..1.0_f64) {
        let mut original = printed();
        set(&mut original, "compression/fore", c);
        run(&mut original, warm, 8);
        let mut copy = printed();
        copy.restore(&original.save()).unwrap();
        prop_assert_eq!(bits(&run(&mut original, 300, 8)), bits(&run(&mut copy, 300, 8)));
    }
}
