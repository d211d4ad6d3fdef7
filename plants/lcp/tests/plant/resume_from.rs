//! Going on from where another plant is, told in words. Told by itself it must go on as if nothing had been said.

use proptest::prelude::*;
use twinrig_kernel::SimTime;
use twinrig_lcp::{Lcp, Options};
use twinrig_legged::{Base, Setup};
use twinrig_runtime::{Plant, PlantState};

use crate::scene::{
    DEFAULT, LEGS, Scene, Way, below, between, built, hanging, passive, pose, robot, standing,
};

/// What remains of a motion when it goes through words: velocities are turned into world axes and back, and what holds is
/// found again, with errors that were being taken back counted from here \[m\]. The motion itself is right to 1e-6 m.
const SAME: f64 = 1e-9;

/// Steps so short that none is ever cut for its error: a plant that is told where it is does not know how long its last good
/// step was, and would otherwise try a longer one.
const FINE: Way = Way {
    step_us: 500,
    ..DEFAULT
};

/// Where `scene` is, in another plant of the same make.
fn told(scene: &Scene, robot: &twinrig_robot::Robot, setup: &Setup, way: Way) -> Scene {
    let mut other = Scene::new(robot, setup, way);
    let state = scene.plant.state().unwrap();
    let lost = other.plant.resume_from(&state).unwrap();
    assert_eq!(lost, Vec::<String>::new(), "it knows its own words");
    let balance = other.energy();
    assert_eq!((balance.residual, balance.exchanged), (0.0, 0.0));
    assert_eq!(
        other.plant.state().unwrap().iter().count(),
        state.iter().count()
    );
    (other.commands, other.now_us) = (scene.commands.clone(), scene.now_us);
    other
}

/// Greatest distance of the feet over so many milliseconds of which nothing happens to the first, and how many those were.
fn apart(scene: &mut Scene, other: &mut Scene, ms: u64) -> (f64, u64) {
    scene.plant.log_events(true);
    let (begun, fallbacks) = (scene.now_us / 1000, scene.plant.work().fallbacks);
    let mut most = 0.0_f64;
    for k in 1..=ms {
        scene.to_ms(begun + k);
        other.to_ms(begun + k);
        if !scene.plant.events().is_empty() || scene.plant.work().fallbacks > fallbacks {
            return (most, k - 1);
        }
        for leg in LEGS {
            let signal = format!("leg/{leg}/foot/position");
            let [a, b] = [scene.read(&signal), other.read(&signal)];
            for (a, b) in a.iter().zip(&b) {
                most = most.max((a - b).abs());
            }
        }
    }
    (most, ms)
}

/// Goes on until nothing has happened for 40 ms: what strikes and rattles leaves gaps and speeds of the size of a solver's
/// tolerance, which are taken back in the course of some steps, and it is not told on which side of it they belong. Some
/// never come to that.
fn calm(scene: &mut Scene) -> bool {
    let mut quiet = 0;
    for _ in 0..300 {
        if quiet == 40 {
            return true;
        }
        scene.plant.log_events(true);
        let fallbacks = scene.plant.work().fallbacks;
        scene.to_ms(scene.now_us / 1000 + 1);
        let happened = !scene.plant.events().is_empty() || scene.plant.work().fallbacks > fallbacks;
        quiet = if happened { 0 } else { quiet + 1 };
    }
    false
}

#[test]
fn a_robot_that_stands_goes_on_standing() {
    let (robot, setup) = (robot(), standing());
    let mut scene = Scene::new(&robot, &setup, FINE);
    scene.to_ms(400);
    let mut other = told(&scene, &robot, &setup, FINE);
    let (most, ms) = apart(&mut scene, &mut other, 100);
    assert_eq!(ms, 100, "nothing happens to what stands");
    assert!(most < SAME, "{most:e} m");
    // The ground holds it at once, and does not catch it later.
    let load = |scene: &mut Scene| scene.value("leg/LF/foot/load");
    let fresh = &mut told(&scene, &robot, &setup, FINE);
    scene.plant.begin_window();
    scene.to_ms(501);
    fresh.to_ms(501);
    let [old, new] = [load(&mut scene), load(fresh)];
    assert!((old - new).abs() < 1e-5 * old, "{old} N and {new} N");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Legs that swing freely never meet anything, so the whole 0.1 s counts.
    #[test]
    fn legs_in_the_air_go_on_as_they_were(
        q in (-15.0..15.0_f64, -28.0..-22.0_f64, 34.0..40.0_f64),
        rates in [-3.0..3.0_f64, -3.0..3.0, -3.0..3.0],
        from in 1..40_u64,
    ) {
        let (robot, setup) = (between(), hanging(pose([q.0, q.1, q.2], rates)));
        let mut scene = Scene::new(&robot, &setup, FINE);
        scene.to_ms(from);
        let mut other = told(&scene, &robot, &setup, FINE);
        let (most, ms) = apart(&mut scene, &mut other, 100);
        prop_assert_eq!(ms, 100, "the scene is made so that nothing is met");
        prop_assert!(most < SAME, "{most:e} m");
    }

    /// A robot that falls, lands, and kneads the ground: up to where something happens next.
    #[test]
    fn a_robot_goes_on_as_it_was_until_something_happens(
        fall in 0.0..0.2_f64,
        swing in [-0.2..0.2_f64, -0.2..0.2],
        from in 1..300_u64,
    ) {
        let robot = robot();
        let setup = Setup { ground: Some(below(fall, 0.6)), ..standing() };
        let mut scene = Scene::new(&robot, &setup, FINE);
        for pair in scene.commands.chunks_mut(2) {
            (pair[0], pair[1]) = (pair[0] + swing[0], pair[1] + swing[1].max(0.0));
        }
        scene.to_ms(from);
        prop_assume!(calm(&mut scene));
        let mut other = told(&scene, &robot, &setup, FINE);
        let (most, ms) = apart(&mut scene, &mut other, 100);
        prop_assert!(most < SAME, "{most:e} m in {ms} ms");
    }
}

