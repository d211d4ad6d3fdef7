//! Tests of the complete controller.

use std::f64::consts::{FRAC_PI_2, PI};

use proptest::prelude::*;
use twinrig_kernel::{SimDuration, Snapshot};
use twinrig_robot::Robot;
use twinrig_runtime::{Process, ProcessVariable, VariableError};

use crate::{Plan, Script, ScriptError, Shape};

const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];

fn script(plan: Plan) -> Script {
    Script::new(&Robot::example(), &LEGS, &plan).unwrap()
}

fn set(script: &mut Script, name: &str, value: f64) -> Result<(), VariableError> {
    let mut names = script.variables().iter().map(ProcessVariable::name);
    let index = names.position(|known| known == name).unwrap();
    script.set_variable(index, value)
}

fn step(script: &mut Script, elapsed: SimDuration) -> Vec<f64> {
    let mut outputs = vec![0.0; script.ports().len()];
    script.step(elapsed, &[], &mut outputs);
    outputs
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

fn plans() -> impl Strategy<Value = Plan> {
    let shape = || prop::sample::select(Shape::ALL.to_vec());
    (shape(), shape(), -7.0..7.0_f64, any::<bool>()).prop_map(
        |(hip, knee, phase_lag, abduction)| Plan {
            hip,
            knee,
            phase_lag,
            abduction,
        },
    )
}

#[test]
fn commands_are_offset_plus_amplitude_times_shape() {
    let mut script = script(Plan {
        hip: Shape::Triangle,
        knee: Shape::Steps,
        ..Plan::default()
    });
    for (name, value) in [
        ("offset/hip", 0.25),
        ("amplitude/hip", 0.5),
        ("frequency/hip", 2.0),
        ("offset/knee", 1.0),
        ("amplitude/knee", 0.75),
        ("frequency/knee", 1.0),
    ] {
        set(&mut script, name, value).unwrap();
    }
    let leg =
        |script: &mut Script, millis| step(script, SimDuration::from_millis(millis))[..2].to_vec();
    assert_eq!(leg(&mut script, 0), [0.25, 1.75]);
    assert_eq!(leg(&mut script, 125), [0.75, 1.75]);
    assert_eq!(leg(&mut script, 250), [-0.25, 1.75]);
    assert_eq!(leg(&mut script, 125), [0.25, 0.25]);
}

#[test]
fn abductions_follow_the_drives_and_are_mirrored() {
    let mut script = script(Plan {
        abduction: true,
        ..Plan::default()
    });
    let names: Vec<_> = script.ports().into_iter().map(|port| port.name).collect();
    assert_eq!(
        names[..3],
        [
            "leg/LF/hip/command",
            "leg/LF/knee/command",
            "leg/RF/hip/command"
        ]
    );
    assert_eq!(
        names[8..],
        LEGS.map(|leg| format!("leg/{leg}/abduction/command"))
    );
    set(&mut script, "splay", 0.2).unwrap();
    assert_eq!(
        step(&mut script, SimDuration::ZERO)[8..],
        [0.2, -0.2, 0.2, -0.2]
    );
}

#[test]
fn plant_with_hips_only_receives_the_same_hip_commands() {
    let plan = Plan {
        hip: Shape::Sine,
        knee: Shape::Ramp,
        phase_lag: 1.0,
        abduction: true,
    };
    let all = ["LF", "RF", "LH", "RH"].map(|leg| format!("leg/{leg}/hip/command"));
    let (mut both, mut hips) = (script(plan), script(plan).for_plant(&all));
    let names: Vec<_> = hips.ports().into_iter().map(|port| port.name).collect();
    assert_eq!(names[..4], all);
    assert_eq!(names.len(), 8);
    let late = SimDuration::from_millis(300);
    let (both, hips) = (step(&mut both, late), step(&mut hips, late));
    let expected = [0, 2, 4, 6, 8, 9, 10, 11].map(|n| both[n]);
    assert_eq!(bits(&hips), bits(&expected));
    // A knee input of one leg enables the knees of all legs (a wiring error later); without any
    // input all drives remain.
    let knee = [&all[..], &["leg/RH/knee/command".to_owned()]].concat();
    assert_eq!(script(plan).for_plant(&knee).ports().len(), 12);
    assert_eq!(script(plan).for_plant(&[]).ports().len(), 12);
}

#[test]
fn abduction_signals_and_splay_require_abduction() {
    let mut script = script(Plan::default());
    assert_eq!(script.ports().len(), 8);
    set(&mut script, "splay", 0.0).unwrap();
    let error = set(&mut script, "splay", 0.1).unwrap_err();
    assert!(matches!(error, VariableError::Refused { .. }), "{error}");
}

#[test]
fn each_leg_lags_the_one_before_it() {
    let mut late = script(Plan {
        hip: Shape::Sine,
        phase_lag: FRAC_PI_2,
        ..Plan::default()
    });
    let first = step(&mut late, SimDuration::from_secs(5));
    let expected = [0.0, -0.1, 0.0, 0.1];
    for (leg, expected) in expected.into_iter().enumerate() {
        assert!((first[2 * leg] - expected).abs() < 1e-15, "{first:?}");
    }
}

#[test]
fn ramp_with_a_lag_starts_the_legs_in_sequence() {
    let mut script = script(Plan {
        hip: Shape::Ramp,
        phase_lag: PI,
        ..Plan::default()
    });
    let at = |outputs: Vec<f64>| [0, 2, 4, 6].map(|hip| outputs[hip]);
    assert_eq!(
        at(step(&mut script, SimDuration::from_millis(500))),
        [0.05, 0.0, 0.0, 0.0]
    );
    assert_eq!(
        at(step(&mut script, SimDuration::from_secs(1))),
        [0.1, 0.1, 0.05, 0.0]
    );
}

#[test]
fn new_frequency_continues_from_the_present_phase() {
    let mut script = script(Plan {
        hip: Shape::Triangle,
        knee: Shape::Ramp,
        ..Plan::default()
    });
    let before = step(&mut script, SimDuration::from_millis(125));
    set(&mut script, "frequency/hip", 0.0).unwrap();
    set(&mut script, "frequency/knee", 7.0 / 8.0).unwrap();
    let after = step(&mut script, SimDuration::from_secs(1));
    assert_eq!((before[0], after[0]), (0.05, 0.05));
    assert_eq!((before[1], after[1]), (0.5125, 0.6));
}

#[test]
fn values_out_of_range_are_rejected_without_effect() {
    let mut script = script(Plan::default());
    let before = script.save();
    for (name, value) in [
        ("frequency/hip", -0.1),
        ("frequency/knee", f64::INFINITY),
        ("amplitude/hip", 101.0),
        ("offset/knee", f64::NAN),
        ("splay", 1.6),
    ] {
        let error = set(&mut script, name, value).unwrap_err().to_string();
        assert!(error.contains(name), "{error}");
    }
    let error = script.set_variable(7, 0.0).unwrap_err();
    assert_eq!(error, VariableError::NoSuchIndex { index: 7, count: 7 });
    assert_eq!(script.save(), before);
}

#[test]
fn invalid_scripts_are_typed_errors() {
    let robot = Robot::example();
    let error = Script::new(&robot, &["LF", "XY"], &Plan::default()).unwrap_err();
    let known = "LF, RF, LH, RH".to_owned();
    assert_eq!(
        error,
        ScriptError::UnknownLeg {
            name: "XY".to_owned(),
            known
        }
    );
    for phase_lag in [f64::NAN, f64::INFINITY, 1e4] {
        let plan = Plan {
            phase_lag,
            ..Plan::default()
        };
        assert!(matches!(
            Script::new(&robot, &LEGS, &plan),
            Err(ScriptError::OutOfRange { .. })
        ));
    }
    assert!(Plan::default().with_shape("ankle", Shape::Sine).is_err());
    assert!(
        script(Plan::default())
            .restore(&Snapshot(vec![1, 2, 3]))
            .is_err()
    );
    assert!(
        script(Plan::default())
            .restore(&Snapshot::of(&(vec![0.0], ((), ()))))
            .is_err()
    );
}

#[test]
fn step_allocates_nothing() {
    let plan = Plan {
        hip: Shape::Sine,
        knee: Shape::Triangle,
        phase_lag: 1.0,
        abduction: true,
    };
    let mut script = script(plan);
    let mut outputs = [0.0; 12];
    let counted = allocation_counter::measure(|| {
        for _ in 0..1000 {
            script.step(SimDuration::from_millis(2), &[], &mut outputs);
        }
    });
    assert_eq!(counted.count_total, 0);
}

proptest! {
    #[test]
    fn commands_depend_on_the_total_time_only(
        plan in plans(), pieces in prop::collection::vec(0..3_000_000_000_u64, 1..40), frequency in 0.0..1000.0_f64,
    ) {
        let (mut one, mut many) = (script(plan), script(plan));
        for script in [&mut one, &mut many] {
            set(script, "frequency/hip", frequency).unwrap();
        }
        let sum = pieces.iter().sum();
        for &piece in &pieces[1..] {
            step(&mut many, SimDuration::from_nanos(piece));
        }
        let last = step(&mut many, SimDuration::from_nanos(pieces[0]));
        prop_assert_eq!(bits(&step(&mut one, SimDuration::from_nanos(sum))), bits(&last));
    }

    #[test]
    fn removing_a_leg_changes_no_bit_of_the_others(plan in plans(), millis in 0..100_000_u64) {
        let elapsed = SimDuration::from_millis(millis);
        let all = step(&mut script(plan), elapsed);
        let some = step(&mut Script::new(&Robot::example(), &["RF", "RH"], &plan).unwrap(), elapsed);
        prop_assert_eq!(bits(&all[2..4]), bits(&some[..2]));
        prop_assert_eq!(bits(&all[6..8]), bits(&some[2..4]));
    }

    #[test]
    fn restored_controller_continues_bit_for_bit(
        plan in plans(), warm in 0..10_000_000_000_u64, frequency in 0.0..50.0_f64, later in 0..10_000_000_000_u64,
    ) {
        let mut original = script(plan);
        step(&mut original, SimDuration::from_nanos(warm));
        set(&mut original, "frequency/knee", frequency).unwrap();
        let mut copy = script(plan);
        copy.restore(&original.save()).unwrap();
        let later = SimDuration::from_nanos(later);
        prop_assert_eq!(bits(&step(&mut original, later)), bits(&step(&mut copy, later)));
        prop_assert_eq!(original.save(), copy.save());
    }

    #[test]
    fn commands_are_finite_for_any_variables(
        plan in plans(),
        values in prop::collection::vec((0..7_usize, prop_oneof![-200.0..2000.0_f64, any::<f64>()], 0..u64::MAX >> 8), 0..40),
    ) {
        let mut script = script(plan);
        for (index, value, nanos) in values {
            // Many values are out of range: an error, and the variable is unchanged.
            let _ = script.set_variable(index, value);
            let outputs = step(&mut script, SimDuration::from_nanos(nanos));
            prop_assert!(outputs.iter().all(|output| output.is_finite()), "{outputs:?}");
        }
    }
}
