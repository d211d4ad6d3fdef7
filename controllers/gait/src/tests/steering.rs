//! Steps to the side.

use std::f64::consts::PI;

use proptest::prelude::*;
use twinrig_kernel::{Direction, Port};
use twinrig_robot::leg::{LegCommand, Pantograph};
use twinrig_robot::{Abduction as Joint, Robot};
use twinrig_runtime::{Process, VariableError};

use super::{LEGS, PERIOD, cpg, index, run, set};
use crate::{Abduction, Cpg, Gait, GaitError, Planner, Tegotae};

/// A robot whose legs abduct about axes beside and above the hips.
fn robot() -> Robot {
    let mut robot = Robot::example();
    for mount in &mut robot.legs {
        mount.leg.abduction = Some(Joint {
            offset: 0.012,
            height: 0.007,
            abduction_max: 0.6,
            adduction_max: 0.5,
            friction: 1e-3,
        });
    }
    robot
}

pub(super) fn steering() -> Cpg {
    let cpg = Cpg::new(&robot(), &LEGS, Gait::Trot).unwrap();
    let mut cpg = cpg.with_abduction(Abduction::Steer).unwrap();
    set(&mut cpg, "ramp", 0.0);
    cpg
}

pub(super) fn capturing() -> Cpg {
    let cpg = Cpg::new(&robot(), &LEGS, Gait::Trot).unwrap();
    let mut cpg = cpg.with_abduction(Abduction::Capture).unwrap();
    set(&mut cpg, "ramp", 0.0);
    set(&mut cpg, "capture", 0.1);
    cpg
}

/// Returns the place of the foot of a leg in the trunk, of the commands of a row.
fn foot(robot: &Robot, leg: usize, row: &[f64]) -> [f64; 3] {
    let mount = &robot.legs[leg];
    let pantograph = Pantograph::new(&mount.leg).unwrap();
    let [hip, knee, angle] = [row[2 * leg], row[2 * leg + 1], row[8 + leg]];
    let foot = pantograph.foot_of(LegCommand { hip, knee }).unwrap();
    let [x, y, z] = mount.hip;
    let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
    let inward = if y > 0.0 { -0.012 } else { 0.012 };
    let (left, up) = (-inward, foot.y - 0.007);
    [
        x + foot.x,
        y + inward + cosine * left - sine * up,
        z + 0.007 + sine * left + cosine * up,
    ]
}

