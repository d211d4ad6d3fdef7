//! A rig whose plant is stepped as a master steps an FMU.

use proptest::prelude::*;
use twinrig_kernel::{Port, SimDuration, SimTime, Stream, stream};
use twinrig_record::Fingerprint;
use twinrig_runtime::{Plant, PlantFault};

use super::{instance_of, with_scenario};
use crate::assembly::Assembly;
use crate::fmu::instance::FmuInstance;
use crate::fmu::part::FmuPart;
use crate::fmu::plant_part::PlantPart;
use crate::fmu::variables::FmuVariable;

/// The plant of an instance as the plant of a rig, stepped as by a master: it learns of no window.
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
            instance
                .set_numbers("Real", &[reference], &[*value])
                .unwrap();
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
