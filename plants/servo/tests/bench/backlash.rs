//! Motion within the backlash of the gear beside closed forms.

use proptest::prelude::*;
use twinrig_runtime::Plant;
use twinrig_servo::ServoBenchParameters;

use crate::{GRAVITY, OFF, Run, ideal, sound};

const GAP: f64 = 0.05;

fn with_backlash(backlash: f64) -> ServoBenchParameters {
    let mut servo = ideal();
    servo.gear.backlash = backlash;
    servo
}

/// The motor runs through the gap alone and takes the arm along with what is left of its momentum.
#[test]
fn motor_crosses_the_gap_alone_and_shares_its_momentum_with_the_arm() {
    let mut servo = with_backlash(GAP);
    servo.controller.gain = 1e5;
    let (motor, arm) = (servo.motor, servo.load.mass * 0.01);
    let damping = motor.torque_constant * motor.torque_constant / motor.resistance;
    let free = -servo.supply.voltage / motor.torque_constant;
    // Rate and angle under a constant voltage, from a rate.
    let rate =
        |inertia: f64, from: f64, t: f64| free + (from - free) * libm::exp(-t * damping / inertia);
    let crossed = |t: f64| {
        let time = motor.inertia / damping;
        free * (t + time * libm::expm1(-t / time))
    };
    let (mut early, mut late) = (0.0, 0.1);
    for _ in 0..60 {
        let middle = 0.5 * (early + late);
        (early, late) = if -crossed(middle) < GAP {
            (middle, late)
        } else {
            (early, middle)
        };
    }
    let met = rate(motor.inertia, 0.0, late) * motor.inertia / (motor.inertia + arm);
    let mut run = Run::new(&servo, &["servo/rate"], [0.0, 0.0]);
    let (mut before, mut after) = (0, 0);
    for step in 1..60 {
        let seconds = f64::from(step) * 1e-3;
        let found = run.at(seconds, [-1e4, 1.0])[0];
        if seconds < late {
            assert_eq!(found, 0.0, "{seconds} {late}");
            before += 1;
        } else if seconds < late + 5e-3 {
            let exact = rate(motor.inertia + arm, met, seconds - late);
            // At 1 ms (h/τ)²/24 of the motor alone, whose time constant is 29 ms, is 5e-5 of the
            // rate; gravity is 2e-3 of the torque.
            assert!((found / exact - 1.0).abs() < 1e-3, "{found} {exact}");
            after += 1;
        }
    }
    assert!(before > 5 && after == 5, "{before} {after}");
}

/// The arm of a motor that friction holds falls from one side of the gap to the other as a pendulum
/// without the motor's inertia, and rests there.
#[test]
fn arm_falls_through_the_gap_of_a_held_motor_as_a_pendulum() {
    let mut servo = with_backlash(GAP);
    servo.friction.coulomb = 5.0;
    let start = 0.8;
    let mut run = Run::new(&servo, &["servo/angle", "servo/rate"], [start, 0.0]);
    // Teeth that carry the arm hold it.
    assert_eq!(run.at(0.3, OFF), [start, 0.0]);
    let state = run.bench.state().unwrap();
    assert!(state.get("servo/motor/lead").is_none());
    let state = state.with("servo/motor/lead", &[-0.5 * GAP]);
    let state = state.with("servo/motor/rate", &[0.0]);
    run.bench.resume_from(&state).unwrap();
    let mut falling = 0;
    let end = (1..200).fold([0.0; 2], |_, step| {
        let found = run.at(0.3 + f64::from(step) * 1e-3, OFF);
        let [angle, rate] = [found[0], found[1]];
        if angle > start - GAP && rate != 0.0 {
            let drop = libm::cos(angle) - libm::cos(start);
            let exact = (2.0 * GRAVITY / servo.load.length * drop).sqrt();
            // Of second order: (ω h)²/24 of the motion, with ω of 10/s, is 4e-6.
            assert!((rate + exact).abs() < 1e-5 * exact, "{rate} {exact}");
            falling += 1;
        }
        [angle, rate]
    });
    assert!(falling > 30, "{falling}");
    // What is left after the impact is spent against friction, less gravity.
    let (own, arm) = (servo.motor.inertia, servo.load.mass * 0.01);
    let weight = servo.load.mass * GRAVITY * servo.load.length;
    let fall = weight * (libm::cos(start - GAP) - libm::cos(start));
    let braked = arm / (own + arm) * fall / (5.0 - weight * libm::sin(start - GAP));
    let beyond = start - GAP - end[0];
    assert!(end[1] == 0.0, "{end:?}");
    assert!((beyond / braked - 1.0).abs() < 2e-3, "{beyond} {braked}");
    let energy = run.bench.energy();
    let drop = weight * (libm::cos(end[0]) - libm::cos(start));
    assert!((energy.dissipated - drop).abs() < 1e-5 * drop);
}