#[test]
fn straight_steps_are_those_without_abduction() {
    let mut plain = cpg(Gait::Trot);
    set(&mut plain, "ramp", 0.0);
    let (plain, steering) = (run(&mut plain, 300, 8), run(&mut steering(), 300, 12));
    for (plain, steering) in plain.iter().zip(&steering) {
        for (plain, steering) in plain.iter().zip(steering) {
            assert!((plain - steering).abs() < 1e-12, "{plain} {steering}");
        }
        assert!(steering[8..].iter().all(|angle| angle.abs() < 1e-12));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// In stance feet move as points of the ground under a trunk that moves with the velocity of
    /// the gait, to the side, and about z; their height is that of the foot locus.
    #[test]
    fn feet_in_stance_move_against_the_trunk(
        frequency in 1.5..4.0_f64,
        turn in -0.6..0.6_f64,
        sidestep in -0.05..0.05_f64,
        splay in -0.1..0.1_f64,
        offset in -0.01..0.01_f64,
    ) {
        let robot = robot();
        let (mut cpg, mut straight) = (steering(), steering());
        for cpg in [&mut cpg, &mut straight] {
            set(cpg, "frequency", frequency);
            set(cpg, "step_length", 0.05);
            set(cpg, "mid_stance_offset/hind", 0.01);
            set(cpg, "step_height/fore", 0.02);
            set(cpg, "step_height/hind", 0.02);
        }
        set(&mut cpg, "turn", turn);
        set(&mut cpg, "sidestep", sidestep);
        set(&mut cpg, "splay", splay);
        set(&mut cpg, "lateral_offset/RH", offset);
        // In 0.55 of a cycle.
        let speed = 0.05 * frequency / 0.55;
        let mut rows = [vec![0.0; 12], vec![0.0; 12]];
        let mut upright = vec![0.0; 12];
        let mut seen = [0; 4];
        for step in 0..200 {
            let before: Vec<f64> = (0..4).map(|leg| cpg.phase(leg)).collect();
            rows.swap(0, 1);
            cpg.step(PERIOD, &[], &mut rows[1]);
            straight.step(PERIOD, &[], &mut upright);
            prop_assert_eq!(cpg.out_of_reach(), 0);
            for (leg, mount) in robot.legs.iter().enumerate() {
                let [was, is] = [0, 1].map(|row| foot(&robot, leg, &rows[row]));
                let height = foot(&robot, leg, &upright)[2];
                prop_assert!((is[2] - height).abs() < 1e-12, "{} {height}", is[2]);
                let in_stance = before[leg] > PI && cpg.phase(leg) > before[leg];
                if step == 0 || !in_stance {
                    continue;
                }
                seen[leg] += 1;
                let outwards = splay * mount.hip[1].signum();
                let axis = mount.hip[1] - 0.012 * mount.hip[1].signum();
                let beside = 0.012 * mount.hip[1].signum();
                let z = -cpg_height(&cpg, leg) - 0.007;
                // At mid-stance: the place at height z whose leg is turned by the splay.
                let mut y = axis + (beside - z * libm::sin(outwards)) / libm::cos(outwards);
                if leg == 3 {
                    y += offset;
                }
                let seconds = PERIOD.as_secs_f64();
                let found = [0, 1].map(|axis| (is[axis] - was[axis]) / seconds);
                let x = mount.hip[0] + if leg < 2 { 0.0 } else { 0.01 };
                let expected = [-(speed - turn * y), -(sidestep + turn * x)];
                for (found, expected) in found.iter().zip(expected) {
                    prop_assert!((found - expected).abs() < 1e-9, "{leg}: {found} {expected}");
                }
            }
        }
        prop_assert!(seen.iter().all(|steps| *steps > 50), "{seen:?}");
    }
}

/// Height of a hip above the foot at mid-stance.
fn cpg_height(cpg: &Cpg, leg: usize) -> f64 {
    let end = if leg < 2 { "fore" } else { "hind" };
    let at = index(cpg, &format!("hip_height/{end}"));
    cpg.variables()[at].value()
}

/// A servo with a dead band that holds where it is within it has the angle without one.
#[test]
fn commands_lead_by_the_dead_band() {
    let (mut plain, mut leading) = (steering(), steering());
    for cpg in [&mut plain, &mut leading] {
        set(cpg, "turn", 0.4);
    }
    set(&mut leading, "dead_band", 0.005);
    let (plain, leading) = (run(&mut plain, 400, 12), run(&mut leading, 400, 12));
    for leg in 0..4 {
        let mut servo = leading[0][8 + leg];
        for (row, (plain, leading)) in plain.iter().zip(&leading).enumerate() {
            assert_eq!(plain[..8], leading[..8]);
            let (angle, command) = (plain[8 + leg], leading[8 + leg]);
            servo = servo.clamp(command - 0.005, command + 0.005);
            // It begins to follow in the first cycle. Lifting a foot turns the leg, too, which the
            // lead leaves out.
            if row > 170 {
                assert!((servo - angle).abs() < 1.5e-3, "{leg}: {servo} {angle}");
            }
        }
    }
}

/// Angles come earlier by the lead, and nothing else changes.
fn assert_leads(controller: &(impl Process + Clone)) {
    let [plain, leading] = [0.0, 0.02].map(|lead| {
        let mut controller = controller.clone();
        set(&mut controller, "turn", 0.4);
        set(&mut controller, "lead", lead);
        let mut outputs = [0.0; 12];
        let rows = (0..400).map(|_| {
            controller.step(PERIOD, &[0.0; 4], &mut outputs);
            outputs
        });
        rows.collect::<Vec<_>>()
    });
    for (row, leading) in leading[..390].iter().enumerate() {
        for leg in 0..4 {
            let (angle, later) = (leading[8 + leg], plain[row + 10][8 + leg]);
            // The height is that of the present phase.
            assert!((angle - later).abs() < 4e-3, "{leg}: {angle} {later}");
            assert_eq!(leading[2 * leg].to_bits(), plain[row][2 * leg].to_bits());
        }
    }
}

#[test]
fn commands_are_ahead_by_the_lead() {
    assert_leads(&steering());
    let tegotae = Tegotae::new(&robot(), &LEGS, Gait::Trot, 1).unwrap();
    let mut tegotae = tegotae.with_abduction(Abduction::Steer).unwrap();
    set(&mut tegotae, "ramp", 0.0);
    assert_leads(&tegotae);
}

/// Feet of a controller with `others` inputs before those of the trunk are placed to the left by a
/// velocity to the left, and stay where they are in stance.
fn assert_captures(controller: &(impl Process + Clone), others: usize) {
    let robot = robot();
    let feet = |capture: f64, velocity: f64, yaw: f64| {
        let mut controller = controller.clone();
        set(&mut controller, "ramp", 0.0);
        set(&mut controller, "sidestep", 0.02);
        set(&mut controller, "capture", capture);
        let mut inputs = vec![0.0; others];
        let [x, y] = [-libm::sin(yaw), libm::cos(yaw)].map(|share| share * velocity);
        inputs.extend([x, y, 0.0, 0.0, 0.0, yaw]);
        let ports = controller.ports();
        let is_output = |port: &&Port| port.direction == Direction::Output;
        let mut outputs = vec![0.0; ports.iter().filter(is_output).count()];
        let rows = (0..500).map(|_| {
            controller.step(PERIOD, &inputs, &mut outputs);
            [0, 1, 2, 3].map(|leg| foot(&robot, leg, &outputs))
        });
        rows.collect::<Vec<_>>()
    };
    let (plain, moved) = (feet(0.0, 0.22, 0.0), feet(0.1, 0.22, 0.0));
    // The last of the steps are over a cycle after the first.
    for (plain, moved) in plain.iter().zip(&moved).skip(300) {
        for (plain, moved) in plain.iter().zip(moved) {
            // 0.1 s × (0.22 − 0.02) m/s.
            let shift = moved[1] - plain[1];
            assert!((shift - 0.02).abs() < 1e-12, "{shift}");
            assert!((moved[2] - plain[2]).abs() < 1e-12);
        }
    }
    // Velocities are across the heading, not of the world.
    for (row, turned) in moved.iter().zip(feet(0.1, 0.22, 2.0)) {
        for (foot, turned) in row.iter().zip(turned) {
            assert!((foot[1] - turned[1]).abs() < 1e-12);
        }
    }
}

#[test]
fn feet_capture_a_motion_to_the_side() {
    let capture = Abduction::Capture;
    let cpg = Cpg::new(&robot(), &LEGS, Gait::Trot).unwrap();
    let cpg = cpg.with_abduction(capture).unwrap();
    assert_captures(&cpg, 0);
    let planner = Planner::new(&robot(), &LEGS, cpg).unwrap();
    assert_captures(&planner, 16);
    let tegotae = Tegotae::new(&robot(), &LEGS, Gait::Trot, 1).unwrap();
    assert_captures(&tegotae.with_abduction(capture).unwrap(), 4);
}

/// A foot that stands does not follow the velocity of the trunk; the next swing does.
#[test]
fn feet_in_stance_do_not_follow_the_trunk() {
    let (robot, mut cpg) = (robot(), capturing());
    let mut outputs = [0.0; 12];
    let mut seen = [0; 4];
    let mut before = [[0.0; 3]; 4];
    for step in 0..400 {
        let was: Vec<f64> = (0..4).map(|leg| cpg.phase(leg)).collect();
        let velocity = 0.3 * libm::sin(0.1 * f64::from(step));
        cpg.step(PERIOD, &[0.0, velocity, 0.0, 0.0, 0.0, 0.0], &mut outputs);
        let feet = [0, 1, 2, 3].map(|leg| foot(&robot, leg, &outputs));
        for leg in 0..4 {
            let moved = (feet[leg][1] - before[leg][1]).abs();
            if step > 0 && was[leg] > PI && cpg.phase(leg) > was[leg] {
                assert!(moved < 1e-12, "{leg} at {step}: {moved}");
                seen[leg] += 1;
            }
            // Swings are without a jump: 3 cm in 75 steps of 2 ms at most, by the smooth step.
            assert!(step == 0 || moved < 3e-3, "{leg} at {step}: {moved}");
        }
        before = feet;
    }
    assert!(seen.iter().all(|steps| *steps > 100), "{seen:?}");
}

/// Restored in the middle of a swing.
#[test]
fn restored_captures_continue_bit_for_bit() {
    fn check(new: impl Fn() -> Box<dyn Process>, others: usize) {
        let mut original = new();
        let run = |process: &mut Box<dyn Process>, steps: std::ops::Range<i32>| {
            let step = |step: i32| {
                let mut inputs = vec![0.0; others];
                let velocity = 0.3 * libm::sin(0.1 * f64::from(step));
                inputs.extend([0.0, velocity, 0.0, 0.0, 0.0, 0.0]);
                let mut outputs = [0.0; 12];
                process.step(PERIOD, &inputs, &mut outputs);
                outputs.map(f64::to_bits)
            };
            steps.map(step).collect::<Vec<_>>()
        };
        run(&mut original, 0..230);
        let (saved, mut copy) = (original.save(), new());
        copy.restore(&saved).unwrap();
        assert_eq!(run(&mut original, 230..500), run(&mut copy, 230..500));
    }
    check(|| Box::new(capturing()), 0);
    let tegotae = || {
        let tegotae = Tegotae::new(&robot(), &LEGS, Gait::Trot, 1).unwrap();
        let mut tegotae = tegotae.with_abduction(Abduction::Capture).unwrap();
        set(&mut tegotae, "capture", 0.1);
        tegotae
    };
    check(|| Box::new(tegotae()), 4);
}

/// Steps to the side grow over the ramp, as all steps.
#[test]
fn steps_grow_over_the_ramp() {
    let mut cpg = steering();
    set(&mut cpg, "ramp", 1.0);
    set(&mut cpg, "turn", 0.4);
    let rows = run(&mut cpg, 1000, 12);
    let widest = |rows: &[Vec<f64>]| {
        let angles = rows.iter().flat_map(|row| &row[8..]);
        angles.fold(0.0_f64, |most, angle| most.max(angle.abs()))
    };
    let [first, second, last] = [&rows[..20], &rows[20..250], &rows[500..]].map(widest);
    assert!(
        first < 0.05 * last && second < 0.5 * last,
        "{first} {second} {last}"
    );
}

#[test]
fn feet_beyond_the_stops_of_abduction_are_out_of_reach() {
    // Within the reach of the leg, but for the joint.
    let low = || {
        let mut cpg = steering();
        set(&mut cpg, "hip_height/fore", 0.1);
        cpg
    };
    let mut cpg = low();
    set(&mut cpg, "lateral_offset/LF", 0.08);
    let rows = run(&mut cpg, 10, 12);
    assert!((rows[9][8] - 0.6).abs() < 1e-12, "{}", rows[9][8]);
    assert_eq!(cpg.out_of_reach(), 10);
    let violations = cpg.limit_violations();
    assert_eq!(violations.len(), 1);
    assert!(violations[0].part.contains("LF"), "{violations:?}");
    // From the foot at the stop to the target, 0.08 m beside a foot with an upright leg.
    let (robot, upright) = (robot(), run(&mut low(), 10, 12));
    let way = |(row, upright): (&Vec<f64>, &Vec<f64>)| {
        let ([_, y, z], [_, beside, height]) = (foot(&robot, 0, row), foot(&robot, 0, upright));
        libm::hypot(beside + 0.08 - y, height - z)
    };
    let farthest = rows.iter().zip(&upright).map(way).fold(0.0, f64::max);
    // A chord and its arc.
    let worst = violations[0].worst_m;
    assert!((worst / farthest - 1.0).abs() < 0.01, "{worst} {farthest}");
}

#[test]
fn steps_to_the_side_are_refused_without_steering_or_joints() {
    let refused = Cpg::new(&Robot::example(), &LEGS, Gait::Trot)
        .unwrap()
        .with_abduction(Abduction::Steer);
    assert!(matches!(refused, Err(GaitError::NoAbduction { ref name }) if name == "LF"));
    let tegotae = Tegotae::new(&Robot::example(), &LEGS, Gait::Trot, 1).unwrap();
    assert!(tegotae.with_abduction(Abduction::Steer).is_err());
    let mut hold = Cpg::new(&robot(), &LEGS, Gait::Trot)
        .unwrap()
        .with_abduction(Abduction::Hold)
        .unwrap();
    for name in ["turn", "sidestep", "lateral_offset/RH", "dead_band", "lead"] {
        let at = index(&hold, name);
        let refused = hold.set_variable(at, 0.01);
        assert!(
            matches!(refused, Err(VariableError::Refused { .. })),
            "{name}: {refused:?}"
        );
        hold.set_variable(at, 0.0).unwrap();
    }
    let mut unmeasured = steering();
    let capture = index(&unmeasured, "capture");
    let refused = unmeasured.set_variable(capture, 0.1);
    assert!(matches!(refused, Err(VariableError::Refused { .. })));
}
