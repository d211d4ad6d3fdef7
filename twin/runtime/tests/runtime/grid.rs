//! Fixed-step coupling.

use std::f64::consts::{PI, TAU};

use crate::oscillator::{Board, Oscillator, Shape, driven};
use crate::toys::ToyPlant;
use proptest::prelude::*;
use twinrig_kernel::{Port, SimDuration, SimTime, SnapshotError, Unit};
use twinrig_runtime::{FixedStepCoupling, GridInputs, Plant};

const STEP: SimDuration = SimDuration::from_micros(500);
const GRID_INPUTS: [GridInputs; 2] = [GridInputs::Mean, GridInputs::Held];

fn at(micros: u64) -> SimTime {
    SimTime::ZERO + SimDuration::from_micros(micros)
}

fn couple(
    plant: impl Plant + 'static,
    step: SimDuration,
    grid_inputs: GridInputs,
) -> FixedStepCoupling {
    FixedStepCoupling::new(Box::new(plant), step, grid_inputs, &|_| true).unwrap()
}

fn toy() -> ToyPlant {
    ToyPlant::new(&["a".to_owned(), "b".to_owned()])
}

/// Access to a plant at an instant.
#[derive(Clone, Debug)]
struct Action {
    /// Time since the previous action \[µs\].
    after: u64,
    command: Option<(usize, f64)>,
    window: bool,
}

fn actions() -> impl Strategy<Value = Vec<Action>> {
    let command = proptest::option::of((0..2_usize, prop_oneof![Just(-0.0), -1e3..1e3]));
    let action = (1..1_700_u64, command, any::<bool>());
    let action = action.prop_map(|(after, command, window)| Action {
        after,
        command,
        window,
    });
    proptest::collection::vec(action, 1..40)
}

/// Applies `actions` to `plant`; returns the outputs at each, as bits.
fn apply(
    plant: &mut dyn Plant,
    from: SimTime,
    inputs: &mut [f64],
    actions: &[Action],
) -> Vec<Vec<u64>> {
    let mut now = from;
    let mut outputs = vec![0.0; 4];
    let samples = actions.iter().map(|action| {
        now += SimDuration::from_micros(action.after);
        plant.advance(now, inputs).unwrap();
        plant.observe(&mut outputs);
        if action.window {
            plant.begin_window();
        }
        if let Some((n, command)) = action.command {
            inputs[n] = command;
        }
        outputs.iter().map(|output| output.to_bits()).collect()
    });
    samples.collect()
}

fn end(actions: &[Action]) -> SimTime {
    actions.iter().fold(SimTime::ZERO, |now, action| {
        now + SimDuration::from_micros(action.after)
    })
}

