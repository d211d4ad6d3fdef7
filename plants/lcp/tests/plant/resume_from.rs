//! Resuming from the state of another plant. A plant resumed from its own state must continue
//! unchanged.

use proptest::prelude::*;
use twinrig_kernel::SimTime;
use twinrig_lcp::{Lcp, Options};
use twinrig_legged::{Base, Setup};
use twinrig_runtime::{Plant, PlantState};
use twinrig_testing::robots::{LEGS, pose, robot};

use crate::harness::{
    DEFAULT, Harness, Integration, build, free_swinging_robot, lcp, lowered_ground, passive_start,
    standing_setup, suspended,
};

/// Deviation after the transfer of a state \[m\]: velocities are transformed to world axes and
/// back, and active constraints are determined again, with their violations as new references. The
/// motion itself is accurate to 1e-6 m.
const TRANSFER_ERROR: f64 = 1e-9;

/// Steps short enough never to be reduced by error control: a resumed plant does not know the last
/// accepted step size and would otherwise try a longer one.
const FINE: Integration = Integration {
    step_us: 500,
    ..DEFAULT
};

/// Returns another plant of the same setup, resumed from the state of `harness`.
fn resumed(
    harness: &Harness,
    robot: &twinrig_robot::Robot,
    setup: &Setup,
    integration: Integration,
) -> Harness {
    let mut other = lcp(robot, setup, integration);
    let state = harness.plant.state().unwrap();
    let messages = other.plant.resume_from(&state).unwrap();
    assert_eq!(messages, Vec::<String>::new(), "all entries are known");
    let balance = other.energy();
    assert_eq!((balance.residual, balance.exchanged), (0.0, 0.0));
    assert_eq!(
        other.plant.state().unwrap().iter().count(),
        state.iter().count()
    );
    (other.commands, other.now_us) = (harness.commands.clone(), harness.now_us);
    other
}

/// Returns the greatest distance of the feet over at most `ms` milliseconds, up to the first event
/// or fallback of the first plant, and the duration compared.
fn max_foot_distance(harness: &mut Harness, other: &mut Harness, ms: u64) -> (f64, u64) {
    harness.plant.log_events(true);
    let (start_ms, fallbacks) = (harness.now_us / 1000, harness.plant.work().fallbacks);
    let mut distance = 0.0_f64;
    for k in 1..=ms {
        harness.advance_to_ms(start_ms + k);
        other.advance_to_ms(start_ms + k);
        if !harness.plant.events().is_empty() || harness.plant.work().fallbacks > fallbacks {
            return (distance, k - 1);
        }
        for leg in LEGS {
            let signal = format!("leg/{leg}/foot/position");
            let [a, b] = [harness.read(&signal), other.read(&signal)];
            for (a, b) in a.iter().zip(&b) {
                distance = distance.max((a - b).abs());
            }
        }
    }
    (distance, ms)
}

/// Advances until 40 ms pass without events; returns whether this was reached. Impacts and
/// chattering leave gaps and velocities of the size of the solver tolerance, which are corrected
/// within some steps, and whose sign the state does not contain. Some motions never settle.
fn run_until_settled(harness: &mut Harness) -> bool {
    let mut quiet = 0;
    for _ in 0..300 {
        if quiet == 40 {
            return true;
        }
        harness.plant.log_events(true);
        let fallbacks = harness.plant.work().fallbacks;
        harness.advance_to_ms(harness.now_us / 1000 + 1);
        let active =
            !harness.plant.events().is_empty() || harness.plant.work().fallbacks > fallbacks;
        quiet = if active { 0 } else { quiet + 1 };
    }
    false
}

#[test]
fn standing_robot_resumes_standing() {
    let (robot, setup) = (robot(), standing_setup());
    let mut harness = lcp(&robot, &setup, FINE);
    harness.advance_to_ms(400);
    let mut other = resumed(&harness, &robot, &setup, FINE);
    let (distance, ms) = max_foot_distance(&mut harness, &mut other, 100);
    assert_eq!(ms, 100, "no events while standing");
    assert!(distance < TRANSFER_ERROR, "{distance:e} m");
    // The ground carries it at once, without a later impact.
    let load = |harness: &mut Harness| harness.value("leg/LF/foot/load");
    let fresh = &mut resumed(&harness, &robot, &setup, FINE);
    harness.plant.begin_window();
    harness.advance_to_ms(501);
    fresh.advance_to_ms(501);
    let [old, new] = [load(&mut harness), load(fresh)];
    assert!((old - new).abs() < 1e-5 * old, "{old} N and {new} N");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Freely swinging legs have no events, so the comparison covers the full 0.1 s.
    #[test]
    fn legs_in_the_air_resume_unchanged(
        q in (-15.0..15.0_f64, -28.0..-22.0_f64, 34.0..40.0_f64),
        rates in [-3.0..3.0_f64, -3.0..3.0, -3.0..3.0],
        from in 1..40_u64,
    ) {
        let (robot, setup) = (free_swinging_robot(), suspended(pose([q.0, q.1, q.2], rates)));
        let mut harness = lcp(&robot, &setup, FINE);
        harness.advance_to_ms(from);
        let mut other = resumed(&harness, &robot, &setup, FINE);
        let (distance, ms) = max_foot_distance(&mut harness, &mut other, 100);
        prop_assert_eq!(ms, 100, "the motion has no events");
        prop_assert!(distance < TRANSFER_ERROR, "{distance:e} m");
    }

    /// A robot falls, lands and moves on the ground; the comparison ends with the next event.
    #[test]
    fn robot_resumes_unchanged_until_next_event(
        fall in 0.0..0.2_f64,
        swing in [-0.2..0.2_f64, -0.2..0.2],
        from in 1..300_u64,
    ) {
        let robot = robot();
        let setup = Setup { ground: Some(lowered_ground(fall, 0.6)), ..standing_setup() };
        let mut harness = lcp(&robot, &setup, FINE);
        for pair in harness.commands.chunks_mut(2) {
            (pair[0], pair[1]) = (pair[0] + swing[0], pair[1] + swing[1].max(0.0));
        }
        harness.advance_to_ms(from);
        prop_assume!(run_until_settled(&mut harness));
        let mut other = resumed(&harness, &robot, &setup, FINE);
        let (distance, ms) = max_foot_distance(&mut harness, &mut other, 100);
        prop_assert!(distance < TRANSFER_ERROR, "{distance:e} m in {ms} ms");
    }
}

