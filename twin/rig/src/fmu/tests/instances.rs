//! Refusals, faults, resources and archives.

use std::path::Path;

use twinrig_kernel::{SimTime, Snapshot};
use twinrig_runtime::{Group, RigError};

use super::{instance_of, with_scenario};
use crate::fmu::archive::archive;
use crate::fmu::error::FmuError;
use crate::fmu::instance::FmuInstance;
use crate::fmu::part::{FmuPart, Simulated};
use crate::fmu::resources::{MANIFEST, Resources};
use crate::fmu::variables::FmuVariable;

#[test]
fn bytes_that_are_no_state_of_the_fmu_are_refused() {
    let settings = [("duration", "\"100 ms\"")];
    with_scenario("trot.toml", &settings, |assembly| {
        for part in FmuPart::ALL {
            let instance = instance_of(assembly, part);
            let state = instance.save(0).unwrap();
            let bytes = instance.serialise(&state);
            assert_eq!(instance.deserialise(&bytes).unwrap(), state);
            for length in (0..bytes.len()).step_by(7) {
                assert!(instance.deserialise(&bytes[..length]).is_err());
            }
            for at in (0..bytes.len()).step_by(13) {
                let mut changed = bytes.clone();
                changed[at] ^= 1;
                assert!(instance.deserialise(&changed).is_err());
            }
            let mut other = with_scenario("trot.toml", &[("seed", "2")], |assembly| {
                instance_of(assembly, part)
            });
            assert!(other.deserialise(&bytes).is_err());
            let refused = other.restore(&state).unwrap_err().to_string();
            assert!(refused.contains("saved by another one"), "{refused}");
            // Nor do bytes that another instance makes of it.
            assert!(other.deserialise(&other.serialise(&state)).is_err());
        }
    });
}

#[test]
fn stop_time_is_of_the_experiment_and_start_time_of_the_state() {
    with_scenario("trot.toml", &[], |assembly| {
        let mut first = instance_of(assembly, FmuPart::Plant);
        first.set_experiment(100.0, Some(101.0)).unwrap();
        first.begin().unwrap();
        first.step(100.0, 1.0).unwrap();
        let state = first.save(0).unwrap();
        for (stop_s, is_allowed) in [
            (None, true),
            (Some(102.0), true),
            (Some(101.25), false),
            // Beyond the clock: none.
            (Some(f64::INFINITY), true),
            (Some(1e300), true),
        ] {
            let mut second = instance_of(assembly, FmuPart::Plant);
            second.set_experiment(0.0, stop_s).unwrap();
            second.restore(&state).unwrap();
            assert_eq!(second.time_s(), 101.0);
            let stepped = second.step(101.0, 0.5);
            assert_eq!(stepped.is_ok(), is_allowed, "{stop_s:?}");
        }
        let refused = first.set_experiment(1.7e9, None).unwrap_err().to_string();
        assert!(
            refused.contains("cannot start at 1700000000.0 s"),
            "{refused}"
        );
        assert!(first.set_experiment(0.0, Some(f64::NAN)).is_err());
        let refused = first.set_experiment(-1e300, None).unwrap_err().to_string();
        assert!(refused.contains("-1e300 s"), "{refused}");
    });
}

