//! A plant that keeps its step, whenever boards sample and actuate.

mod oscillator;
mod toys;

use std::f64::consts::{PI, TAU};

use oscillator::{Board, Oscillator, Shape, driven};
use proptest::prelude::*;
use toys::ToyPlant;
use twinrig_kernel::{SimDuration, SimTime, SnapshotError};
use twinrig_runtime::{FixedStepCoupling, GridInputs, Plant};

const STEP: SimDuration = SimDuration::from_micros(500);
const RULES: [GridInputs; 2] = [GridInputs::Mean, GridInputs::Held];

fn at(micros: u64) -> SimTime {
    SimTime::ZERO + SimDuration::from_micros(micros)
}

fn on_grid(plant: impl Plant + 'static, step: SimDuration, rule: GridInputs) -> FixedStepCoupling {
    FixedStepCoupling::new(Box::new(plant), step, rule, &|_| true).unwrap()
}

fn toy() -> ToyPlant {
    ToyPlant::new(&["a".to_owned(), "b".to_owned()])
}

/// What somebody does to a plant at an instant.
#[derive(Clone, Debug)]
struct Deed {
    /// After the one before \[µs\].
    after: u64,
    command: Option<(usize, f64)>,
    window: bool,
}

fn deeds() -> impl Strategy<Value = Vec<Deed>> {
    let command = proptest::option::of((0..2_usize, prop_oneof![Just(-0.0), -1e3..1e3]));
    let deed = (1..1_700_u64, command, any::<bool>());
    let deed = deed.prop_map(|(after, command, window)| Deed {
        after,
        command,
        window,
    });
    proptest::collection::vec(deed, 1..40)
}

/// Does `deeds` to `plant` and sees it at each, and what is seen, as bits.
fn done(plant: &mut dyn Plant, from: SimTime, inputs: &mut [f64], deeds: &[Deed]) -> Vec<Vec<u64>> {
    let mut now = from;
    let mut outputs = vec![0.0; 4];
    let seen = deeds.iter().map(|deed| {
        now += SimDuration::from_micros(deed.after);
        plant.advance(now, inputs).unwrap();
        plant.observe(&mut outputs);
        if deed.window {
            plant.begin_window();
        }
        if let Some((n, command)) = deed.command {
            inputs[n] = command;
        }
        outputs.iter().map(|output| output.to_bits()).collect()
    });
    seen.collect()
}

fn end(deeds: &[Deed]) -> SimTime {
    deeds.iter().fold(SimTime::ZERO, |now, deed| {
        now + SimDuration::from_micros(deed.after)
    })
}

proptest! {
    /// Whoever meets the plant at instants of the grid, and at all of them, notices nothing of it.
    #[test]
    fn on_the_grid_it_is_the_plant_itself(mut deeds in deeds(), ahead in any::<bool>()) {
        for deed in &mut deeds {
            deed.after = 500;
        }
        let mut alone = toy();
        let mut coupled = on_grid(toy(), STEP, RULES[usize::from(ahead)]);
        prop_assert_eq!(coupled.ports(), alone.ports());
        let one = done(&mut alone, SimTime::ZERO, &mut [0.5, -0.0], &deeds);
        let other = done(&mut coupled, SimTime::ZERO, &mut [0.5, -0.0], &deeds);
        prop_assert_eq!(one, other);
    }

    /// And between them it goes on as it did, wherever it was saved.
    #[test]
    fn what_is_saved_within_a_step_goes_on_as_it_did(
        deeds in deeds(), cut in 0.0..1.0, ahead in any::<bool>()
    ) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place in a short list")]
        let cut = (cut * deeds.len() as f64) as usize;
        let make = || on_grid(toy(), STEP, RULES[usize::from(ahead)]);
        let (mut first, mut inputs) = (make(), [0.5, -1.0]);
        done(&mut first, SimTime::ZERO, &mut inputs, &deeds[..cut]);
        let (saved, from) = (first.save(), end(&deeds[..cut]));
        let mut second = make();
        second.restore(&saved).unwrap();
        let mut again = inputs;
        prop_assert_eq!(
            done(&mut first, from, &mut inputs, &deeds[cut..]),
            done(&mut second, from, &mut again, &deeds[cut..])
        );
        prop_assert_eq!(first.save(), second.save());
    }

    /// Being moved to other instants without being told anything changes no bit: only commands do.
    #[test]
    fn looking_more_often_changes_nothing(
        deeds in deeds(), looks in proptest::collection::vec(1..1_700_u64, 1..20), ahead in any::<bool>()
    ) {
        let rule = RULES[usize::from(ahead)];
        let mut looked_at = Vec::new();
        let mut looks = looks.iter().cycle();
        for deed in &deeds {
            let mut rest = deed.after;
            while let Some(&look) = looks.next().filter(|&&look| look < rest) {
                looked_at.push(Deed { after: look, command: None, window: false });
                rest -= look;
            }
            looked_at.push(Deed { after: rest, ..deed.clone() });
        }
        let mut few = on_grid(toy(), STEP, rule);
        let mut many = on_grid(toy(), STEP, rule);
        done(&mut few, SimTime::ZERO, &mut [0.5, -1.0], &deeds);
        done(&mut many, SimTime::ZERO, &mut [0.5, -1.0], &looked_at);
        prop_assert_eq!(few.save(), many.save());
        // Nor does anybody cut its steps.
        let last = end(&deeds).since_start().as_nanos();
        let steps = [last / STEP.as_nanos(), last.div_ceil(STEP.as_nanos())];
        prop_assert_eq!(many.work().steps, steps[usize::from(ahead)]);
    }
}