#[test]
fn toe_is_resumed_and_unloaded_if_missing() {
    let (robot, setup) = (robot(), suspended(passive_start()));
    let options = Options {
        constraints: twinrig_lcp::Constraints::Rigid,
        setup: setup.clone(),
        method: DEFAULT.method,
        tolerance: DEFAULT.tolerance,
        toe: true,
        features: twinrig_lcp::Features::Detected,
    };
    let with_toes = || Lcp::new(&robot, &options, &|_| true).unwrap();
    let mut plant = with_toes();
    plant.advance(SimTime::from_nanos(50_000_000), &[]).unwrap();
    let state = plant.state().unwrap();
    let toe = state.get("leg/LF/toe").unwrap();
    assert!(
        toe.len() == 2 && toe[1] != 0.0,
        "the toe must have moved: {toe:?}"
    );
    let mut other = with_toes();
    assert_eq!(other.resume_from(&state).unwrap(), Vec::<String>::new());
    assert_eq!(other.state().unwrap(), state);
    // A plant without toes reports toe states as unknown, and one with toes resumes without them.
    let mut without = build(&robot, &setup, DEFAULT).unwrap();
    let messages = without.resume_from(&state).unwrap();
    assert_eq!(messages.len(), 4);
    assert!(
        messages[0].contains("leg/LF/toe is not a state of this plant"),
        "{messages:?}"
    );
    let messages = other.resume_from(&without.state().unwrap()).unwrap();
    assert_eq!(messages.len(), 4);
    assert!(
        messages[0].contains("follows the third segment"),
        "{messages:?}"
    );
    let state = other.state().unwrap();
    let third = state.get("leg/LF/angles").unwrap()[2];
    let rest = robot.legs[0].leg.toe.unwrap().rest;
    assert_eq!(state.get("leg/LF/toe").unwrap()[0], third + rest);
}

#[test]
fn invalid_states_are_rejected_without_effect() {
    let (robot, setup) = (robot(), standing_setup());
    let mut harness = lcp(&robot, &setup, FINE);
    harness.advance_to_ms(100);
    let before = harness.plant.save();
    let state = harness.plant.state().unwrap();
    let angles = state.get("leg/RF/angles").unwrap().to_vec();
    // 0.6 rad beyond the closed pantograph.
    let folded = [angles[0], angles[1], angles[2] - 0.6];
    let invalid: [(&str, PlantState, &str); 4] = [
        (
            "body",
            state.clone().with("body/velocity", &[f64::NAN, 0.0, 0.0]),
            "not finite",
        ),
        (
            "body",
            state.clone().with("body/orientation", &[0.0; 4]),
            "not an attitude",
        ),
        (
            "body",
            state
                .clone()
                .with("leg/LH/rates", &[0.0, f64::INFINITY, 0.0]),
            "LH",
        ),
        (
            "leg/RF/closed",
            state.clone().with("leg/RF/angles", &folded),
            "passed by",
        ),
    ];
    for (part, state, cause) in invalid {
        let fault = harness.plant.resume_from(&state).unwrap_err();
        assert_eq!(fault.part, part);
        assert!(fault.why.contains(cause), "{fault}");
        assert_eq!(fault.time.as_nanos(), 100_000_000);
        assert_eq!(harness.plant.save().0, before.0);
    }
    // Missing entries keep their values, and unknown entries are reported.
    let partial = PlantState::at(state.time).with("tail/position", &[1.0]);
    let messages = harness.plant.resume_from(&partial).unwrap();
    assert!(
        messages.contains(&"tail/position is not a state of this plant".to_owned()),
        "{messages:?}"
    );
    assert_eq!(messages.len(), 4 + 4 * LEGS.len() + 1);
    assert_eq!(harness.plant.state().unwrap(), state);
}

#[test]
fn constrained_trunk_discards_motion() {
    let robot = robot();
    let moving = lcp(&robot, &standing_setup(), FINE).plant.state().unwrap();
    let moving = moving
        .with("body/velocity", &[0.5, 0.0, 0.1])
        .with("body/angular_velocity", &[0.0, 0.2, 0.3]);
    for (base, count) in [(Base::Free, 0), (Base::Planar, 1), (Base::Fixed, 2)] {
        let setup = Setup {
            base,
            ..standing_setup()
        };
        let mut harness = lcp(&robot, &setup, FINE);
        let messages = harness.plant.resume_from(&moving).unwrap();
        assert_eq!(messages.len(), count, "{messages:?}");
        assert!(
            messages
                .iter()
                .all(|message| message.contains("constrained directions")),
            "{messages:?}"
        );
        let state = harness.plant.state().unwrap();
        let expected = match base {
            Base::Free => [0.0, 0.2, 0.3],
            Base::Planar => [0.0, 0.2, 0.0],
            Base::Fixed => [0.0; 3],
        };
        assert_eq!(state.get("body/angular_velocity").unwrap(), expected);
    }
}
