//! The scenarios of the repository meet their expectations.

use std::path::PathBuf;

use twinrig::kernel::{SimDuration, SimTime};
use twinrig::runtime::{Change, RigError, VariableError};
use twinrig::scenario::Setting;
use twinrig::{Assembly, Execution, Registry, execute};
use twinrig_tests::{TrotFixture, scenarios, scenarios_in};

#[test]
fn every_scenario_is_valid_and_has_expectations() {
    let registry = Registry::standard();
    let paths = [scenarios_in(""), scenarios_in("thesis")].concat();
    assert!(paths.len() >= 15);
    for path in paths {
        let assembly = Assembly::builder(&registry)
            .file(&path)
            .unwrap_or_else(|error| panic!("{error}"));
        assembly.rig().unwrap_or_else(|error| panic!("{error}"));
        assert!(
            assembly.scenario().expectations.len() >= 3,
            "{}",
            path.display()
        );
    }
}

/// Claims on quantities of either sign.
const SIGNED: [(&str, &str); 4] = [
    ("body", "speed"),
    ("compare", "delay"),
    ("compare", "gain"),
    ("compare", "peaks"),
];
/// Last parts of the names of signals that are not negative.
const NOT_NEGATIVE: [&str; 14] = [
    "clock_error_worst",
    "damaged",
    "deviation",
    "errors",
    "filled_steps",
    "kinetic",
    "lift",
    "longest",
    "lost",
    "mean",
    "missed_points",
    "out_of_reach",
    "packets",
    "saturated",
];

/// An upper bound alone would hold for the opposite fault as well.
#[test]
fn upper_bounds_on_signed_quantities_have_a_lower_one() {
    let mut bounds = 0;
    for path in [scenarios_in(""), scenarios_in("thesis")].concat() {
        let text = std::fs::read_to_string(&path).unwrap();
        let scenario: toml::Table = toml::from_str(&text).unwrap();
        for expectation in scenario["expect"].as_array().unwrap() {
            let name = expectation["name"].as_str().unwrap();
            let bound = |claim: &str, key: &str| {
                let limits = expectation.get(claim)?.get(key)?.as_table()?;
                Some(limits.contains_key("max") && !limits.contains_key("min"))
            };
            for (claim, key) in SIGNED {
                let is_upper = bound(claim, key);
                bounds += usize::from(is_upper.is_some());
                assert_ne!(is_upper, Some(true), "{}, {name}: {key}", path.display());
            }
            if bound("signal", "always") == Some(true) {
                let signal = expectation["signal"]["name"].as_str().unwrap();
                let last = signal.rsplit('/').next().unwrap();
                assert!(
                    NOT_NEGATIVE.contains(&last),
                    "{}, {name}: {signal}",
                    path.display()
                );
            }
        }
    }
    assert!(
        bounds > 20,
        "{bounds} bounds on signed quantities were seen"
    );
}

fn setting(key: &str, value: &str) -> Setting {
    Setting {
        origin: "the test".to_owned(),
        key: key.to_owned(),
        value: value.to_owned(),
    }
}

fn scenario(name: &str) -> PathBuf {
    scenarios().join(format!("{name}.toml"))
}

#[test]
fn rig_of_a_scenario_refuses_what_is_out_of_range_and_stays_as_it_was() {
    let registry = Registry::standard();
    let assembly = TrotFixture::default().assembly(&registry);
    let [mut rig, untouched] = [0, 1].map(|_| assembly.rig().unwrap());
    let start = rig.save();
    let mut set = |variable: &str, value: f64| {
        let refused = rig.schedule(SimTime::ZERO, variable, Change::To(value));
        refused.unwrap_err()
    };
    assert!(matches!(
        set("frequency", -5.0),
        RigError::Change { source: VariableError::OutOfRange { range, .. }, .. } if range == "[0, ∞["
    ));
    // Half of the rate of the controller, 500 Hz.
    let sampled = set("frequency", 251.0).to_string();
    assert!(sampled.contains("samples up to 250 Hz"), "{sampled}");
    for value in [1e9, -100.1] {
        let refused = rig.override_output("leg/LF/hip/command", Some(&[value]));
        let RigError::OverrideOutOfRange { most, .. } = refused.unwrap_err() else {
            panic!("{value}");
        };
        assert_eq!(most, 100.0);
    }
    let end = assembly.end();
    let late = rig.run_until(end + SimDuration::from_nanos(1), &mut ());
    assert!(matches!(late, Err(RigError::PastEnd { .. })));
    assert_eq!(rig.save(), start);
    assert_eq!(untouched.save(), start);
    rig.run_until(end, &mut ()).unwrap();
}

