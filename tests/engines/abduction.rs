//! Legs that abduct, in the engines.

use twinrig::kernel::SimDuration;
use twinrig::scenario::Verdict;
use twinrig_tests::{assert_legs_follow_the_servo_board, assert_steers};

use crate::{feet_of_text, report_of, rms};

/// Oncilla trots in the air, and its legs spread to 12° on the way.
const HANGING: &str = r#"
name = "hanging"
robot = "oncilla"
duration = "1.5 s"
seed = 1

[plant]
model = "lcp"
base = "fixed"
abduction = "free"

[actuator]
kind = "ideal"

[controller]
kind = "cpg"
gait = "trot"
period = "2 ms"
frequency = "2 Hz"
ramp = "500 ms"
abduction = "hold"

[[change]]
at = "0.5 s"
set = "splay"
to = "12 deg"
"#;

fn track(settings: &[(&str, &str)]) -> Vec<Vec<f64>> {
    feet_of_text(HANGING, settings, SimDuration::from_millis(1500))
}

#[test]
fn mujoco_moves_the_feet_as_the_full_plant() {
    let reference = track(&[]);
    for coordinates in ["'maximal'", "'minimal'"] {
        let settings = [
            ("plant.model", "'mujoco'"),
            ("plant.coordinates", coordinates),
        ];
        let distance = rms(&reference, &track(&settings));
        assert!(distance < 1e-3, "{coordinates}: {distance} m");
    }
    // By the spread, feet move sideways by centimetres.
    let locked = track(&[("plant.abduction", "'locked'")]);
    assert!(rms(&reference, &locked) > 1e-2);
}

/// With servos: the sweeps of the engine do not resolve the 240 N·m by which an ideal drive jumps.
#[test]
fn rapier_moves_the_feet_as_the_full_plant() {
    let servos = ("actuator.kind", "'servo'");
    let distance = rms(
        &track(&[servos]),
        &track(&[servos, ("plant.model", "'rapier'")]),
    );
    assert!(distance < 1e-3, "{distance} m");
}

#[test]
fn unplugged_servo_board_changes_the_motion_of_legs_that_abduct() {
    assert_legs_follow_the_servo_board("mujoco");
    assert_legs_follow_the_servo_board("rapier");
}

#[test]
fn oncilla_turns_and_steps_to_the_side_in_mujoco() {
    assert_steers("mujoco");
}

/// The robot trots straight on at its speed, as with locked joints.
#[test]
fn legs_that_abduct_trot_in_mujoco() {
    let settings = [
        ("plant.model", "'mujoco'"),
        ("plant.abduction", "'free'"),
        ("duration", "'10 s'"),
    ];
    let report = report_of("oncilla-trot.toml", &settings);
    let outcomes = report.expectations.iter().map(|line| &line.outcome);
    let kept = ["does not fall", "forward speed", "goes straight"];
    let kept: Vec<_> = outcomes
        .filter(|row| kept.contains(&row.name.as_str()))
        .map(|row| (row.verdict, row.measured))
        .collect();
    assert_eq!(kept.len(), 3);
    let passes = kept.iter().all(|(verdict, _)| *verdict == Verdict::Pass);
    assert!(passes, "{kept:?}");
}
