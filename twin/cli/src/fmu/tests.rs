use std::path::{Path, PathBuf};

use proptest::prelude::*;
use twinrig_kernel::{Port, SimDuration, SimTime, Stream, stream};
use twinrig_record::Fingerprint;
use twinrig_runtime::{Plant, PlantFault};
use twinrig_scenario::Setting;

use super::archive::archive;
use super::instance::FmuInstance;
use super::part::FmuPart;
use super::plant_part::PlantPart;
use super::resources::{MANIFEST, Resources};
use super::variables::FmuVariable;
use crate::assembly::Assembly;
use crate::assembly::registry::Registry;
use crate::run::execute::{Execution, execute};

fn path(scenario: &str) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    root.join("scenarios").join(scenario)
}

/// Calls `body` with a scenario under settings, without its expectations.
fn with_scenario<R>(
    scenario: &str,
    settings: &[(&str, &str)],
    body: impl FnOnce(&Assembly<'_>) -> R,
) -> R {
    let registry = Registry::standard();
    let all = [
        &[("expect", "[]"), ("record.signals", "[\"**\"]")],
        settings,
    ]
    .concat();
    let setting = |(key, value): &(&str, &str)| Setting {
        origin: "test".to_owned(),
        key: (*key).to_owned(),
        value: (*value).to_owned(),
    };
    let settings: Vec<Setting> = all.iter().map(setting).collect();
    let assembly = Assembly::of_file(&registry, &path(scenario), &settings);
    body(&assembly.unwrap_or_else(|error| panic!("{error}")))
}

fn digest_of(assembly: &Assembly<'_>) -> String {
    let report = execute(assembly, &Execution::default()).unwrap();
    report.fingerprint.unwrap()
}

/// The plant of an instance as the plant of a rig, stepped like by a master: it learns of no window.
/// At random steps it goes astray and comes back, or continues in another instance.
struct SteppedPlant {
    instances: [FmuInstance; 2],
    ports: Vec<Port>,
    now_s: f64,
    detours: Stream,
}

impl SteppedPlant {
    fn new(instance: impl Fn() -> FmuInstance, ports: Vec<Port>, seed: u64) -> Self {
        let mut instances = [instance(), instance()];
        for instance in &mut instances {
            instance.begin().unwrap();
        }
        Self {
            instances,
            ports,
            now_s: 0.0,
            detours: stream(seed, "detours"),
        }
    }

    fn detour(&mut self) {
        let [used, spare] = &mut self.instances;
        let state = used.save(7).unwrap();
        match self.detours.between(0, 19) {
            0 => {
                used.step(self.now_s, 0.0123).unwrap();
                assert_eq!(used.restore(&state).unwrap(), 7);
            }
            1 => {
                let state = spare.deserialise(&used.serialise(&state)).unwrap();
                assert_eq!(spare.restore(&state).unwrap(), 7);
                self.instances.swap(0, 1);
            }
            _ => {}
        }
    }
}

impl Plant for SteppedPlant {
    fn name(&self) -> &'static str {
        "stepped"
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn initial_inputs(&self, inputs: &mut [f64]) {
        let variables = self.instances[0].variables().inputs();
        let start: Vec<f64> = variables
            .flat_map(|variable| variable.start.clone().unwrap())
            .collect();
        inputs.copy_from_slice(&start);
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        self.detour();
        let instance = &mut self.instances[0];
        let references = instance.variables().inputs();
        let references: Vec<u32> = references.flat_map(FmuVariable::references).collect();
        assert_eq!(references.len(), inputs.len());
        for (reference, value) in references.into_iter().zip(inputs) {
            instance.set_number("Real", reference, *value).unwrap();
        }
        let to_s = to.as_secs_f64();
        instance.step(self.now_s, to_s - self.now_s).unwrap();
        self.now_s = to_s;
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        let instance = &mut self.instances[0];
        let references = instance.variables().outputs();
        let references: Vec<u32> = references.flat_map(FmuVariable::references).collect();
        assert_eq!(references.len(), outputs.len());
        for (value, reference) in outputs.iter_mut().zip(references) {
            *value = instance.number("Real", reference).unwrap();
        }
    }
}

/// Returns the fingerprints of the rig of a scenario with its plant, and with an instance of it.
fn digests(assembly: &Assembly<'_>, instance: impl Fn() -> FmuInstance) -> [String; 2] {
    let digest = |wrap: &dyn Fn(Box<dyn Plant>) -> Box<dyn Plant>| {
        let mut rig = assembly.rig_around(wrap).unwrap();
        let mut fingerprint = Fingerprint::new();
        rig.run_until(assembly.end(), &mut fingerprint).unwrap();
        fingerprint.digest().to_string()
    };
    let seed = assembly.scenario().seed;
    let stepped = |plant: Box<dyn Plant>| -> Box<dyn Plant> {
        Box::new(SteppedPlant::new(&instance, plant.ports(), seed))
    };
    [digest(&|plant| plant), digest(&stepped)]
}

fn instance_of(assembly: &Assembly<'_>, part: FmuPart) -> FmuInstance {
    FmuInstance::of(Resources::of(assembly, part)).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6))]

    #[test]
    fn stepped_plant_gives_the_bits_of_the_native_one(
        plant in prop_oneof![Just("massless"), Just("lcp")],
        seed in 1..1000_u32,
        longest_us in 1..1900_u32,
        observe_us in prop_oneof![Just(500_u32), Just(2000), Just(7000)],
    ) {
        // Instants of access that are on no grid.
        let (seed, plant) = (seed.to_string(), format!("{plant:?}"));
        let transfer = format!("{{ min = \"0 us\", max = \"{longest_us} us\" }}");
        let observe = format!("\"{observe_us} us\"");
        let settings = [
            ("duration", "\"150 ms\""),
            ("plant.model", &*plant),
            ("seed", &seed),
            ("io.transfer_time", &transfer),
            ("observe.period", &observe),
        ];
        with_scenario("trot.toml", &settings, |assembly| {
            let [native, stepped] =
                digests(assembly, || instance_of(assembly, FmuPart::Plant));
            assert_eq!(native, stepped);
        });
    }
}

