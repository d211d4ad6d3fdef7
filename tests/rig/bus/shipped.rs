//! Health of the buses of shipped scenarios.

use twinrig::Registry;
use twinrig::kernel::{SimDuration, SimTime};
use twinrig::runtime::{BusHealth, Silence};
use twinrig_tests::{run_from, shipped};

fn health(file: &str, settings: &[(&str, &str)]) -> Vec<(String, BusHealth)> {
    let registry = Registry::standard();
    let assembly = shipped(&registry, file, settings);
    let mut rig = assembly
        .unwrap_or_else(|e| panic!("{file}: {e}"))
        .rig()
        .unwrap();
    run_from(&mut rig, SimTime::ZERO + SimDuration::from_millis(1_000));
    let health = rig.bus_health().into_iter();
    health
        .map(|(name, health)| (name.to_owned(), health))
        .collect()
}

#[test]
fn shipped_buses_are_clean() {
    for file in [
        "oncilla-trot.toml",
        "tegotae-force.toml",
        "tegotae-tactile.toml",
    ] {
        let buses = health(file, &[]);
        assert!(!buses.is_empty(), "{file}");
        for (name, health) in buses {
            assert!(
                health.is_clean() && health.answers > 0,
                "{file}, {name}: {health:?}"
            );
        }
    }
}

#[test]
fn dead_board_on_each_of_two_buses_is_silent() {
    for place in ["wire/sbcp/RH", "wire/rb110"] {
        let fault = format!("[{{ at = '0.6 s', on = '{place}', kind = 'unplug', for = '9 s' }}]");
        let settings = [
            ("fault", fault.as_str()),
            ("bus.sbcp.error_threshold", "-1"),
        ];
        for (name, health) in health("oncilla-trot.toml", &settings) {
            let dead = health.silence.as_ref().is_some_and(Silence::is_dead);
            let concerned = place.split('/').nth(1) == Some(name.as_str());
            assert_eq!(dead, concerned, "{place}, {name}: {health:?}");
            assert_eq!(
                health.error_count() > 0,
                concerned,
                "{place}, {name}: {health:?}"
            );
        }
    }
}