proptest! {
    /// With access at all instants of the grid and no others the coupling has no effect.
    #[test]
    fn coupling_is_exact_on_the_grid(mut actions in actions(), held in any::<bool>()) {
        for action in &mut actions {
            action.after = 500;
        }
        let mut direct = toy();
        let mut coupled = couple(toy(), STEP, GRID_INPUTS[usize::from(held)]);
        prop_assert_eq!(coupled.ports(), direct.ports());
        let one = apply(&mut direct, SimTime::ZERO, &mut [0.5, -0.0], &actions);
        let other = apply(&mut coupled, SimTime::ZERO, &mut [0.5, -0.0], &actions);
        prop_assert_eq!(one, other);
    }

    /// A snapshot taken between grid instants is complete.
    #[test]
    fn restored_plant_continues_bit_for_bit_within_a_step(
        actions in actions(), cut in 0.0..1.0, held in any::<bool>()
    ) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index into a short list")]
        let cut = (cut * actions.len() as f64) as usize;
        let make = || couple(toy(), STEP, GRID_INPUTS[usize::from(held)]);
        let (mut first, mut inputs) = (make(), [0.5, -1.0]);
        apply(&mut first, SimTime::ZERO, &mut inputs, &actions[..cut]);
        let (saved, from) = (first.save(), end(&actions[..cut]));
        let mut second = make();
        second.restore(&saved).unwrap();
        let mut again = inputs;
        prop_assert_eq!(
            apply(&mut first, from, &mut inputs, &actions[cut..]),
            apply(&mut second, from, &mut again, &actions[cut..])
        );
        prop_assert_eq!(first.save(), second.save());
    }

    /// Additional instants without new commands change no bit.
    #[test]
    fn additional_observations_have_no_effect(
        actions in actions(), intervals in proptest::collection::vec(1..1_700_u64, 1..20), held in any::<bool>()
    ) {
        let grid_inputs = GRID_INPUTS[usize::from(held)];
        let mut refined = Vec::new();
        let mut intervals = intervals.iter().cycle();
        for action in &actions {
            let mut remainder = action.after;
            while let Some(&interval) = intervals.next().filter(|&&interval| interval < remainder) {
                refined.push(Action { after: interval, command: None, window: false });
                remainder -= interval;
            }
            refined.push(Action { after: remainder, ..action.clone() });
        }
        let mut few = couple(toy(), STEP, grid_inputs);
        let mut many = couple(toy(), STEP, grid_inputs);
        apply(&mut few, SimTime::ZERO, &mut [0.5, -1.0], &actions);
        apply(&mut many, SimTime::ZERO, &mut [0.5, -1.0], &refined);
        prop_assert_eq!(few.save(), many.save());
        // The plant's steps are not divided.
        let last = end(&actions).since_start().as_nanos();
        let steps = [last / STEP.as_nanos(), last.div_ceil(STEP.as_nanos())];
        prop_assert_eq!(many.work().steps, steps[usize::from(held)]);
    }
}

#[test]
fn zero_step_and_foreign_snapshots_are_refused() {
    assert!(
        FixedStepCoupling::new(
            Box::new(toy()),
            SimDuration::ZERO,
            GridInputs::Held,
            &|_| { true }
        )
        .is_err()
    );
    let mut coupled = couple(toy(), STEP, GridInputs::Mean);
    let before = coupled.save();
    for other in [
        couple(toy(), STEP * 2, GridInputs::Mean),
        couple(toy(), STEP, GridInputs::Held),
        couple(ToyPlant::new(&["a".to_owned()]), STEP, GridInputs::Mean),
    ] {
        let refused = coupled.restore(&other.save());
        assert!(matches!(refused, Err(SnapshotError::Mismatch { .. })));
        assert_eq!(coupled.save(), before);
    }
}

#[test]
fn fault_has_the_time_of_the_last_valid_state() {
    for (grid_inputs, valid, fails) in [
        (GridInputs::Mean, 1_200, 1_600),
        (GridInputs::Held, 700, 1_200),
    ] {
        let mut plant = toy();
        plant.fails_at = Some(at(1_500));
        let mut coupled = couple(plant, STEP, grid_inputs);
        coupled.advance(at(valid), &[0.0; 2]).unwrap();
        // The step from 1 ms on fails: at its end with mean inputs, at the first sample in it with
        // held inputs.
        let fault = coupled.advance(at(fails), &[0.0; 2]).unwrap_err();
        assert_eq!(fault.time, at(1_500));
        assert_eq!(coupled.work().steps, 2);
    }
}

#[test]
fn steps_allocate_nothing() {
    for grid_inputs in GRID_INPUTS {
        let mut coupled = couple(toy(), STEP, grid_inputs);
        let (mut inputs, mut outputs) = ([0.0; 2], [0.0; 4]);
        let mut run = |from: u64, to: u64| {
            for n in from..to {
                inputs[0] = if n % 3 == 0 { 1.0 } else { -1.0 };
                coupled.advance(at(170 * n), &inputs).unwrap();
                coupled.observe(&mut outputs);
            }
        };
        run(1, 10);
        let allocations = allocation_counter::measure(|| run(10, 1_000));
        assert_eq!(allocations.count_total, 0);
    }
}