#[test]
fn refused_steps_and_values_change_nothing() {
    with_scenario("trot.toml", &[], |assembly| {
        for part in FmuPart::ALL {
            let mut instance = instance_of(assembly, part);
            instance.set_experiment(100.0, Some(101.0)).unwrap();
            instance.begin().unwrap();
            instance.step(100.0, 0.5).unwrap();
            let before = instance.save(0).unwrap();
            for (current_s, step_s) in [
                (100.0, 0.4),
                (0.0, 0.5),
                (100.5, 0.6),
                // Negative, also where it ends at the present time or later.
                (100.5, -0.1),
                (100.7, -0.1),
                // From another time than the present one.
                (100.4, 0.2),
                (100.6, 0.1),
                (100.5 + 1.2e-6, 0.1),
                (f64::NAN, 0.1),
                (100.5, f64::INFINITY),
                (-1e300, 0.0),
            ] {
                let refused = instance.step(current_s, step_s);
                assert!(refused.is_err(), "{current_s} {step_s}");
            }
            let input = instance.variables().inputs().next().unwrap().clone();
            for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let refused = instance.set_numbers("Real", &[input.reference], &[value]);
                let message = refused.unwrap_err().to_string();
                assert!(message.contains(&input.name), "{message}");
            }
            if let (_, Some(most)) = input.range {
                let refused = instance.set_numbers("Real", &[input.reference], &[1.01 * most]);
                assert!(matches!(refused, Err(FmuError::OutOfRange(_))));
            }
            if let (Some(least), _) = input.range {
                let below = least - 1e-3;
                let refused = instance.set_numbers("Real", &[input.reference], &[below]);
                assert!(matches!(refused, Err(FmuError::OutOfRange(_))));
            }
            assert!(input.range.0.is_some(), "{}", input.name);
            let output = instance.variables().outputs().next().unwrap().reference;
            assert!(instance.set_numbers("Real", &[output], &[0.0]).is_err());
            assert!(instance.set_numbers("Real", &[u32::MAX], &[0.0]).is_err());
            // All or none.
            let start = instance.number("Real", input.reference).unwrap();
            for (other, value) in [(output, 0.0), (0, 0.0), (input.reference + 1, f64::NAN)] {
                let references = [input.reference, other];
                let refused = instance.set_numbers("Real", &references, &[0.9 * start, value]);
                assert!(refused.is_err());
            }
            assert_eq!(instance.save(0).unwrap(), before);
            // Half a nanosecond is no step.
            instance.step(100.5, 4e-10).unwrap();
            assert_eq!(instance.save(0).unwrap(), before);
            // A rounding error of the master is none of the step's.
            instance.step(100.5 - 1e-6, 0.1 + 1e-6).unwrap();
            assert_eq!(instance.time_s(), 100.6);
        }
    });
}

