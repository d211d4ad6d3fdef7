//! Linear set-points: approach over a period, then held.

use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_legged::LeggedPlant;
use twinrig_runtime::Plant;

use crate::fixture::{Integral, STEP, Step, hip, plant, plant_with_ramps};

/// Neither a multiple of the step nor a divisor.
const PERIOD: SimDuration = SimDuration::from_micros(4_700);

fn at(micros: u64) -> SimTime {
    SimTime::ZERO + SimDuration::from_micros(micros)
}

/// Returns the set-point at the end of a step.
fn end(step: &Step) -> f64 {
    step.start + step.rate * step.seconds
}

/// Returns the set-point that applies now.
fn set_point(plant: &LeggedPlant<Integral>) -> f64 {
    plant.dynamics().steps.last().map_or(0.0, end)
}

#[test]
fn command_is_approached_over_the_period_and_held_when_the_next_is_late() {
    let mut plant = plant_with_ramps(PERIOD);
    plant.advance(at(20_000), &[2.0]).unwrap();
    let steps = &plant.dynamics().steps;
    let split = steps.iter().position(|step| step.rate == 0.0).unwrap();
    assert_eq!(steps[split].from, SimTime::ZERO + PERIOD);
    for step in &steps[..split] {
        let exact = 2.0 * step.from.as_secs_f64() / PERIOD.as_secs_f64();
        assert!((step.start - exact).abs() < 1e-15);
        assert!((step.mean - (step.start + 0.5 * step.seconds * step.rate)).abs() < 1e-15);
    }
    for step in &steps[split..] {
        assert_eq!([step.start, step.rate, step.mean], [2.0, 0.0, 2.0]);
    }
    // ∫ set-point dt: half the command over the period, all of it afterwards; exact because steps
    // end at the end of the approach.
    let exact = 2.0 * (20e-3 - 0.5 * PERIOD.as_secs_f64());
    assert!(
        (hip(&plant) - exact).abs() < 1e-15,
        "{}",
        hip(&plant) - exact
    );
}

#[test]
fn early_command_starts_from_where_the_set_point_is() {
    let mut plant = plant_with_ramps(PERIOD);
    plant.advance(at(2_350), &[2.0]).unwrap();
    plant.advance(at(20_000), &[-1.0]).unwrap();
    let steps = &plant.dynamics().steps;
    let turn = steps
        .iter()
        .position(|step| step.from == at(2_350))
        .unwrap();
    assert_eq!(steps[turn].start, 1.0, "half of the way");
    assert!((steps[turn].rate + 2.0 / PERIOD.as_secs_f64()).abs() < 1e-9);
    let held = steps.iter().position(|step| step.rate == 0.0).unwrap();
    assert_eq!(
        (steps[held].from, steps[held].start),
        (at(2_350) + PERIOD, -1.0)
    );
}

#[test]
fn held_set_points_are_the_commands_and_have_no_rate() {
    let mut plant = plant();
    plant.advance(at(2_500), &[2.0]).unwrap();
    plant.advance(at(5_000), &[-1.0]).unwrap();
    let inputs = plant.dynamics().steps.iter();
    let inputs: Vec<[f64; 3]> = inputs
        .map(|step| [step.start, step.rate, step.mean])
        .collect();
    let (two, minus) = ([2.0, 0.0, 2.0], [-1.0, 0.0, -1.0]);
    assert_eq!(inputs, [two, two, two, minus, minus, minus]);
}

#[test]
fn snapshot_of_held_set_points_is_refused_and_changes_nothing() {
    let mut linear = plant_with_ramps(PERIOD);
    linear.advance(at(2_000), &[1.0]).unwrap();
    let before = linear.save();
    assert!(linear.restore(&plant().save()).is_err());
    assert!(plant().restore(&before).is_err());
    assert_eq!(linear.save(), before);
}