#[test]
fn stepped_plant_behind_a_bus_gives_the_bits_of_the_native_one() {
    let settings = [("duration", "\"600 ms\"")];
    with_scenario("oncilla-trot.toml", &settings, |assembly| {
        let [native, stepped] = digests(assembly, || instance_of(assembly, FmuPart::Plant));
        assert_eq!(native, stepped);
    });
}

#[test]
fn plant_without_windows_gives_other_bits() {
    with_scenario("trot.toml", &[("duration", "\"150 ms\"")], |assembly| {
        let without_windows = || {
            let mut instance = instance_of(assembly, FmuPart::Plant);
            let plant = assembly.parts().unwrap().plant;
            let (part, _) = PlantPart::new(plant, SimDuration::from_secs(3600));
            instance.replace_part(Box::new(part));
            instance
        };
        let [native, stepped] = digests(assembly, without_windows);
        assert_ne!(native, stepped);
    });
}

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
            let other = with_scenario("trot.toml", &[("seed", "2")], |assembly| {
                instance_of(assembly, part)
            });
            assert!(other.deserialise(&bytes).is_err());
        }
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
                (f64::NAN, 0.1),
                (100.5, f64::INFINITY),
                (-1e300, 0.0),
            ] {
                let refused = instance.step(current_s, step_s);
                assert!(refused.is_err(), "{current_s} {step_s}");
            }
            let input = instance.variables().inputs().next().unwrap().clone();
            for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let refused = instance.set_number("Real", input.reference, value);
                let message = refused.unwrap_err().to_string();
                assert!(message.contains(&input.name), "{message}");
            }
            let output = instance.variables().outputs().next().unwrap().reference;
            assert!(instance.set_number("Real", output, 0.0).is_err());
            assert!(instance.set_number("Real", u32::MAX, 0.0).is_err());
            assert_eq!(instance.save(0).unwrap(), before);
            // Half a nanosecond is no step.
            instance.step(100.5, 4e-10).unwrap();
            assert_eq!(instance.save(0).unwrap(), before);
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