/// Friction by the load holds motor and arm together, and the motor alone not: time goes on
/// nevertheless, and the arm comes to rest.
#[test]
fn friction_of_the_load_does_not_stop_time_at_the_teeth() {
    let mut servo = with_backlash(0.035);
    servo.friction.external_load = 1.0;
    let outputs = ["servo/angle", "servo/rate"];
    let mut run = Run::new(&servo, &outputs, [0.0, 0.0]);
    run.at(0.3, [1.0, 1.0]);
    let [mut before, mut still] = [f64::NAN, 0.0];
    for step in 1..500 {
        let found = run.at(0.3 + f64::from(step) * 2e-3, OFF);
        // Neither in motion nor at another angle.
        still = f64::max(
            still,
            if found[0] == before {
                found[1].abs()
            } else {
                0.0
            },
        );
        before = found[0];
    }
    assert_eq!(still, 0.0);
}

/// The less backlash there is, the less does it change.
#[test]
fn motion_without_backlash_is_the_limit_of_that_with_little() {
    let trajectory = |backlash: f64| {
        let servo = with_backlash(backlash);
        let mut run = Run::new(&servo, &["servo/angle"], [0.3, 0.0]);
        let goal = |step: u32| libm::sin(f64::from(step) * 0.02);
        let steps = (1..400_u32).map(|step| run.at(f64::from(step) * 5e-3, [goal(step), 1.0])[0]);
        steps.collect::<Vec<_>>()
    };
    let without = trajectory(0.0);
    let change = |backlash: f64| {
        let with = trajectory(backlash);
        let pairs = with.iter().zip(&without);
        pairs.fold(0.0_f64, |most, (one, other)| most.max((one - other).abs()))
    };
    let changes = [1e-2, 1e-3, 1e-4].map(change);
    println!("{changes:?}");
    assert!(changes.is_sorted_by(|one, other| one > other));
    // Of the order of the backlash itself.
    assert!(changes[2] < 5e-4, "{changes:?}");
}

proptest! {
    /// Impacts take energy, the gap gives none back, and the lead stays within it.
    #[test]
    fn energy_within_the_backlash_is_accounted_for(
        backlash in 0.001_f64..0.3, coulomb in 0.0_f64..0.03, driven in 0.0_f64..0.5,
        external_load in prop_oneof![Just(0.0), 0.0_f64..1.0], start in -2.0_f64..2.0,
        goal in -2.0_f64..2.0,
    ) {
        let residual = |period: f64| {
            let mut servo = sound();
            servo.controller.quantized = false;
            servo.controller.period = period;
            servo.friction.coulomb = coulomb;
            servo.gear.driven = driven;
            servo.friction.external_load = external_load;
            servo.gear.backlash = backlash;
            let mut run = Run::new(&servo, &[], [start, 0.0]);
            let mut dissipated = 0.0;
            for step in 1..100 {
                run.at(f64::from(step) * 12e-3, [goal, f64::from(u8::from(step < 40))]);
                let energy = run.bench.energy();
                assert!(energy.dissipated >= dissipated);
                dissipated = energy.dissipated;
                let state = run.bench.state().unwrap();
                let lead = state.get("servo/motor/lead").map_or(0.0, |lead| lead[0]);
                assert!(lead.abs() <= 0.5 * backlash, "{lead}");
            }
            run.bench.energy().residual.abs()
        };
        let fine = residual(0.5e-3);
        prop_assert!(fine < 2e-3, "{fine} J");
    }
}
