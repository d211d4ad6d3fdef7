//! Tests of the controller with feedback.

use std::f64::consts::{PI, TAU};

use proptest::prelude::*;
use twinrig_kernel::{Direction, SimDuration, Snapshot};
use twinrig_robot::Robot;
use twinrig_runtime::{Process, ProcessVariable};

use super::{LEGS, PERIOD, bits, set};
use crate::{Cpg, FixedPoint, Gait, GaitError, Tegotae, TegotaeStart};

fn tegotae() -> Tegotae {
    Tegotae::new(&Robot::example(), &LEGS, Gait::Trot, 7).unwrap()
}

/// Runs under loads that vary in time, from 0 to 8 N.
fn run(process: &mut Tegotae, steps: usize, width: usize) -> Vec<Vec<f64>> {
    let mut outputs = vec![0.0; width];
    let step = |n: usize| {
        let load = |leg: usize| (4.0 * libm::sin(0.03 * (n as f64) + leg as f64) + 4.0).max(0.0);
        process.step(PERIOD, &[0, 1, 2, 3].map(load), &mut outputs);
        outputs.clone()
    };
    (0..steps).map(step).collect()
}

#[test]
fn variables_are_those_of_cpg_without_network_and_duty_factor() {
    let robot = Robot::example();
    let names = |variables: &[ProcessVariable]| -> Vec<String> {
        variables.iter().map(|one| one.name().to_owned()).collect()
    };
    let of_cpg = names(&Cpg::variables_of(&robot, Gait::Trot).unwrap());
    let network = ["frequency", "coupling", "duty_factor", "phase_difference"];
    let is_of_locus = |name: &String| network.iter().all(|own| !name.starts_with(own));
    let own = ["excitation", "feedback", "load_lag", "phase_noise"];
    let mut found = names(&Tegotae::variables_of(&robot).unwrap());
    found.retain(|name| !own.contains(&name.as_str()));
    assert_eq!(found.len() + own.len(), tegotae().variables().len());
    let expected: Vec<String> = of_cpg.into_iter().filter(is_of_locus).collect();
    assert_eq!(found, expected);
}

#[test]
fn load_of_a_leg_acts_on_that_leg_alone() {
    let (mut free, mut loaded) = (tegotae(), tegotae());
    let mut outputs = [0.0; 8];
    for _ in 0..40 {
        free.step(PERIOD, &[0.0; 4], &mut outputs);
        loaded.step(PERIOD, &[0.0, 0.0, 5.0, 0.0], &mut outputs);
    }
    let changed: Vec<bool> = (0..4)
        .map(|leg| free.phase(leg) != loaded.phase(leg))
        .collect();
    assert_eq!(changed, [false, false, true, false]);
}