#[test]
fn a_toe_is_taken_over_and_hangs_unloaded_where_it_is_not_told() {
    let (robot, setup) = (robot(), hanging(passive()));
    let options = Options {
        setup: setup.clone(),
        method: DEFAULT.method,
        tolerance: DEFAULT.tolerance,
        toe: true,
    };
    let toed = || Lcp::new(&robot, &options, &|_| true).unwrap();
    let mut plant = toed();
    plant.advance(SimTime::from_nanos(50_000_000), &[]).unwrap();
    let state = plant.state().unwrap();
    let toe = state.get("leg/LF/toe").unwrap();
    assert!(toe.len() == 2 && toe[1] != 0.0, "it moves by now: {toe:?}");
    let mut other = toed();
    assert_eq!(other.resume_from(&state).unwrap(), Vec::<String>::new());
    assert_eq!(other.state().unwrap(), state);
    // A plant without toes has no words for them, and one with toes does without.
    let mut without = built(&robot, &setup, DEFAULT).unwrap();
    let lost = without.resume_from(&state).unwrap();
    assert_eq!(lost.len(), 4);
    assert!(lost[0].contains("leg/LF/toe has no place here"), "{lost:?}");
    let lost = other.resume_from(&without.state().unwrap()).unwrap();
    assert_eq!(lost.len(), 4);
    assert!(lost[0].contains("goes with the third segment"), "{lost:?}");
    let state = other.state().unwrap();
    let third = state.get("leg/LF/angles").unwrap()[2];
    let rest = robot.legs[0].leg.toe.unwrap().rest;
    assert_eq!(state.get("leg/LF/toe").unwrap()[0], third + rest);
}

#[test]
fn what_cannot_be_is_refused_and_changes_nothing() {
    let (robot, setup) = (robot(), standing());
    let mut scene = Scene::new(&robot, &setup, FINE);
    scene.to_ms(100);
    let before = scene.plant.save();
    let state = scene.plant.state().unwrap();
    let angles = state.get("leg/RF/angles").unwrap().to_vec();
    // Beyond the closed pantograph by 0.6 rad.
    let folded = [angles[0], angles[1], angles[2] - 0.6];
    let wrong: [(&str, PlantState, &str); 4] = [
        (
            "body",
            state.clone().with("body/velocity", &[f64::NAN, 0.0, 0.0]),
            "not a number",
        ),
        (
            "body",
            state.clone().with("body/orientation", &[0.0; 4]),
            "no attitude",
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
    for (part, state, why) in wrong {
        let fault = scene.plant.resume_from(&state).unwrap_err();
        assert_eq!(fault.part, part);
        assert!(fault.why.contains(why), "{fault}");
        assert_eq!(fault.time.as_nanos(), 100_000_000);
        assert_eq!(scene.plant.save().0, before.0);
    }
    // What is not told stays, and what is not known is said.
    let little = PlantState::at(state.time).with("tail/position", &[1.0]);
    let lost = scene.plant.resume_from(&little).unwrap();
    assert!(
        lost.contains(&"tail/position has no place here".to_owned()),
        "{lost:?}"
    );
    assert_eq!(lost.len(), 4 + 4 * LEGS.len() + 1);
    assert_eq!(scene.plant.state().unwrap(), state);
}

#[test]
fn a_trunk_that_is_held_takes_no_motion_over() {
    let robot = robot();
    let moving = Scene::new(&robot, &standing(), FINE).plant.state().unwrap();
    let moving = moving
        .with("body/velocity", &[0.5, 0.0, 0.1])
        .with("body/angular_velocity", &[0.0, 0.2, 0.3]);
    for (base, lines) in [(Base::Free, 0), (Base::Planar, 1), (Base::Fixed, 2)] {
        let setup = Setup { base, ..standing() };
        let mut scene = Scene::new(&robot, &setup, FINE);
        let lost = scene.plant.resume_from(&moving).unwrap();
        assert_eq!(lost.len(), lines, "{lost:?}");
        assert!(lost.iter().all(|line| line.contains("is held")), "{lost:?}");
        let state = scene.plant.state().unwrap();
        let turning = match base {
            Base::Free => [0.0, 0.2, 0.3],
            Base::Planar => [0.0, 0.2, 0.0],
            Base::Fixed => [0.0; 3],
        };
        assert_eq!(state.get("body/angular_velocity").unwrap(), turning);
    }
}
