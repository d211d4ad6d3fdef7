//! The scenarios of the repository do what their expectations say.

use std::path::PathBuf;

use twinrig::scenario::Setting;
use twinrig::{Assembly, Execution, Registry, execute};
use twinrig_tests::{scenarios, scenarios_in};

#[test]
fn every_scenario_is_sound_and_expects_something() {
    let registry = Registry::standard();
    let paths = [scenarios_in(""), scenarios_in("thesis")].concat();
    assert!(paths.len() >= 15);
    for path in paths {
        let assembly =
            Assembly::of_file(&registry, &path, &[]).unwrap_or_else(|error| panic!("{error}"));
        assembly.rig().unwrap_or_else(|error| panic!("{error}"));
        assert!(
            assembly.scenario().expectations.len() >= 3,
            "{}",
            path.display()
        );
    }
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
fn a_controller_that_commands_legs_without_drives_is_told_that_nothing_takes_its_commands() {
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
    let robot = include_str!("../robots/cheetah-cub.toml");
    let assembly = Assembly::of_texts(&registry, text, robot, &[]);
    let error = assembly.and_then(|assembly| assembly.rig().map(drop));
    let error = error.unwrap_err();
    let told = error.to_string();
    assert!(told.contains("nothing takes `leg/LF/hip/command"), "{told}");
}

#[test]
fn ground_gives_back_what_the_scenario_says() {
    let registry = Registry::standard();
    let stays = |plant: &str, restitution: &str| {
        let settings = [
            setting("plant.model", &format!("{plant:?}")),
            setting("plant.ground.restitution", restitution),
        ];
        let assembly = Assembly::of_file(&registry, &scenario("leg-drop"), &settings);
        let assembly = assembly.unwrap_or_else(|error| panic!("{error}"));
        let report = execute(&assembly, &Execution::default());
        let report = report.unwrap_or_else(|error| panic!("{error}"));
        let mut outcomes = report.expectations.iter().map(|line| &line.0);
        let lands = outcomes.find(|outcome| outcome.name == "is on the ground from then on");
        lands.unwrap().holds()
    };
    for plant in ["lcp", "massless"] {
        assert!(stays(plant, "0.0") && !stays(plant, "0.9"), "{plant}");
    }
}

#[test]
fn a_start_beyond_a_stop_is_an_error_that_says_by_how_much() {
    let registry = Registry::standard();
    let settings = [setting("plant.start.q3", "\"8 deg\"")];
    let error = Assembly::of_file(&registry, &scenario("passive-legs"), &settings).err();
    let told = error.unwrap().to_string();
    assert!(told.contains("m beyond the stop Closed"), "{told}");
}

/// The thesis reports more than 80 % of success.
#[test]
fn a_blind_step_down_succeeds_in_eight_of_ten_phases_of_the_stride() {
    const STRIDE_M: f64 = 0.951 / 3.64;
    let registry = Registry::standard();
    let path = scenario("step-down");
    let set = |key: &str, value: String| Setting {
        origin: "the test".to_owned(),
        key: key.to_owned(),
        value,
    };
    let mut phases_stood = Vec::new();
    for phase in 0..10 {
        let edge_m = 2.5 + STRIDE_M * f64::from(phase) / 10.0;
        let settings = [
            set("duration", "\"7 s\"".to_owned()),
            set("plant.ground.at", format!("\"{edge_m} m\"")),
        ];
        let assembly = Assembly::of_file(&registry, &path, &settings)
            .unwrap_or_else(|error| panic!("{error}"));
        let report =
            execute(&assembly, &Execution::default()).unwrap_or_else(|error| panic!("{error}"));
        let outcomes = || report.expectations.iter().map(|line| &line.0);
        let stood = outcomes().find(|outcome| outcome.name == "does not fall");
        if stood.is_some_and(twinrig::scenario::Outcome::holds) {
            phases_stood.push(phase);
        }
    }
    assert!(phases_stood.len() >= 8, "{phases_stood:?}");
}

/// Counters that nothing was ever counted in read 0, which many an expectation would take for good.
#[test]
fn a_run_that_ends_before_its_devices_are_ready_is_an_error() {
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
    let robot = include_str!("../robots/oncilla.toml");
    let assembly = Assembly::of_texts(&registry, text, robot, &[]).unwrap();
    let report = execute(&assembly, &Execution::default()).unwrap();
    assert_eq!(report.verdict, twinrig::Status::Error);
    let error = report.error.unwrap();
    assert!(error.contains("still being made ready"), "{error}");
}

#[test]
fn a_bus_that_is_told_what_it_cannot_do_says_so() {
    let registry = Registry::standard();
    for (topology, key, value, says) in [
        ("direct", "gap", "\"3 us\"", "`gap` says"),
        (
            "direct",
            "passing",
            "\"store-and-forward\"",
            "`passing` says",
        ),
        (
            "controller",
            "usb",
            "{ latency_timer = \"256 ms\" }",
            "has 255.000 ms at most",
        ),
    ] {
        let settings = [
            setting("bus.topology", &format!("\"{topology}\"")),
            setting(&format!("bus.{key}"), value),
        ];
        let path = scenario("thesis/sec-5-3-2-bus-controller");
        let error = Assembly::of_file(&registry, &path, &settings)
            .err()
            .unwrap();
        assert!(error.to_string().contains(says), "{error}");
    }
}