#[test]
fn without_load_the_controller_is_the_open_loop_one_with_a_duty_factor_of_one_half() {
    let (mut tegotae, mut cpg) = (tegotae(), super::cpg(Gait::Trot));
    set(&mut cpg, "duty_factor/fore", 0.5);
    set(&mut cpg, "duty_factor/hind", 0.5);
    let (mut a, mut b) = ([0.0; 8], [0.0; 8]);
    for _ in 0..600 {
        tegotae.step(PERIOD, &[0.0; 4], &mut a);
        cpg.step(PERIOD, &[], &mut b);
        for (a, b) in a.into_iter().zip(b) {
            assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
    }
}

#[test]
fn standing_legs_stay_until_the_excitation_rises() {
    let mut standing = tegotae().with_start(TegotaeStart::MidStance);
    set(&mut standing, "excitation", 0.0);
    let mut outputs = [0.0; 8];
    for load in [0.0, 2.7, 100.0, 2.7] {
        standing.step(SimDuration::from_millis(500), &[load; 4], &mut outputs);
    }
    for leg in 0..4 {
        assert!((standing.phase(leg) - 1.5 * PI).abs() < 1e-12);
    }
    set(&mut standing, "feedback", 0.3);
    for (excitation, walks) in [(0.7, false), (0.9, true)] {
        // 0.3 rad/(N·s) · 2.7 N = 0.81 rad/s
        set(&mut standing, "excitation", excitation);
        standing.step(SimDuration::from_secs(1), &[2.7; 4], &mut outputs);
        assert_eq!((standing.phase(0) - 1.5 * PI).abs() > 1e-9, walks);
    }
}

#[test]
fn fixed_point_is_that_of_the_rule() {
    for (rule, expected) in [
        (FixedPoint::Compensated, -PI / 2.0),
        (FixedPoint::Plain, -PI / 3.0),
    ] {
        let mut leg = tegotae().with_fixed_point(rule);
        set(&mut leg, "excitation", 1.0);
        set(&mut leg, "feedback", 0.5);
        leg.step(SimDuration::from_secs(60), &[4.0; 4], &mut [0.0; 8]);
        assert!(
            (leg.phase(0) - (expected + TAU)).abs() < 1e-9,
            "{}",
            leg.phase(0)
        );
    }
}

#[test]
fn negative_excitation_passes_through_the_cycle_backwards() {
    let mut back = tegotae();
    set(&mut back, "excitation", -5.0);
    back.step(SimDuration::from_millis(100), &[0.0; 4], &mut [0.0; 8]);
    assert!((back.phase(0) - (TAU - 0.5)).abs() < 1e-12);
}

#[test]
fn phase_noise_is_a_wiener_process_for_any_step() {
    let legs = 4;
    let runs = 400;
    for steps in [1, 8] {
        let mut squares = 0.0;
        for seed in 0..runs {
            let start = TegotaeStart::MidStance;
            let noisy = Tegotae::new(&Robot::example(), &LEGS, Gait::Trot, seed).unwrap();
            let mut noisy = noisy.with_start(start);
            set(&mut noisy, "excitation", 0.0);
            set(&mut noisy, "phase_noise", 0.1);
            for _ in 0..steps {
                noisy.step(
                    SimDuration::from_millis(4000 / steps),
                    &[0.0; 4],
                    &mut [0.0; 8],
                );
            }
            squares += (0..legs)
                .map(|leg| noisy.phase(leg) - 1.5 * PI)
                .map(|deviation| deviation * deviation)
                .sum::<f64>();
            assert_ne!(noisy.phase(0), noisy.phase(1));
        }
        // Of 1600 samples, within five standard errors.
        let variance = squares / (runs * legs as u64) as f64;
        assert!((variance / 0.04 - 1.0).abs() < 0.18, "{variance}");
    }
}

#[test]
fn load_signals_are_named_by_leg() {
    let inputs = |process: &Tegotae| -> Vec<String> {
        let ports = process.ports().into_iter();
        let inputs = ports.filter(|port| port.direction == Direction::Input);
        inputs.map(|port| port.to_string()).collect()
    };
    let two = Tegotae::new(&Robot::example(), &["LF", "RH"], Gait::Trot, 1).unwrap();
    assert_eq!(
        inputs(&two),
        ["leg/LF/foot/load [N]", "leg/RH/foot/load [N]"]
    );
    let boards = two.clone().with_load("board-*/force", Some(2)).unwrap();
    assert_eq!(
        inputs(&boards),
        ["board-LF/force [N] × 3", "board-RH/force [N] × 3"]
    );
    let error = two.clone().with_load("board/force", None).unwrap_err();
    assert!(matches!(error, GaitError::OneLoad { .. }));
    assert!(two.with_load("*", Some(3)).is_err());
    Tegotae::new(&Robot::example(), &["LF"], Gait::Trot, 1)
        .and_then(|one| one.with_load("board/force", None))
        .unwrap();
}

#[test]
fn component_of_a_force_is_its_load() {
    let mut scalar = tegotae();
    let mut force = tegotae().with_load("leg/*/foot/force", Some(2)).unwrap();
    let inputs = [1.0, 5.0, 0.0, 3.0].map(|load| [7.0, -7.0, load]);
    scalar.step(PERIOD, &[1.0, 5.0, 0.0, 3.0], &mut [0.0; 8]);
    force.step(PERIOD, inputs.as_flattened(), &mut [0.0; 8]);
    assert_eq!(scalar.save(), force.save());
}

#[test]
fn loads_that_are_none_act_as_none() {
    for load in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -5.0, -0.0] {
        let (mut free, mut broken) = (tegotae(), tegotae());
        set(&mut free, "load_lag", 0.01);
        set(&mut broken, "load_lag", 0.01);
        // The filter holds a load when they begin.
        free.step(PERIOD, &[4.0; 4], &mut [0.0; 8]);
        broken.step(PERIOD, &[4.0; 4], &mut [0.0; 8]);
        for n in 0..100 {
            free.step(PERIOD, &[0.0; 4], &mut [0.0; 8]);
            broken.step(PERIOD, &[load; 4], &mut [0.0; 8]);
            assert_eq!(free.phase(1), broken.phase(1), "{load} {n}");
        }
    }
}

