//! Whole rigs.

use twinrig_kernel::stream;

use super::{digest_of, instance_of, with_scenario};
use crate::fmu::instance::FmuInstance;
use crate::fmu::part::FmuPart;
use crate::fmu::variables::FmuVariable;

#[test]
fn fingerprint_of_a_stepped_rig_is_that_of_its_run() {
    for scenario in ["trot.toml", "oncilla-trot.toml"] {
        with_scenario(scenario, &[("duration", "\"700 ms\"")], |assembly| {
            let mut instance = instance_of(assembly, FmuPart::Rig);
            let reference = instance.variables().fingerprint().unwrap();
            instance.begin().unwrap();
            let mut steps = stream(3, scenario);
            let mut now_s = 0.0;
            while now_s < 0.7 {
                let step_s = (1e-5 + 0.01 * steps.unit()).min(0.7 - now_s);
                instance.step(now_s, step_s).unwrap();
                now_s += step_s;
            }
            assert_eq!(instance.text(reference).unwrap(), digest_of(assembly));
        });
    }
}

#[test]
fn input_of_a_rig_is_a_change_at_the_next_control_step() {
    let change = r#"[{ at = "302 ms", set = "frequency", to = "3 Hz" }]"#;
    let duration = ("duration", "\"500 ms\"");
    let changed = with_scenario("trot.toml", &[duration, ("change", change)], digest_of);
    with_scenario("trot.toml", &[duration], |assembly| {
        let mut instance = instance_of(assembly, FmuPart::Rig);
        let fingerprint = instance.variables().fingerprint().unwrap();
        let frequency = input(&instance, "frequency");
        instance.begin().unwrap();
        // After the control step at this instant.
        instance.step(0.0, 0.3).unwrap();
        instance.set_numbers("Real", &[frequency], &[3.0]).unwrap();
        instance.step(0.3, 0.1).unwrap();
        // The same value again is no change.
        instance.set_numbers("Real", &[frequency], &[3.0]).unwrap();
        instance.step(0.4, 0.1).unwrap();
        assert_eq!(instance.text(fingerprint).unwrap(), changed);
        assert_ne!(digest_of(assembly), changed);
    });
}

/// Returns the value reference of an input.
fn input(instance: &FmuInstance, name: &str) -> u32 {
    let mut inputs = instance.variables().inputs();
    inputs.find(|it| it.name == name).unwrap().reference
}

#[test]
fn input_is_the_value_in_force_and_can_be_set_again_after_a_change_of_the_scenario() {
    let duration = ("duration", "\"500 ms\"");
    let once = r#"{ at = "101 ms", set = "frequency", to = "3 Hz" }"#;
    let twice = format!(r#"[{once}, {{ at = "302 ms", set = "frequency", to = "3.64 Hz" }}]"#);
    let once = format!("[{once}]");
    let expected = with_scenario("trot.toml", &[duration, ("change", &twice)], digest_of);
    with_scenario("trot.toml", &[duration, ("change", &once)], |assembly| {
        let mut instance = instance_of(assembly, FmuPart::Rig);
        let fingerprint = instance.variables().fingerprint().unwrap();
        let frequency = input(&instance, "frequency");
        let mut present = vec![];
        instance.begin().unwrap();
        let times_us = [
            0, 100_000, 200_000, 300_000, 300_700, 301_400, 302_000, 500_000,
        ];
        for window in times_us.windows(2) {
            let [from_s, to_s] = [window[0], window[1]].map(|us| f64::from(us) / 1e6);
            if from_s >= 0.3 {
                // Again and again, also while the first one is pending.
                instance.set_numbers("Real", &[frequency], &[3.64]).unwrap();
            }
            present.push(instance.number("Real", frequency).unwrap());
            instance.step(from_s, to_s - from_s).unwrap();
        }
        assert_eq!(present, [3.64, 3.64, 3.0, 3.64, 3.64, 3.64, 3.64]);
        assert_eq!(instance.text(fingerprint).unwrap(), expected);
        assert_ne!(digest_of(assembly), expected);
    });
}

#[test]
fn value_that_the_controller_refuses_is_refused_at_once_and_changes_nothing() {
    with_scenario("trot.toml", &[("duration", "\"200 ms\"")], |assembly| {
        let mut instance = instance_of(assembly, FmuPart::Rig);
        let [frequency, splay, duty] =
            ["frequency", "splay", "duty_factor/fore"].map(|name| input(&instance, name));
        for has_begun in [false, true] {
            if has_begun {
                instance.begin().unwrap();
                instance.step(0.0, 0.1).unwrap();
            }
            let before = instance.save(0).unwrap();
            for (other, value, why) in [
                (
                    splay,
                    0.3,
                    "splay = 0.3 is refused: abduction is not commanded",
                ),
                (duty, 1e-300, "duty_factor/fore = 1e-300 is refused"),
            ] {
                let refused = instance.set_numbers("Real", &[frequency, other], &[3.0, value]);
                let refused = refused.unwrap_err().to_string();
                assert!(refused.contains(why), "{refused}");
                assert_eq!(instance.save(0).unwrap(), before);
            }
        }
        // The check of an accepted value leaves no trace either.
        instance.set_numbers("Real", &[frequency], &[3.0]).unwrap();
        instance.set_numbers("Real", &[frequency], &[3.64]).unwrap();
        instance.step(0.1, 0.1).unwrap();
        let fingerprint = instance.variables().fingerprint().unwrap();
        assert_eq!(instance.text(fingerprint).unwrap(), digest_of(assembly));
    });
}

#[test]
fn bounds_of_inputs_are_the_last_values_in_range() {
    with_scenario("trot.toml", &[], |assembly| {
        let instance = instance_of(assembly, FmuPart::Rig);
        let rig = assembly.rig().unwrap();
        let mut inputs = instance.variables().inputs();
        for variable in rig.process().variables() {
            let input = inputs.find(|it| it.name == variable.name()).unwrap();
            let (min, max) = input.range;
            for (bound, outside) in [(min, min.map(f64::next_down)), (max, max.map(f64::next_up))] {
                assert!(bound.is_none_or(|it| variable.check(it).is_ok()));
                assert!(outside.is_none_or(|it| variable.check(it).is_err()));
            }
        }
    });
}

#[test]
fn outputs_before_the_start_are_those_of_time_zero_and_leave_no_trace() {
    let settings = [("duration", "\"100 ms\"")];
    with_scenario("trot.toml", &settings, |assembly| {
        let mut looked = instance_of(assembly, FmuPart::Rig);
        let outputs: Vec<u32> = {
            let outputs = looked.variables().outputs();
            outputs.flat_map(FmuVariable::references).collect()
        };
        let read = |instance: &mut FmuInstance| -> Vec<u64> {
            let values = outputs.iter();
            values
                .map(|it| instance.number("Real", *it).unwrap().to_bits())
                .collect()
        };
        let before = read(&mut looked);
        looked.begin().unwrap();
        assert_eq!(read(&mut looked), before);
        assert!(before.iter().any(|bits| *bits != 0));
        looked.step(0.0, 0.1).unwrap();
        let fingerprint = looked.variables().fingerprint().unwrap();
        assert_eq!(looked.text(fingerprint).unwrap(), digest_of(assembly));
    });
}
