//! `[[sensor]]`: reading, and the signals of the controller that sensors name.

use crate::common::{facts, legs, parse, text};
use twinrig_document::DocumentError;
use twinrig_kernel::{Port, SimDuration, Unit};
use twinrig_runtime::{SensorModel, Timing};
use twinrig_scenario::{Facts, Scene};

/// A controller that reads the load of each leg, its joint angles and the attitude.
fn facts_of_reader() -> Facts {
    let mut facts = facts(legs());
    for leg in legs() {
        let name = |what: &str| format!("leg/{}/{what}", leg.name);
        let load = Port::input(name("foot/load"), Unit::Newton, 1);
        let angles = Port::input(name("angles"), Unit::Radian, 3);
        facts.process_ports.extend([load, angles]);
    }
    let attitude = "body/orientation";
    let truth = Port::output(attitude, Unit::One, 4).rotation();
    facts.plant_outputs.push(truth);
    let read = Port::input(attitude, Unit::One, 4);
    facts.process_ports.push(read);
    facts
}

fn scene(sensors: &str) -> Result<Scene, DocumentError> {
    parse(&text(sensors))?.scene(&facts_of_reader())
}

#[test]
fn values_are_read_in_the_unit_of_the_signal() {
    let sensors = "[[sensor]]\nof = 'leg/*/foot/load'\nperiod = '5 ms'\ndelay = '3 ms'\n\
                   noise = '100 mN'\nbias = '-1 N'\nrandom_walk = '0.2 N'\nresolution = '10 mN'\n\
                   range = ['0 N', '50 N']\ndrop_out = '1 %'\n\n\
                   [[sensor]]\nname = 'gyro'\nof = 'body/orientation'\nnoise = '180 deg'";
    let scene = scene(sensors).unwrap();
    let [load, attitude] = &scene.scenario.sensors[..] else {
        panic!("two sensors");
    };
    let expected = SensorModel {
        period: Some(SimDuration::from_millis(5)),
        delay: Timing::Constant(SimDuration::from_millis(3)),
        noise: 0.1,
        bias: -1.0,
        random_walk: 0.2,
        resolution: 0.01,
        range: Some((0.0, 50.0)),
        drop_out: 0.01,
    };
    assert_eq!((&load.name, &load.model), (&None, &expected));
    let noise = SensorModel {
        noise: std::f64::consts::PI,
        ..SensorModel::default()
    };
    assert_eq!(attitude.model, noise);
    let sensed = scene.sensed.iter();
    let sensed: Vec<_> = sensed
        .map(|one| (one.sensor, one.signal.as_str(), one.unit))
        .collect();
    let newton = Unit::Newton;
    let expected = [
        (0, "leg/LF/foot/load", newton),
        (0, "leg/RF/foot/load", newton),
        (0, "leg/LH/foot/load", newton),
        (0, "leg/RH/foot/load", newton),
        (1, "body/orientation", Unit::Radian),
    ];
    assert_eq!(sensed, expected);
}

#[test]
fn sensors_of_other_signals_and_units_are_refused() {
    let cases = [
        "of = 'leg/LF/foot/lod'",
        // An output of the plant that the controller does not read.
        "of = 'leg/LF/cable/tension'",
        "of = 'leg/*/foot/load'\nnoise = '1 mm'",
        "of = 'leg/*/angles'\nnoise = '1 deg'\nbias = 0.1",
        "of = 'body/orientation'\nnoise = 0.1",
        "of = 'body/orientation'\nresolution = '1 deg'",
        "of = 'leg/*/foot/load'\n[[sensor]]\nof = 'leg/LF/**'",
        "of = 'leg/*/foot/load'\nrange = ['5 N', '0 N']",
        "of = 'leg/*/foot/load'\nrange = ['5 N']",
    ];
    let refused = cases.map(|keys| {
        let error = scene(&format!("[[sensor]]\n{keys}")).expect_err(keys);
        error.to_string()
    });
    insta::assert_snapshot!(refused.join("\n"));
}

#[test]
fn sensor_without_reader_is_refused() {
    let sensor = "[[sensor]]\nof = 'leg/*/foot/load'";
    let read = parse(&text(sensor)).unwrap();
    let refused = read.scene(&facts(legs())).unwrap_err().to_string();
    assert!(
        refused.contains("the controller reads no signal"),
        "{refused}"
    );
    let none = text(sensor).replace("kind = \"cpg\"\nperiod = \"2 ms\"", "kind = \"none\"");
    let refused = parse(&none).unwrap_err().to_string();
    assert!(refused.contains("there is no controller"), "{refused}");
}