#[test]
fn phases_and_frequency_are_monitors_behind_the_commands() {
    let monitored = tegotae()
        .with_phase_output()
        .with_frequency_of("RH")
        .unwrap();
    let mut monitored = monitored;
    let (mut plain, mut outputs) = (tegotae(), [0.0; 13]);
    let mut commands = [0.0; 8];
    for _ in 0..400 {
        plain.step(PERIOD, &[2.0; 4], &mut commands);
        monitored.step(PERIOD, &[2.0; 4], &mut outputs);
        assert_eq!(outputs[..8], commands);
        assert_eq!(outputs[8..12], [0, 1, 2, 3].map(|leg| plain.phase(leg)));
    }
    // Under a constant load the mean phase rate is √(ω² − (σF)²)/2π.
    let (omega, force) = (6.0 * PI, 0.3 * 2.0);
    let mean = (omega * omega - force * force).sqrt() / TAU;
    assert!((outputs[12] - mean).abs() < 0.02 * mean, "{}", outputs[12]);
    let names: Vec<String> = monitored
        .ports()
        .into_iter()
        .map(|port| port.name)
        .collect();
    let phases = LEGS.map(|leg| format!("leg/{leg}/phase"));
    assert_eq!(names[12..16], phases);
    assert_eq!(names[16..], ["leg/RH/frequency"]);
    let monitors: Vec<bool> = names
        .iter()
        .map(|name| monitored.is_monitor(name))
        .collect();
    assert_eq!(monitors, [[false; 12].as_slice(), &[true; 5]].concat());
}

#[test]
fn step_allocates_nothing() {
    let mut process = tegotae().with_phase_output();
    set(&mut process, "phase_noise", 0.1);
    set(&mut process, "load_lag", 0.005);
    let mut outputs = [0.0; 12];
    let counted = allocation_counter::measure(|| {
        for _ in 0..1000 {
            process.step(PERIOD, &[3.0; 4], &mut outputs);
        }
    });
    assert_eq!(counted.count_total, 0);
}

#[test]
fn snapshot_of_another_controller_is_a_typed_error() {
    let mut process = tegotae();
    let before = process.save();
    let mut three = Robot::example();
    three.legs.pop();
    let others = [
        Tegotae::new(&three, &["LF"], Gait::Trot, 1).unwrap().save(),
        super::cpg(Gait::Trot).save(),
        Snapshot(vec![1, 2, 3]),
    ];
    assert!(others.iter().all(|other| process.restore(other).is_err()));
    assert_eq!(process.save(), before);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn restored_controller_continues_bit_for_bit(
        warm in 0..300_usize, seed in any::<u64>(), noise in prop_oneof![Just(0.0), 0.0..0.5_f64],
        lag in 0.0..0.05_f64, omega in -30.0..30.0_f64,
    ) {
        let new = |seed| Tegotae::new(&Robot::example(), &LEGS, Gait::Pace, seed).unwrap();
        let mut original = new(seed).with_start(TegotaeStart::Random);
        set(&mut original, "phase_noise", noise);
        set(&mut original, "load_lag", lag);
        set(&mut original, "excitation", omega);
        run(&mut original, warm, 8);
        let snapshot = original.save();
        let mut copy = new(0);
        copy.restore(&snapshot).unwrap();
        prop_assert_eq!(bits(&run(&mut original, 300, 8)), bits(&run(&mut copy, 300, 8)));
        prop_assert_eq!(original.save(), copy.save());
    }

    #[test]
    fn outputs_are_finite_for_any_variables_and_loads(
        values in prop::collection::vec((0..33_usize, prop_oneof![-10.0..10.0_f64, any::<f64>()]), 0..40),
        loads in prop::array::uniform4(any::<f64>()), millis in 0..10_000_u64, plain in any::<bool>(),
    ) {
        let rule = if plain { FixedPoint::Plain } else { FixedPoint::Compensated };
        let mut process = tegotae().with_fixed_point(rule).with_phase_output();
        for (index, value) in values {
            // Most values are out of range: an error, and the variable is unchanged.
            let _ = process.set_variable(index, value);
            let mut outputs = [0.0; 12];
            process.step(SimDuration::from_millis(millis), &loads, &mut outputs);
            prop_assert!(outputs.iter().all(|output| output.is_finite()), "{:?}", outputs);
            prop_assert!(outputs[8..].iter().all(|phase| (0.0..TAU).contains(phase)));
            let saved = process.save();
            prop_assert!(process.restore(&saved).is_ok());
        }
    }
}