#[test]
fn a_grid_of_nothing_is_refused_and_so_is_a_snapshot_of_another() {
    assert!(
        FixedStepCoupling::new(
            Box::new(toy()),
            SimDuration::ZERO,
            GridInputs::Held,
            &|_| { true }
        )
        .is_err()
    );
    let mut coupled = on_grid(toy(), STEP, GridInputs::Mean);
    let before = coupled.save();
    for other in [
        on_grid(toy(), STEP * 2, GridInputs::Mean),
        on_grid(toy(), STEP, GridInputs::Held),
        on_grid(ToyPlant::new(&["a".to_owned()]), STEP, GridInputs::Mean),
    ] {
        let refused = coupled.restore(&other.save());
        assert!(matches!(refused, Err(SnapshotError::Mismatch { .. })));
        assert_eq!(coupled.save(), before);
    }
}

#[test]
fn a_fault_says_when_the_plant_was_last_sound() {
    for (rule, sound, fails) in [
        (GridInputs::Mean, 1_200, 1_600),
        (GridInputs::Held, 700, 1_200),
    ] {
        let mut plant = toy();
        plant.fails_at = Some(at(1_500));
        let mut coupled = on_grid(plant, STEP, rule);
        coupled.advance(at(sound), &[0.0; 2]).unwrap();
        // The step from 1 ms on fails: when it is over, or as soon as somebody wants to know of the time in it.
        let fault = coupled.advance(at(fails), &[0.0; 2]).unwrap_err();
        assert_eq!(fault.time, at(1_500));
        assert_eq!(coupled.work().steps, 2);
    }
}

