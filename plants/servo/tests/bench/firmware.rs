//! The position controller: commands, delays, counts and profiles.

use crate::{OFF, Run, ideal};

/// The duty cycle is zero within the dead zone, jumps to its start beyond, and grows from there.
#[test]
fn duty_cycle_begins_behind_the_dead_zone() {
    let mut servo = ideal();
    servo.friction.coulomb = 10.0;
    servo.controller.quantized = true;
    servo.controller.gain = 32.0;
    servo.controller.duty_per_count = 1.0 / 4000.0;
    servo.controller.dead_zone = 1.0;
    servo.controller.starting_duty = 0.016;
    let per_count = core::f64::consts::TAU / 4096.0;
    // Error in counts, duty cycle in per mille.
    for (error, duty) in [
        (0, 0.0),
        (1, 0.0),
        (2, 24.0),
        (9, 80.0),
        (-2, -24.0),
        (200, 1000.0),
    ] {
        let mut run = Run::new(&servo, &["servo/duty"], [0.0, 0.0]);
        let found = run.at(2e-3, [f64::from(error) * per_count, 1.0])[0];
        assert!((found - duty * 1e-3).abs() < 1e-12, "{error}: {found}");
    }
}

/// A controller that knows counts rounds command and position; another one knows both exactly.
#[test]
fn error_of_position_is_in_whole_counts() {
    let mut servo = ideal();
    servo.friction.coulomb = 10.0;
    let per_count = core::f64::consts::TAU / 4096.0;
    // Position, command, and the error that the controller sees, all in counts.
    for (position, command, seen) in [(0.0, 0.4, 0.0), (0.0, 0.6, 1.0), (0.6, 1.4, 0.0)] {
        for (quantized, error) in [(true, seen), (false, command - position)] {
            servo.controller.quantized = quantized;
            let mut run = Run::new(&servo, &["servo/duty"], [position * per_count, 0.0]);
            let found = run.at(2e-3, [command * per_count, 1.0])[0];
            let duty = error * servo.controller.gain * servo.controller.duty_per_count;
            assert!((found - duty).abs() < 1e-12, "{command}: {found}");
        }
    }
}

#[test]
fn command_is_in_force_from_the_first_step_after_its_delay() {
    let mut servo = ideal();
    servo.controller.command_delay = 2.3e-3;
    let mut run = Run::new(&servo, &["servo/duty"], [0.0, 0.0]);
    run.at(0.5e-3, [0.0, 1.0]);
    // It arrives at 0.5 ms and is in force from the step at 3 ms.
    assert_eq!(run.at(2.999e-3, [0.5, 1.0]), [0.0]);
    assert!(run.at(3.001e-3, [0.5, 1.0])[0] > 0.0);
}

#[test]
fn position_is_read_in_counts_and_after_its_delay() {
    let mut servo = ideal();
    servo.controller.reading_delay = 3e-3;
    let names = ["servo/angle", "servo/reading", "servo/position"];
    let mut run = Run::new(&servo, &names, [1.0, 0.0]);
    let count = core::f64::consts::TAU / 4096.0;
    let earlier = run.at(0.1, OFF)[0];
    let [_, reading, position] = run.at(0.103, OFF)[..] else {
        unreachable!("three outputs");
    };
    assert!((reading - earlier).abs() < 1e-12);
    assert!((position / count - (earlier / count).round()).abs() < 1e-9);
}

#[test]
fn profile_obeys_its_limits_and_ends_at_the_command() {
    let mut servo = ideal();
    // A stiff controller shows the set-point, 0.02 rad below it under gravity.
    servo.controller.gain = 1e4;
    servo.controller.profile_speed = Some(2.0);
    servo.controller.profile_acceleration = Some(10.0);
    let mut run = Run::new(&servo, &["servo/angle", "servo/rate"], [0.0, 0.0]);
    let mut fastest: f64 = 0.0;
    for step in 1..1500 {
        let outputs = run.at(f64::from(step) * 1e-3, [1.0, 1.0]);
        fastest = fastest.max(outputs[1]);
    }
    let angle = run.at(2.0, [1.0, 1.0])[0];
    assert!((angle - 1.0).abs() < 0.03, "{angle}");
    assert!((1.8..2.5).contains(&fastest), "{fastest}");
    // 0.2 s of acceleration, 0.3 s of speed, 0.2 s of deceleration.
    let mut run = Run::new(&servo, &["servo/angle"], [0.0, 0.0]);
    let half = run.at(0.35, [1.0, 1.0])[0];
    assert!((half - 0.5).abs() < 0.05, "{half}");
}