#[test]
fn resources_are_read_back_and_checked() {
    let folder = std::env::temp_dir().join(format!("twinrig-fmu-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let write = |files: &[(&str, Vec<u8>)]| {
        for (name, bytes) in files {
            std::fs::write(folder.join(name), bytes).unwrap();
        }
    };
    with_scenario("bench.toml", &[("duration", "\"1 s\"")], |assembly| {
        let resources = Resources::of(assembly, FmuPart::Rig);
        let token = resources.token();
        write(&resources.files());
        let kept = std::fs::read(folder.join("bench.toml")).unwrap();
        assert!(FmuInstance::of_resources(&folder, &token).is_ok());
        let uri = format!("file://{}", folder.display());
        assert!(FmuInstance::of_location(&uri, &token).is_ok());
        let refused = |place: &Path, token: &str, expected: &str| {
            let message = FmuInstance::of_resources(place, token).err().unwrap();
            let message = message.to_string();
            assert!(message.contains(expected), "{message}");
        };
        refused(&folder, "{other}", "export the FMU again");
        refused(&folder.join("nowhere"), &token, "cannot be read");
        // One byte of a file.
        write(&[("bench.toml", [&kept[..], b"\n"].concat())]);
        refused(&folder, &token, "export the FMU again");
        std::fs::remove_file(folder.join("bench.toml")).unwrap();
        refused(&folder, &token, "bench.toml");
        let manifest = std::fs::read_to_string(folder.join(MANIFEST)).unwrap();
        let changed = |from: &str, to: &str| {
            assert!(manifest.contains(from), "{manifest}");
            write(&[(MANIFEST, manifest.replace(from, to).into_bytes())]);
        };
        changed("bench.toml", "../bench.toml");
        refused(&folder, &token, "no name of a file");
        changed("\"version\": \"", "\"version\": \"9");
        refused(&folder, &token, "its library has version");
        changed("\"rig\"", "\"engine\"");
        refused(&folder, &token, "cannot be parsed");
    });
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn equal_contents_give_equal_archives() {
    let large = vec![7_u8; 300_000];
    let files = [
        ("modelDescription.xml".to_owned(), &b"<a/>"[..]),
        ("binaries/linux64/a.so".to_owned(), &large[..]),
    ];
    let bytes = archive(&files).unwrap();
    assert_eq!(archive(&files).unwrap(), bytes);
    let mut read = zip::ZipArchive::new(std::io::Cursor::new(bytes)).unwrap();
    for (n, (name, content)) in files.iter().enumerate() {
        let mut file = read.by_index(n).unwrap();
        let mut back = Vec::new();
        std::io::copy(&mut file, &mut back).unwrap();
        assert_eq!((file.name().unwrap(), &back[..]), (name.into(), *content));
        // No time of the machine.
        assert_eq!(file.last_modified(), Some(zip::DateTime::default()));
    }
}

#[test]
fn failed_plant_names_its_fault_and_continues_from_a_saved_state() {
    // Legs that follow any command, however fast.
    let settings = [("actuator", "{ kind = \"ideal\" }")];
    with_scenario("trot.toml", &settings, |assembly| {
        let mut instance = instance_of(assembly, FmuPart::Plant);
        instance.begin().unwrap();
        instance.step(0.0, 0.1).unwrap();
        let state = instance.save(0).unwrap();
        let inputs = instance.variables().inputs();
        let inputs: Vec<u32> = inputs.flat_map(FmuVariable::references).collect();
        let sound: Vec<f64> = inputs
            .iter()
            .map(|it| instance.number("Real", *it).unwrap())
            .collect();
        for (n, input) in inputs.iter().enumerate() {
            // The ends of the commands' range.
            let value = if n % 2 == 0 { 100.0 } else { -100.0 };
            instance.set_numbers("Real", &[*input], &[value]).unwrap();
        }
        let failed = instance.step(0.1, 1.0).unwrap_err();
        assert!(
            matches!(failed, FmuError::Failed(RigError::Plant(_))),
            "{failed}"
        );
        assert!(failed.to_string().contains("failed at"), "{failed}");
        instance.restore(&state).unwrap();
        let restored = inputs
            .iter()
            .map(|it| instance.number("Real", *it).unwrap());
        assert_eq!(restored.collect::<Vec<_>>(), sound);
        instance.step(0.1, 0.1).unwrap();
        let mut untroubled = instance_of(assembly, FmuPart::Plant);
        untroubled.begin().unwrap();
        untroubled.step(0.0, 0.1).unwrap();
        untroubled.step(0.1, 0.1).unwrap();
        assert_eq!(instance.save(0).unwrap(), untroubled.save(0).unwrap());
    });
}

/// A part with a bug.
struct Panicking;

impl Simulated for Panicking {
    fn input(&self, _: usize) -> f64 {
        0.0
    }
    fn set_inputs(&mut self, _: &[(usize, f64)]) -> Result<(), RigError> {
        Ok(())
    }
    fn begin(&mut self) -> Result<(), RigError> {
        Ok(())
    }
    fn advance(&mut self, _: SimTime) -> Result<(), RigError> {
        panic!("out of cheese");
    }
    fn now(&self) -> SimTime {
        SimTime::ZERO
    }
    fn observe(&mut self) -> Result<(), RigError> {
        Ok(())
    }
    fn output(&self, _: Group, _: usize) -> f64 {
        0.0
    }
    fn fingerprint(&self) -> Option<String> {
        None
    }
    fn save(&self) -> Snapshot {
        panic!("out of bread");
    }
    fn restore(&mut self, _: &Snapshot) -> Result<(), RigError> {
        Ok(())
    }
}

#[test]
fn panic_of_a_part_is_fatal_for_its_instance() {
    with_scenario("trot.toml", &[], |assembly| {
        let mut instance = instance_of(assembly, FmuPart::Plant);
        instance.replace_part(Box::new(Panicking));
        let panicked = instance.step(0.0, 0.1).unwrap_err();
        assert!(panicked.is_fatal());
        assert!(panicked.to_string().contains("out of cheese"), "{panicked}");
        let panicked = instance.save(0).unwrap_err();
        assert!(panicked.to_string().contains("out of bread"), "{panicked}");
        // Another instance is not affected.
        let mut other = instance_of(assembly, FmuPart::Plant);
        other.step(0.0, 0.1).unwrap();
    });
}