#[test]
fn steps_allocate_nothing() {
    for rule in RULES {
        let mut coupled = on_grid(toy(), STEP, rule);
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
fn events_are_told_once_their_time_has_come() {
    let shape = Shape::default();
    let mut coupled = on_grid(Oscillator::new(shape), STEP, GridInputs::Held);
    coupled.log_events(true);
    let mut told = Vec::new();
    for n in 1..20_000 {
        coupled.advance(at(30 * n), &[0.0]).unwrap();
        let now_s = at(30 * n).as_secs_f64();
        assert!(coupled.events().iter().all(|event| event.at_s <= now_s));
        told.push(coupled.events().len());
    }
    // It crosses the middle every 79 ms, and the plant tells so half a step ahead of time.
    assert!(
        told.is_sorted() && told[told.len() - 1] == 8,
        "{:?}",
        told.last()
    );
}

#[test]
fn what_nobody_wants_is_not_told_and_changes_nothing() {
    let all = |_: &str| true;
    let some = |name: &str| name != "mass/velocity";
    assert!(
        FixedStepCoupling::needs("mass/velocity", &some)
            && !FixedStepCoupling::needs("mass/velocity", &|_| false)
    );
    let make = |shown: &dyn Fn(&str) -> bool| {
        let plant = Oscillator::new(Shape::default());
        FixedStepCoupling::new(Box::new(plant), STEP, GridInputs::Mean, shown).unwrap()
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

/// What boards see of a free oscillator is wrong by the curves alone, and those are known in closed form: with x⁗ = ω⁴x at most
/// (ωH)⁴A/384 and (ωH)⁴A/24, with and without the velocity; with ẍ = −ω²x at most (ωH)²A/2 and (ωH)²A.
#[test]
fn cubics_are_of_fourth_order_and_lines_of_second() {
    for (rule, tells_velocity, power, over) in [
        (GridInputs::Held, true, 4, 384.0),
        (GridInputs::Held, false, 4, 24.0),
        (GridInputs::Mean, true, 2, 2.0),
        (GridInputs::Mean, false, 2, 1.0),
    ] {
        let shape = Shape {
            tells_velocity,
            ..Shape::default()
        };
        let mut errors = Vec::new();
        for micros in [2_000, 1_000, 500, 250] {
            let step = SimDuration::from_micros(micros);
            let mut plant = on_grid(Oscillator::new(shape), step, rule);
            let mut worst = 0.0_f64;
            for n in 1..20_000 {
                let now = at(97 * n);
                plant.advance(now, &[0.0]).unwrap();
                let mut outputs = [0.0; 2];
                plant.observe(&mut outputs[..if tells_velocity { 2 } else { 1 }]);
                // The first three steps have no four rows to go by.
                if now > at(3 * micros) {
                    worst = worst.max((outputs[0] - Oscillator::free(shape, now)).abs());
                }
            }
            let phase = shape.frequency * step.as_secs_f64();
            let bound = (0..power).fold(1.0, |product, _| product * phase) / over;
            // The greatest derivative is met somewhere in so many periods; 1e-12 is what thousands of steps lose by rounding.
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

fn away(from: &[f64], to: &[f64]) -> f64 {
    let squares: f64 = from.iter().zip(to).map(|(a, b)| (a - b) * (a - b)).sum();
    (squares / to.len() as f64).sqrt()
}

/// Two boards with a digital controller each, whose ticks have nothing to do with the grid nor with each other. Everything but
/// the coupling is exact.
#[test]
fn behind_is_of_second_order_and_ahead_of_first() {
    let exact = driven(&mut Oscillator::new(Shape::default()), &BOARDS);
    let errors = |rule: GridInputs| {
        [2_000, 1_000, 500, 250, 125].map(|micros| {
            let step = SimDuration::from_micros(micros);
            let mut plant = on_grid(Oscillator::new(Shape::default()), step, rule);
            away(&driven(&mut plant, &BOARDS), &exact)
        })
    };
    let (behind, ahead) = (errors(GridInputs::Mean), errors(GridInputs::Held));
    let order = |errors: &[f64; 5]| libm::log2(errors[0] / errors[4]) / 4.0;
    // Where ticks fall within steps is another for each of them, so a pair of errors tells less than all do.
    assert!((order(&behind) - 2.0).abs() < 0.2, "{behind:?}");
    assert!((order(&ahead) - 1.0).abs() < 0.2, "{ahead:?}");
    for (behind, ahead) in behind.iter().zip(&ahead) {
        assert!(50.0 * behind < *ahead, "{behind} {ahead}");
    }
}

/// Half a step late in the mean: what a delay of just so much does to the same loop, to first order.
#[test]
fn ahead_is_half_a_step_late() {
    let exact = driven(&mut Oscillator::new(Shape::default()), &BOARDS);
    let step = 250;
    let mut plant = on_grid(
        Oscillator::new(Shape::default()),
        SimDuration::from_micros(step),
        GridInputs::Held,
    );
    let ahead = driven(&mut plant, &BOARDS);
    let delay = Shape {
        delay_us: step / 2,
        ..Shape::default()
    };
    let delayed = driven(&mut Oscillator::new(delay), &BOARDS);
    // What is left is of second order, and how the phases happen to fall.
    let rest = away(&ahead, &delayed) / away(&ahead, &exact);
    assert!(rest < 0.15, "{rest}");
}

/// What turns evenly is seen as it is on every line and cubic, but for the orientation, whose components are sine and cosine of
/// half the angle.
#[test]
fn angles_and_orientations_go_the_short_way_round() {
    const STEP: SimDuration = SimDuration::from_millis(4);
    let shape = Shape {
        turns: true,
        ..Shape::default()
    };
    // After the end of a step an angle is counted on beyond a half turn, by what it turns in a step at most.
    let beyond = Oscillator::turned(at(4_000));
    for (rule, most, off_most) in [
        (GridInputs::Held, PI + 1e-12, 1e-8),
        (GridInputs::Mean, PI + beyond, 1e-6),
    ] {
        let mut plant = on_grid(Oscillator::new(shape), STEP, rule);
        // The first steps have nothing to go by.
        plant.advance(at(12_000), &[0.0]).unwrap();
        for n in 37..3_000 {
            let now = at(333 * n);
            plant.advance(now, &[0.0]).unwrap();
            let mut outputs = [0.0; 5];
            plant.observe(&mut outputs);
            let expected = Oscillator::turned(now);
            let off = outputs[0] - expected;
            let off = off - TAU * (off / TAU).round();
            assert!(off.abs() < 1e-9, "{now}: {} {expected}", outputs[0]);
            assert!(outputs[0].abs() <= most, "{now}: {}", outputs[0]);
            let length: f64 = outputs[1..].iter().map(|q| q * q).sum();
            assert!((length - 1.0).abs() < 1e-12);
            let half = expected / 2.0;
            let along = outputs[1] * libm::cos(half) + outputs[4] * libm::sin(half);
            // Off by (ωH/2)² = 5e-4 at most on a line, much less on a cubic, and 1 − cos of that.
            assert!(along.abs() > 1.0 - off_most, "{now}: {along}");
        }
    }
}
