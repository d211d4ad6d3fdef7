//! Oncilla's trot with steps to the side.

use twinrig::{Execution, execute};

use crate::shipped;

/// Turning rate \[rad/s\], speed along the heading and to the left of it \[m/s\], from the fourth
/// second on.
const CLAIMS: &str = concat!(
    "[",
    "{ name = 'turn', after = '4 s', body = { turn_rate = { min = '-9 rad/s' } } },",
    "{ name = 'forward', after = '4 s', body = { speed = { min = '-9 m/s' }, along = 'forward' } },",
    "{ name = 'left', after = '4 s', body = { speed = { min = '-9 m/s' }, along = 'left' } }",
    "]"
);

/// Returns the values of [`CLAIMS`] with a command that does not change.
fn measured(plant: &str, file: &str, variable: &str, command: &str) -> [f64; 3] {
    let registry = twinrig::registry();
    let [model, command] = [plant, command].map(|text| format!("'{text}'"));
    let settings = [
        ("plant.model", model.as_str()),
        ("duration", "'10 s'"),
        ("change", "[]"),
        (variable, command.as_str()),
        ("expect", CLAIMS),
    ];
    let assembly = shipped(&registry, file, &settings).unwrap();
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
    let turned = |command: &str| measured(plant, "oncilla-turn.toml", "controller.turn", command);
    let [straight, speed, _] = turned("0 deg/s");
    assert!(straight.abs() < 0.03, "{plant}: {straight} rad/s");
    for degrees in [10, 20, 30] {
        let rate = f64::from(degrees).to_radians();
        let [left, right] = ["", "-"].map(|sign| turned(&format!("{sign}{degrees} deg/s")));
        for (found, command) in [(&left, rate), (&right, -rate)] {
            let [share, forward] = [found[0] / command, found[1] / speed];
            assert!((share - 1.0).abs() < 0.1, "{plant}, {command}: {share}");
            assert!(forward > 0.8, "{plant}, {command}: {forward} of the speed");
        }
        let difference = (left[0] + right[0]) / rate;
        assert!(difference.abs() < 0.05, "{plant}, {rate}: {difference}");
    }
    for (command, velocity) in [("5 cm/s", 0.05), ("-5 cm/s", -0.05)] {
        let file = "oncilla-sidestep.toml";
        let [found, _, left] = measured(plant, file, "controller.sidestep", command);
        let share = left / velocity;
        assert!((share - 1.0).abs() < 0.2, "{plant}, {command}: {share}");
        assert!(found.abs() < 0.05, "{plant}, {command}: {found} rad/s");
    }
}