#[test]
fn resumed_plant_approaches_from_its_initial_inputs() {
    let mut from = plant_with_ramps(PERIOD);
    from.advance(at(2_000), &[1.0]).unwrap();
    let mut to = plant_with_ramps(PERIOD);
    to.advance(at(7_000), &[3.0]).unwrap();
    to.resume_from(&from.state().unwrap()).unwrap();
    to.dynamics_mut().steps.clear();
    to.advance(at(2_500), &[4.0]).unwrap();
    assert_eq!(to.dynamics().steps[0].start, 0.0);
}

/// Commands with the time to the next one \[µs\]; some equal the one before.
fn commands() -> impl Strategy<Value = Vec<(f64, u64)>> {
    let command = prop_oneof![Just(0.5), Just(-0.5), -1.0..1.0_f64];
    prop::collection::vec((command, 1..12_000_u64), 1..12)
}

/// Advances through the commands, each in pieces of at most `piece` \[µs\].
fn advance(plant: &mut LeggedPlant<Integral>, commands: &[(f64, u64)], piece: u64) {
    let mut now = 0;
    for &(command, length) in commands {
        let until = now + length;
        while now < until {
            now = until.min(now + piece);
            plant.advance(at(now), &[command]).unwrap();
        }
    }
}

proptest! {
    /// Continuous, within the step bound, never steeper than from the greatest to the least command
    /// in a period, and at the command after a period.
    #[test]
    fn set_points_are_continuous_and_arrive(commands in commands()) {
        let mut plant = plant_with_ramps(PERIOD);
        let mut now = 0;
        for &(command, length) in &commands {
            let before = set_point(&plant);
            let first = plant.dynamics().steps.len();
            now += length;
            plant.advance(at(now), &[command]).unwrap();
            let steps = &plant.dynamics().steps;
            prop_assert!((steps[first].start - before).abs() < 1e-12);
            for pair in steps[first..].windows(2) {
                prop_assert!((end(&pair[0]) - pair[1].start).abs() < 1e-12);
            }
            for step in &steps[first..] {
                prop_assert!(step.seconds <= STEP.as_secs_f64());
                prop_assert!(step.rate.abs() <= 2.0 / PERIOD.as_secs_f64());
            }
            if length >= PERIOD.as_nanos() / 1_000 {
                prop_assert!((set_point(&plant) - command).abs() < 1e-12);
            }
        }
    }

    /// An equal command is no arrival: where an advance is divided changes no set-point.
    #[test]
    fn repeated_command_changes_nothing(commands in commands(), piece in 1..3_000_u64) {
        let [mut whole, mut divided] = [plant_with_ramps(PERIOD), plant_with_ramps(PERIOD)];
        advance(&mut whole, &commands, u64::MAX / 2);
        advance(&mut divided, &commands, piece);
        for step in &whole.dynamics().steps {
            let mut same = divided.dynamics().steps.iter();
            if let Some(other) = same.find(|other| other.from == step.from) {
                prop_assert_eq!((other.start, other.rate), (step.start, step.rate));
            }
        }
        prop_assert!((set_point(&whole) - set_point(&divided)).abs() < 1e-12);
        prop_assert!((hip(&whole) - hip(&divided)).abs() < 1e-12);
    }

    /// Also in the middle of an approach.
    #[test]
    fn restored_set_points_continue_bit_for_bit(commands in commands(), split in 0..12_usize) {
        let split = split.min(commands.len());
        let mut plant = plant_with_ramps(PERIOD);
        advance(&mut plant, &commands[..split], 900);
        let saved = plant.save();
        let begin = plant.dynamics().steps.len();
        let rest = |plant: &mut LeggedPlant<Integral>| {
            let mut now: u64 = commands[..split].iter().map(|(_, length)| length).sum();
            for &(command, length) in &commands[split..] {
                now += length;
                plant.advance(at(now), &[command]).unwrap();
            }
        };
        rest(&mut plant);
        let mut other = plant_with_ramps(PERIOD);
        advance(&mut other, &[(0.9, 3_000)], 900);
        other.dynamics_mut().steps.clear();
        other.restore(&saved).unwrap();
        rest(&mut other);
        prop_assert_eq!(&other.dynamics().steps[..], &plant.dynamics().steps[begin..]);
        prop_assert_eq!(other.save(), plant.save());
    }
}
