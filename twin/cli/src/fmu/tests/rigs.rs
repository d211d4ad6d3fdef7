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
        let mut inputs = instance.variables().inputs();
        let frequency = inputs.find(|it| it.name == "frequency").unwrap().reference;
        drop(inputs);
        instance.begin().unwrap();
        // After the control step at this instant.
        instance.step(0.0, 0.3).unwrap();
        instance.set_number("Real", frequency, 3.0).unwrap();
        instance.step(0.3, 0.1).unwrap();
        // The same value again is no change.
        instance.set_number("Real", frequency, 3.0).unwrap();
        instance.step(0.4, 0.1).unwrap();
        assert_eq!(instance.text(fingerprint).unwrap(), changed);
        assert_ne!(digest_of(assembly), changed);
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
