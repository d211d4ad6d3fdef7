//! Sensors of the controller's inputs: `[[sensor]]`.

use std::path::Path;

use twinrig::kernel::{Layout, SimTime};
use twinrig::runtime::{Group, Observer, RunEvent};
use twinrig::scenario::Setting;
use twinrig::{Assembly, Registry};
use twinrig_record::Digest;
use twinrig_tests::run_from;

const END: SimTime = SimTime::from_nanos(600_000_000);

fn assembly<'r>(registry: &'r Registry, file: &str, sensors: &str) -> Assembly<'r> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios");
    let setting = Setting {
        origin: "the test".to_owned(),
        key: "sensor".to_owned(),
        value: sensors.to_owned(),
    };
    Assembly::builder(registry)
        .settings(&[setting])
        .file(&path.join(file))
        .unwrap_or_else(|e| panic!("{e}"))
}

/// Also where a driver receives samples between the transfers.
#[test]
fn sensor_without_effects_changes_no_bit_of_measured_loads() {
    let registry = Registry::standard();
    for (file, of) in [
        ("tegotae-force.toml", "force-*/force"),
        ("tegotae-tactile.toml", "leg/*/foot/load/estimate"),
    ] {
        let run = |sensors: &str| -> Digest {
            let mut rig = assembly(&registry, file, sensors).rig().unwrap();
            run_from(&mut rig, END)
        };
        let ideal = format!("[{{ of = '{of}' }}]");
        assert_eq!(run(&ideal), run("[]"), "{file}");
        let late = format!("[{{ of = '{of}', delay = '2 ms' }}]");
        assert_ne!(run(&late), run("[]"), "{file}");
    }
}

/// The last samples of a load in the two groups that have it.
struct Loads {
    of_plant: usize,
    of_controller: usize,
    truth: Vec<f64>,
    samples: Vec<f64>,
}

impl Observer for Loads {
    fn samples(&mut self, _: SimTime, group: Group, values: &[f64]) {
        match group {
            Group::Plant => self.truth.push(values[self.of_plant]),
            Group::ProcessInputs => self.samples.push(values[self.of_controller]),
            _ => {}
        }
    }

    fn event(&mut self, _: SimTime, _: RunEvent) {}
}

#[test]
fn observers_receive_the_true_signal_and_the_samples() {
    let registry = Registry::standard();
    let sensor = "[{ of = 'leg/*/foot/load', noise = '0.3 N', resolution = '0.5 N' }]";
    let assembly = assembly(&registry, "tegotae-noisy.toml", sensor);
    let mut rig = assembly.rig().unwrap();
    let offset = |layout: &Layout| layout.find("leg/LF/foot/load").unwrap().start;
    let mut loads = Loads {
        of_plant: offset(rig.layout(Group::Plant)),
        of_controller: offset(rig.layout(Group::ProcessInputs)),
        truth: Vec::new(),
        samples: Vec::new(),
    };
    rig.run_until(END, &mut loads).unwrap();
    let is_rounded = |load: &&f64| (2.0 * **load).fract() == 0.0;
    assert!(loads.samples.iter().all(|load| is_rounded(&load)));
    let rounded = loads.truth.iter().filter(is_rounded).count();
    assert!(
        rounded < loads.truth.len() / 2 + loads.truth.len() / 4,
        "{rounded}"
    );
    // The controller reads the load of the observation before: their difference is the error.
    let pairs = loads.samples.iter().skip(1).zip(&loads.truth);
    let squares = pairs.map(|(sample, truth)| (sample - truth) * (sample - truth));
    let variance = squares.sum::<f64>() / 300.0;
    let expected = 0.09 + 0.25 / 12.0;
    assert!(
        (variance / expected - 1.0).abs() < 0.35,
        "{variance} {expected}"
    );
}