#[test]
fn commands_to_legs_without_drives_are_an_error() {
    let registry = Registry::standard();
    let text = r#"
        robot = "cheetah-cub"
        duration = "1 s"
        plant = { model = "massless" }
        actuator = { kind = "none" }
        controller = { kind = "stand", period = "2 ms" }
        [[expect]]
        body = { fall = false }
    "#;
    let robot = include_str!("../../robots/cheetah-cub.toml");
    let assembly = Assembly::builder(&registry).robot(robot).recorded(text);
    let error = assembly.and_then(|assembly| assembly.rig().map(drop));
    let error = error.unwrap_err();
    let message = error.to_string();
    assert!(
        message.contains("nothing takes `leg/LF/hip/command"),
        "{message}"
    );
}

#[test]
fn ground_restitution_is_that_of_the_scenario() {
    let registry = Registry::standard();
    let lands = |plant: &str, restitution: &str| {
        let settings = [
            setting("plant.model", &format!("{plant:?}")),
            setting("plant.ground.restitution", restitution),
        ];
        let assembly = Assembly::builder(&registry)
            .settings(&settings)
            .file(&scenario("leg-drop"));
        let assembly = assembly.unwrap_or_else(|error| panic!("{error}"));
        let report = execute(&assembly, &Execution::default());
        let report = report.unwrap_or_else(|error| panic!("{error}"));
        let mut outcomes = report.expectations.iter().map(|line| &line.outcome);
        let lands = outcomes.find(|outcome| outcome.name == "is on the ground from then on");
        lands.unwrap().holds()
    };
    for plant in ["lcp", "massless"] {
        assert!(lands(plant, "0.0") && !lands(plant, "0.9"), "{plant}");
    }
}

#[test]
fn start_beyond_a_stop_is_an_error_with_the_excess() {
    let registry = Registry::standard();
    let settings = [setting("plant.start.q3", "\"8 deg\"")];
    let error = Assembly::builder(&registry)
        .settings(&settings)
        .file(&scenario("passive-legs"))
        .err();
    let message = error.unwrap().to_string();
    let stop = "`q3` closes the pantograph beyond its stop, by 0.27 mm";
    assert!(message.contains(stop), "{message}");
}

/// Counters read 0 before the devices are ready, which many expectations would accept.
#[test]
fn run_ending_before_its_devices_are_ready_is_an_error() {
    let registry = Registry::standard();
    let text = r#"
        robot = "oncilla"
        duration = "200 ms"
        plant = { model = "drives", base = "fixed" }
        actuator = { kind = "motor" }
        controller = { kind = "script", period = "2 ms" }
        bus = { kind = "sbcp" }
        [[expect]]
        signal = { name = "sbcp/errors", always = { max = 0 } }
    "#;
    let robot = include_str!("../../robots/oncilla.toml");
    let assembly = Assembly::builder(&registry)
        .robot(robot)
        .recorded(text)
        .unwrap();
    let report = execute(&assembly, &Execution::default()).unwrap();
    assert_eq!(report.verdict, twinrig::Status::Error);
    let error = report.error.unwrap();
    assert!(error.contains("still being initialised"), "{error}");
}

#[test]
fn unsupported_bus_options_are_reported() {
    let registry = Registry::standard();
    for (topology, key, value, expected) in [
        ("direct", "gap", "\"3 us\"", "`gap` is a setting"),
        (
            "direct",
            "passing",
            "\"store-and-forward\"",
            "`passing` is a setting",
        ),
        (
            "controller",
            "usb",
            "{ latency_timer = \"256 ms\" }",
            "is limited to 255.000 ms",
        ),
    ] {
        let settings = [
            setting("bus.topology", &format!("\"{topology}\"")),
            setting(&format!("bus.{key}"), value),
        ];
        let path = scenario("thesis/sec-5-3-2-bus-controller");
        let error = Assembly::builder(&registry)
            .settings(&settings)
            .file(&path)
            .err()
            .unwrap();
        assert!(error.to_string().contains(expected), "{error}");
    }
}
