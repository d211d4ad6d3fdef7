//! Pushes in the plant: ends of steps, loads, signals and refusals.

use std::f64::consts::PI;

use crate::fixture::{STEP, plant};
use proptest::prelude::*;
use twinrig_kernel::{Direction, SimDuration, SimTime};
use twinrig_legged::{Base, LeggedError, Push, PushProblem, PushSchedule, PushShape, PushTarget};
use twinrig_runtime::Plant;

fn at(us: u64) -> SimTime {
    SimTime::ZERO + SimDuration::from_micros(us)
}

fn push(target: PushTarget, at_us: u64, for_us: u64, shape: PushShape) -> Push {
    Push {
        name: "shove".to_owned(),
        target,
        at: at(at_us),
        duration: SimDuration::from_micros(for_us),
        shape,
        peak: [3.0, -2.0, 1.0],
    }
}

#[test]
fn steps_end_where_a_push_begins_has_a_corner_or_ends() {
    let pushes = [
        push(PushTarget::TrunkTorque, 1_300, 2_000, PushShape::Triangle),
        push(
            PushTarget::Foot("LF".to_owned()),
            2_600,
            900,
            PushShape::HalfSine,
        ),
    ];
    let mut plant = plant().with_pushes(&pushes, &|_| false).unwrap();
    plant.advance(at(5_000), &[0.0; 2]).unwrap();
    assert_eq!(STEP, SimDuration::from_millis(1));
    let begins: Vec<SimTime> = plant
        .dynamics()
        .steps
        .iter()
        .map(|step| step.from)
        .collect();
    let expected = [0, 1_000, 1_300, 2_300, 2_600, 3_300, 3_500, 4_500].map(at);
    assert_eq!(begins, expected);
    let loads = &plant.dynamics().loads;
    let pushed: Vec<bool> = loads.iter().map(|load| !load.is_empty()).collect();
    assert_eq!(pushed, [false, false, true, true, true, true, false, false]);
    // The torque is greatest at the corner, where both pushes have passed a part of their time.
    assert_eq!(loads[3].at(0.0).torque, [3.0, -2.0, 1.0]);
    let share = 300e-6 / 2e-3;
    let torque = loads[4].at(0.0).torque[0];
    assert!(
        (torque - 3.0 * (1.0 - 2.0 * share)).abs() < 1e-12,
        "{torque}"
    );
    assert_eq!(loads[4].at(0.0).feet[0][0], 0.0);
    assert!(loads[4].at(450e-6).feet[0][0] > 2.999);
}

#[test]
fn signals_are_means_over_the_window_and_exist_where_a_push_needs_them() {
    let trunk = PushTarget::Trunk([0.0; 3]);
    let pushes = [push(trunk, 1_000, 2_000, PushShape::HalfSine)];
    let mut plant = plant().with_pushes(&pushes, &|_| true).unwrap();
    let outputs = plant.ports().into_iter();
    let outputs = outputs.filter(|port| port.direction == Direction::Output);
    let names: Vec<String> = outputs.map(|port| port.name).collect();
    assert_eq!(names, ["body/push/force", "energy/external"]);
    let mut sum = 0.0;
    for window in 0..8 {
        plant.begin_window();
        plant.advance(at(500 * (window + 1)), &[0.0; 2]).unwrap();
        let mut outputs = [0.0; 4];
        plant.observe(&mut outputs);
        assert!((outputs[0] / 3.0 - outputs[2]).abs() < 1e-12);
        sum += outputs[0] * 500e-6;
    }
    let impulse = 3.0 * 2e-3 * 2.0 / PI;
    assert!((sum - impulse).abs() < 1e-15, "{sum}");
}

#[test]
fn impossible_pushes_are_refused_with_the_reason() {
    let trunk = || PushTarget::Trunk([0.0; 3]);
    let foot = |leg: &str| PushTarget::Foot(leg.to_owned());
    let shape = PushShape::Rectangle;
    let refused = |base, push: Push| {
        let schedule = PushSchedule::new(&[push], base, &["LF"], &|_| true);
        match schedule.map(|_| ()) {
            Err(LeggedError::Push { why, .. }) => why,
            other => panic!("{other:?}"),
        }
    };
    let no_leg = refused(Base::Free, push(foot("RH"), 0, 1, shape));
    assert_eq!(no_leg, PushProblem::NoSuchLeg("RH".to_owned()));
    let fixed = refused(Base::Fixed, push(trunk(), 0, 1, shape));
    assert_eq!(fixed, PushProblem::FixedTrunk);
    assert_eq!(
        refused(Base::Free, push(trunk(), 0, 0, shape)),
        PushProblem::Duration
    );
    let nowhere = PushTarget::Trunk([f64::NAN, 0.0, 0.0]);
    assert_eq!(
        refused(Base::Free, push(nowhere, 0, 1, shape)),
        PushProblem::NotFinite
    );
    assert!(
        PushSchedule::new(
            &[push(foot("LF"), 0, 1, shape)],
            Base::Fixed,
            &["LF"],
            &|_| true
        )
        .is_ok()
    );
}

proptest! {
    /// The integral is that of the value, by Gauss's rule with five nodes on each side of the
    /// corner.
    #[test]
    fn integral_of_a_shape_is_that_of_its_value(
        from in 0.0..1.0_f64,
        to in 0.0..1.0_f64,
        which in 0..3_usize,
    ) {
        let shapes = [PushShape::Rectangle, PushShape::HalfSine, PushShape::Triangle];
        let (shape, from, to) = (shapes[which], from.min(to), from.max(to));
        let nodes = [
            (0.0, 128.0 / 225.0),
            (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
            (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
            (0.906_179_845_938_664, 0.236_926_885_056_189_08),
            (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
        ];
        let gauss = |a: f64, b: f64| {
            let value = |(x, w): &(f64, f64)| w * shape.value(0.5 * (a + b) + 0.5 * (b - a) * x);
            0.5 * (b - a) * nodes.iter().map(value).sum::<f64>()
        };
        let middle = 0.5_f64.clamp(from, to);
        let expected = gauss(from, middle) + gauss(middle, to);
        let error = (shape.integral(from, to) - expected).abs();
        prop_assert!(error < 1e-7 * (to - from) * (to - from) + 1e-15, "{error:e}");
    }
}