#[test]
fn events_are_reported_once_their_time_has_passed() {
    let shape = Shape::default();
    let mut coupled = couple(Oscillator::new(shape), STEP, GridInputs::Held);
    coupled.log_events(true);
    let mut counts = Vec::new();
    for n in 1..20_000 {
        coupled.advance(at(30 * n), &[0.0]).unwrap();
        let now_s = at(30 * n).as_secs_f64();
        assert!(coupled.events().iter().all(|event| event.at_s <= now_s));
        counts.push(coupled.events().len());
    }
    // The mass crosses zero every 79 ms; the plant logs this up to half a step ahead of time.
    assert!(
        counts.is_sorted() && counts[counts.len() - 1] == 8,
        "{:?}",
        counts.last()
    );
}

#[test]
fn unselected_output_is_absent_and_has_no_effect() {
    let all = |_: &str| true;
    let some = |name: &str| name != "mass/velocity";
    let velocity = Port::output("mass/velocity", Unit::MeterPerSecond, 1).rate_of("mass/position");
    assert!(
        FixedStepCoupling::needs(&velocity, &some)
            && !FixedStepCoupling::needs(&velocity, &|_| false)
    );
    let make = |exposed: &dyn Fn(&str) -> bool| {
        let plant = Oscillator::new(Shape::default());
        FixedStepCoupling::new(Box::new(plant), STEP, GridInputs::Mean, exposed).unwrap()
    };
    let (mut one, mut other) = (make(&all), make(&some));
    let names: Vec<String> = other.ports().into_iter().map(|port| port.name).collect();
    assert_eq!(names, ["mass/force", "mass/position"]);
    for n in 1..100 {
        let (mut full, mut bare) = ([0.0; 2], [0.0; 1]);
        for (plant, outputs) in [(&mut one, &mut full[..]), (&mut other, &mut bare[..])] {
            plant.advance(at(130 * n), &[1.0]).unwrap();
            plant.observe(outputs);
        }
        assert_eq!(full[0].to_bits(), bare[0].to_bits());
    }
}

/// Samples of a free oscillator have interpolation errors only, whose bounds are known in closed
/// form: with x⁗ = ω⁴x at most (ωH)⁴A/384 and (ωH)⁴A/24, with and without the velocity; with ẍ =
/// −ω²x at most (ωH)²A/2 and (ωH)²A.
#[test]
fn cubics_are_of_fourth_order_and_lines_of_second() {
    for (grid_inputs, outputs_velocity, power, divisor) in [
        (GridInputs::Held, true, 4, 384.0),
        (GridInputs::Held, false, 4, 24.0),
        (GridInputs::Mean, true, 2, 2.0),
        (GridInputs::Mean, false, 2, 1.0),
    ] {
        let shape = Shape {
            outputs_velocity,
            ..Shape::default()
        };
        let mut errors = Vec::new();
        for micros in [2_000, 1_000, 500, 250] {
            let step = SimDuration::from_micros(micros);
            let mut plant = couple(Oscillator::new(shape), step, grid_inputs);
            let mut worst = 0.0_f64;
            for n in 1..20_000 {
                let now = at(97 * n);
                plant.advance(now, &[0.0]).unwrap();
                let mut outputs = [0.0; 2];
                plant.observe(&mut outputs[..if outputs_velocity { 2 } else { 1 }]);
                // The first three steps have fewer than four rows.
                if now > at(3 * micros) {
                    worst = worst.max((outputs[0] - Oscillator::free(shape, now)).abs());
                }
            }
            let phase = shape.frequency * step.as_secs_f64();
            let bound = (0..power).fold(1.0, |product, _| product * phase) / divisor;
            // The maximum of the derivative is approached within so many periods; 1e-12 allows for
            // the rounding of thousands of steps.
            assert!(worst <= bound * 1.000_001 + 1e-12, "{worst} {bound}");
            assert!(worst > 0.8 * bound, "{worst} {bound}");
            errors.push(worst);
        }
        let last = libm::log2(errors[2] / errors[3]);
        assert!((last - f64::from(power)).abs() < 0.1, "{errors:?}");
    }
}

const BOARDS: [Board; 2] = [
    Board {
        period: 1_013,
        phase: 211,
    },
    Board {
        period: 1_409,
        phase: 730,
    },
];

