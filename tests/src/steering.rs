//! Oncilla's trot with steps to the side.

use twinrig::{Execution, Registry, execute};

use crate::shipped;

/// Settings of the gait: feet farther apart than in the straight trot, and the dead band and the
/// lag of the servos of abduction.
const STEERING: [(&str, &str); 6] = [
    ("plant.abduction", "'free'"),
    ("controller.abduction", "'steer'"),
    ("controller.splay", "'3 deg'"),
    ("controller.dead_band", "'0.3 deg'"),
    ("controller.lead", "'40 ms'"),
    ("duration", "'10 s'"),
];

/// Turning rate \[rad/s\], speed along the heading and to the left of it \[m/s\], from the fourth
/// second on.
const CLAIMS: &str = concat!(
    "[",
    "{ name = 'turn', after = '4 s', body = { turn_rate = { min = '-9 rad/s' } } },",
    "{ name = 'forward', after = '4 s', body = { speed = { min = '-9 m/s' }, along = 'forward' } },",
    "{ name = 'left', after = '4 s', body = { speed = { min = '-9 m/s' }, along = 'left' } }",
    "]"
);

fn measured(plant: &str, settings: &[(&str, &str)]) -> [f64; 3] {
    let registry = Registry::standard();
    let model = format!("'{plant}'");
    let own = [("plant.model", model.as_str()), ("expect", CLAIMS)];
    let settings = [&own[..], &STEERING[..], settings].concat();
    let assembly = shipped(&registry, "oncilla-trot.toml", &settings).unwrap();
    let report = execute(&assembly, &Execution::default()).unwrap();
    let outcomes = report.expectations.iter().map(|line| &line.outcome);
    let values: Vec<_> = outcomes.map(|row| row.measured.unwrap()).collect();
    values.try_into().unwrap()
}

/// Checks that Oncilla turns left and right, and steps to the side, on a plant.
///
/// # Panics
/// If it does not.
pub fn assert_steers(plant: &str) {
    let [straight, speed, _] = measured(plant, &[]);
    assert!(straight.abs() < 0.03, "{plant}: {straight} rad/s");
    let degree = 1f64.to_radians();
    let turns = [("20 deg/s", 20.0), ("-20 deg/s", -20.0), ("30 deg/s", 30.0)];
    for (command, rate) in turns {
        let value = format!("'{command}'");
        let [found, forward, _] = measured(plant, &[("controller.turn", &value)]);
        let share = found / (rate * degree);
        assert!((share - 1.0).abs() < 0.1, "{plant}, {command}: {share}");
        assert!(forward > 0.8 * speed, "{plant}, {command}: {forward} m/s");
    }
    for (command, velocity) in [("4 cm/s", 0.04), ("-4 cm/s", -0.04)] {
        let value = format!("'{command}'");
        let [found, _, left] = measured(plant, &[("controller.sidestep", &value)]);
        println!("{plant} {command}: {found} rad/s {left} m/s");
        assert!(
            (left / velocity - 1.0).abs() < 0.3,
            "{plant}, {command}: {left}"
        );
        assert!(found.abs() < 0.06, "{plant}, {command}: {found} rad/s");
    }
}