fn rms_difference(from: &[f64], to: &[f64]) -> f64 {
    let squares: f64 = from.iter().zip(to).map(|(a, b)| (a - b) * (a - b)).sum();
    (squares / to.len() as f64).sqrt()
}

/// Two boards with a digital controller each, whose ticks are unrelated to the grid and to each
/// other. All but the coupling is exact.
#[test]
fn mean_inputs_are_of_second_order_and_held_inputs_of_first() {
    let exact = driven(&mut Oscillator::new(Shape::default()), &BOARDS);
    let errors = |grid_inputs: GridInputs| {
        [2_000, 1_000, 500, 250, 125].map(|micros| {
            let step = SimDuration::from_micros(micros);
            let mut plant = couple(Oscillator::new(Shape::default()), step, grid_inputs);
            rms_difference(&driven(&mut plant, &BOARDS), &exact)
        })
    };
    let (mean, held) = (errors(GridInputs::Mean), errors(GridInputs::Held));
    let order = |errors: &[f64; 5]| libm::log2(errors[0] / errors[4]) / 4.0;
    // The phases of the ticks within steps vary with the step, so the order is taken over all steps
    // and not over pairs.
    assert!((order(&mean) - 2.0).abs() < 0.2, "{mean:?}");
    assert!((order(&held) - 1.0).abs() < 0.2, "{held:?}");
    for (mean, held) in mean.iter().zip(&held) {
        assert!(50.0 * mean < *held, "{mean} {held}");
    }
}

/// Held inputs are late by half a step in the mean: equivalent to that delay in the loop, to first
/// order.
#[test]
fn held_inputs_delay_by_half_a_step() {
    let exact = driven(&mut Oscillator::new(Shape::default()), &BOARDS);
    let step = 250;
    let mut plant = couple(
        Oscillator::new(Shape::default()),
        SimDuration::from_micros(step),
        GridInputs::Held,
    );
    let held = driven(&mut plant, &BOARDS);
    let delay = Shape {
        delay_us: step / 2,
        ..Shape::default()
    };
    let delayed = driven(&mut Oscillator::new(delay), &BOARDS);
    // The remainder is of second order, and due to the phases.
    let remainder = rms_difference(&held, &delayed) / rms_difference(&held, &exact);
    assert!(remainder < 0.15, "{remainder}");
}

/// A uniform rotation is reproduced by lines and cubics, except for the orientation, whose
/// components are sine and cosine of half the angle.
#[test]
fn angles_and_orientations_take_the_shorter_rotation() {
    const STEP: SimDuration = SimDuration::from_millis(4);
    let shape = Shape {
        rotates: true,
        ..Shape::default()
    };
    // Extrapolated angles are not wrapped: they may exceed π by the rotation in a step.
    let beyond = Oscillator::angle_at(at(4_000));
    for (grid_inputs, angle_max, error_max) in [
        (GridInputs::Held, PI + 1e-12, 1e-8),
        (GridInputs::Mean, PI + beyond, 1e-6),
    ] {
        let mut plant = couple(Oscillator::new(shape), STEP, grid_inputs);
        // The first steps have too few rows.
        plant.advance(at(12_000), &[0.0]).unwrap();
        for n in 37..3_000 {
            let now = at(333 * n);
            plant.advance(now, &[0.0]).unwrap();
            let mut outputs = [0.0; 5];
            plant.observe(&mut outputs);
            let expected = Oscillator::angle_at(now);
            let error = outputs[0] - expected;
            let error = error - TAU * (error / TAU).round();
            assert!(error.abs() < 1e-9, "{now}: {} {expected}", outputs[0]);
            assert!(outputs[0].abs() <= angle_max, "{now}: {}", outputs[0]);
            let length: f64 = outputs[1..].iter().map(|q| q * q).sum();
            assert!((length - 1.0).abs() < 1e-12);
            let half = expected / 2.0;
            let dot = outputs[1] * libm::cos(half) + outputs[4] * libm::sin(half);
            // The error is (ωH/2)² = 5e-4 at most for a line, much less for a cubic; tested is 1 −
            // cos of it.
            assert!(dot.abs() > 1.0 - error_max, "{now}: {dot}");
        }
    }
}
